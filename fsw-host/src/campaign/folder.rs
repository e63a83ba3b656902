//! The folder of a campaign: what it is about, the chunks that are done, the final table.
//!
//! The final files come from the rows alone, in the order of their numbers: who flew them, when and in how many sittings
//! leaves no trace.

use std::ffi::OsString;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::chunks::Chunks;
use super::identity::IDENTITY;
pub use super::identity::{Identity, read_identity};
use super::table::{Heading, Reader, Row, Writer};
use crate::error::HostError;
use crate::runfolder::write_whole;
use hil_sim::scenario::Scenario;

/// The folder of unfinished campaigns' chunks.
const CHUNKS: &str = "chunks";
/// Ends the name of a file that is not whole yet.
const PART: &str = ".part";
/// The table of all runs.
pub const RUNS: &str = "runs.parquet";
/// Files of a campaign folder; `--force` removes these, the chunks, and nothing else.
const FILES: [&str; 5] = [IDENTITY, RUNS, SCENARIO, SUMMARY, REPORT];
/// What was flown, resolved.
pub const SCENARIO: &str = "scenario.toml";
/// The figures.
pub const SUMMARY: &str = "summary.json";
/// The page.
pub const REPORT: &str = "report.html";

/// An open campaign folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    identity: Identity,
    chunks: Chunks,
    /// Held open for as long as the folder is in use.
    _lock: File,
}

impl Folder {
    /// The folder the user named: new, or one in which the same campaign was begun. `force` replaces another campaign.
    ///
    /// # Errors
    /// It holds something else, somebody else is at work in it, or it cannot be made.
    pub fn at(path: &Path, identity: &Identity, force: bool) -> Result<Self, HostError> {
        if path.exists() && !path.is_dir() {
            return Err(HostError::NotAFolder(path.to_owned()));
        }
        let mut found = read_identity(path).ok();
        if let Some(found) = &found
            && !force
            && let Some(difference) = identity.differs_from(found)
        {
            let path = path.display();
            return Err(HostError::Option(format!(
                "{path} holds another campaign: {difference}; choose another folder with --out, or replace it with --force"
            )));
        }
        // Nobody else's campaign is taken away under their hands.
        let earlier = found.as_ref().map(|_| lock(path)).transpose()?;
        if found.is_none() || force {
            clear(path, force)?;
            found = None;
        }
        drop(earlier);
        fs::create_dir_all(path).map_err(HostError::file("create", path))?;
        if found.is_none() {
            let text = serde_json::to_string_pretty(identity).map_err(io::Error::from);
            let text = text.map_err(HostError::file("write", path.join(IDENTITY)))?;
            write_whole(&path.join(IDENTITY), |out| writeln!(out, "{text}"))?;
        }
        let chunks = Chunks::at(path.join(CHUNKS));
        let folder = Self { path: path.to_owned(), identity: identity.clone(), chunks, _lock: lock(path)? };
        folder.chunks.create()?;
        Ok(folder)
    }

    /// The folder `NAME` in `parent` if the same campaign was begun or ended there, or the next free `NAME-2`, `NAME-3`, …
    ///
    /// # Errors
    /// No folder can be made there.
    pub fn fresh(parent: &Path, name: &str, identity: &Identity) -> Result<Self, HostError> {
        let mut number = 1u32;
        loop {
            let path = if number == 1 { parent.join(name) } else { parent.join(format!("{name}-{number}")) };
            if !path.exists() || read_identity(&path).is_ok_and(|found| found == *identity) {
                return Self::at(&path, identity, false);
            }
            number = number.saturating_add(1);
        }
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// What it is about.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Where the table of all runs is, or will be.
    #[must_use]
    pub fn runs(&self) -> PathBuf {
        self.path.join(RUNS)
    }

    /// Chunks that are still to be flown.
    ///
    /// # Errors
    /// Those that are done cannot be read.
    pub fn open_chunks(&self) -> Result<Vec<Range<u64>>, HostError> {
        if self.runs().exists() { Ok(Vec::new()) } else { self.chunks.open(&self.identity) }
    }

    /// Keeps the rows of a whole chunk, in any order.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write_chunk(&self, headings: &[Heading], rows: Vec<Row>) -> Result<(), HostError> {
        self.chunks.write(headings, rows)
    }

