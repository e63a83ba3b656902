//! The rows that are done: a file for every chunk, a fixed range of run numbers.
//!
//! A chunk gets its name only when it is whole, and the name carries a digest of its bytes. So what a kill, a full disk or
//! a failing one leaves behind is told from a chunk, and its runs are flown again.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::identity::{Identity, RUNS_PER_CHUNK};
use super::table::{Heading, Row, Writer, run_of};
use crate::error::HostError;
use crate::runfolder::write_whole;

/// Ends the name of a chunk.
const EXTENSION: &str = ".parquet";
/// Characters of the digest in a name.
const DIGEST: usize = 16;

/// The folder of chunks.
#[derive(Debug)]
pub struct Chunks {
    path: PathBuf,
}

impl Chunks {
    /// Those in a folder.
    #[must_use]
    pub fn at(path: PathBuf) -> Self {
        Self { path }
    }

    /// Makes the folder.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn create(&self) -> Result<(), HostError> {
        fs::create_dir_all(&self.path).map_err(HostError::file("create", &self.path))
    }

    /// Chunks that are still to be flown.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn open(&self, identity: &Identity) -> Result<Vec<Range<u64>>, HostError> {
        let done = self.done()?;
        let open = identity.chunks().filter(|number| !done.contains_key(number));
        Ok(open.map(|number| identity.chunk(number)).collect())
    }

    /// Keeps the rows of a whole chunk, in any order.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write(&self, headings: &[Heading], mut rows: Vec<Row>) -> Result<(), HostError> {
        rows.sort_by_key(run_of);
        let number = rows.first().map_or(0, run_of) / RUNS_PER_CHUNK;
        let encode = || {
            let mut bytes = Vec::new();
            let mut writer = Writer::new(headings, &mut bytes)?;
            rows.into_iter().try_for_each(|row| writer.push(row))?;
            writer.finish().map(|()| bytes)
        };
        let bytes = encode().map_err(HostError::file("write", &self.path))?;
        let name = format!("{number:012}-{}{EXTENSION}", digest(&bytes));
        write_whole(&self.path.join(name), |out| out.write_all(&bytes))
    }

    /// The whole chunks by their numbers.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn done(&self) -> Result<BTreeMap<u64, PathBuf>, HostError> {
        let list = || fs::read_dir(&self.path)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>();
        let paths = list().map_err(HostError::file("read", &self.path))?;
        Ok(paths.into_iter().filter_map(|path| Some((number_of(&path)?, path))).collect())
    }

    /// Removes the folder.
    ///
    /// # Errors
    /// It cannot be removed.
    pub fn remove(&self) -> Result<(), HostError> {
        if self.path.exists() {
            fs::remove_dir_all(&self.path).map_err(HostError::file("remove", &self.path))?;
        }
        Ok(())
    }
}

/// Number of a chunk, if the file is one and has the bytes that it was written with.
fn number_of(path: &Path) -> Option<u64> {
    let (number, wanted) = path.file_name()?.to_str()?.strip_suffix(EXTENSION)?.split_once('-')?;
    let number = number.parse().ok()?;
    (digest(&fs::read(path).ok()?) == wanted).then_some(number)
}

fn digest(bytes: &[u8]) -> String {
    let mut text = super::sha256(bytes);
    text.truncate(DIGEST);
    text
}