    /// Makes the final table out of the chunks and removes them.
    ///
    /// # Errors
    /// A chunk cannot be read, or the table not be written.
    pub fn gather(&self, headings: &[Heading]) -> Result<(), HostError> {
        if !self.runs().exists() {
            let done: Vec<PathBuf> = self.chunks.done()?.into_values().collect();
            if done.len() as u64 != self.identity.chunks().end - self.identity.chunks().start {
                let path = self.path.display();
                let why = format!(
                    "a chunk in {path} was damaged after it was written: the same command flies its runs again"
                );
                return Err(HostError::Option(why));
            }
            self.concatenate(headings, &done)?;
        }
        self.chunks.remove()
    }

    /// Writes the rows of tables, one behind the other, as the table of all runs.
    ///
    /// # Errors
    /// A table cannot be read, or the result not be written.
    pub fn concatenate(&self, headings: &[Heading], tables: &[PathBuf]) -> Result<(), HostError> {
        self.write(RUNS, |out| {
            let mut writer = Writer::new(headings, out)?;
            for table in tables {
                let named = |e: io::Error| io::Error::new(e.kind(), format!("{}: {e}", table.display()));
                let reader = Reader::open(table).map_err(named)?;
                if reader.headings() != headings {
                    return Err(named(io::Error::other("its columns are not those of this program")));
                }
                reader.for_each_row(|row| writer.push(row))?;
            }
            writer.finish()
        })
    }

    /// Writes a file under a temporary name and gives it its own once it is whole.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(
        &self,
        name: &str,
        fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), HostError> {
        write_whole(&self.path.join(name), fill)
    }
}

/// What the campaign in a folder flew.
///
/// # Errors
/// The file is missing, or is no longer what was flown.
pub fn read_scenario(path: &Path, identity: &Identity) -> Result<Scenario, HostError> {
    let file = path.join(SCENARIO);
    let scenario = Scenario::resolve(&file.to_string_lossy(), &[])?;
    if super::sha256(scenario.to_toml().as_bytes()) != identity.scenario_sha256 {
        return Err(HostError::Option(format!("{} is not the scenario that was flown", file.display())));
    }
    Ok(scenario)
}

/// The last part of a path, which tells campaigns apart.
#[must_use]
pub fn short(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// Keeps other programs out of a campaign for as long as the file is open.
fn lock(path: &Path) -> Result<File, HostError> {
    let file = path.join(IDENTITY);
    let opened = File::open(&file).map_err(HostError::file("read", &file))?;
    // A file system without locks does without.
    if let Err(TryLockError::WouldBlock) = opened.try_lock() {
        let path = path.display();
        return Err(HostError::Option(format!("another program is flying the campaign in {path}: wait for its end")));
    }
    Ok(opened)
}

/// Removes an earlier campaign, or refuses when something else is there. Files that were never finished are nobody's.
fn clear(path: &Path, force: bool) -> Result<(), HostError> {
    if !path.exists() {
        return Ok(());
    }
    let list = || fs::read_dir(path)?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>();
    let names = list().map_err(HostError::file("read", path))?;
    let ours = |name: &OsString| {
        let name = name.to_string_lossy();
        match name.strip_suffix(PART) {
            Some(name) => FILES.contains(&name),
            None => force && (FILES.contains(&name.as_ref()) || name == CHUNKS),
        }
    };
    if let Some(other) = names.iter().find(|name| !ours(name)) {
        let (path, other) = (path.display(), other.to_string_lossy());
        let why = if FILES.contains(&other.as_ref()) || other == CHUNKS {
            format!(
                "holds {other} of a campaign whose {IDENTITY} is missing or damaged: choose another folder with --out, or replace it with --force"
            )
        } else {
            format!("is occupied by {other}, which no campaign writes: choose another folder with --out")
        };
        return Err(HostError::Option(format!("output folder {path} {why}")));
    }
    // What says that a campaign is here goes last: cut short, this can be done again.
    let (last, first): (Vec<_>, Vec<_>) = names.into_iter().partition(|name| name == IDENTITY);
    for name in first.into_iter().chain(last) {
        let path = path.join(&name);
        let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        removed.map_err(HostError::file("replace", path))?;
    }
    Ok(())
}
