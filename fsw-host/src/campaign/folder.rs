//! The folder of a campaign: what it is about, the chunks that are done, the final table.
//!
//! A chunk holds the rows of a fixed range of run numbers. It gets its name only when it is whole, so a program that is
//! killed leaves whole chunks and at most one unfinished file beside them. The final files come from the rows alone, in
//! the order of their numbers: who flew them, when and in how many sittings leaves no trace.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::table::{Heading, Reader, Row, Writer, run_of};
use crate::error::HostError;
use crate::runfolder::write_whole;

/// Runs of one chunk.
pub const RUNS_PER_CHUNK: u64 = 32;
/// The folder of unfinished campaigns' chunks.
const CHUNKS: &str = "chunks";
/// What a campaign is about.
const IDENTITY: &str = "campaign.json";
/// The table of all runs.
pub const RUNS: &str = "runs.parquet";
/// Files of a campaign folder; `--force` removes these, the chunks, and nothing else.
const FILES: [&str; 5] = [IDENTITY, RUNS, "scenario.toml", SUMMARY, REPORT];
/// The figures.
pub const SUMMARY: &str = "summary.json";
/// The page.
pub const REPORT: &str = "report.html";

/// What a campaign is about: two with the same identity have the same results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Identity {
    /// Name of the scenario.
    pub scenario: String,
    /// SHA-256 of the resolved scenario, hexadecimal.
    pub scenario_sha256: String,
    /// Seed of the dispersions.
    pub seed: u64,
    /// First run.
    pub first: u64,
    /// Number of runs.
    pub runs: u64,
    /// Every how many runs are flown again for the split of the miss; 0 for none.
    pub split: u64,
    /// SHA-256 of the program that flies, hexadecimal.
    pub program_sha256: String,
    /// Arguments that tell `fly` the same scenario.
    pub fly: Vec<String>,
}

impl Identity {
    /// The first thing in which a campaign differs from another, as a sentence.
    #[must_use]
    pub fn differs_from(&self, other: &Self) -> Option<String> {
        let says = |what: &str, ours: &dyn std::fmt::Display, theirs: &dyn std::fmt::Display| {
            Some(format!("{what} is {theirs} there and {ours} here"))
        };
        if self.scenario != other.scenario {
            return says("the scenario", &self.scenario, &other.scenario);
        }
        if self.scenario_sha256 != other.scenario_sha256 {
            return Some(format!("a field of scenario {} differs", self.scenario));
        }
        let numbers = [
            ("the seed", self.seed, other.seed),
            ("the first run", self.first, other.first),
            ("the number of runs", self.runs, other.runs),
            ("the spacing of the split flights", self.split, other.split),
        ];
        if let Some((what, ours, theirs)) = numbers.iter().find(|(_, ours, theirs)| ours != theirs) {
            return says(what, ours, theirs);
        }
        (self.program_sha256 != other.program_sha256)
            .then(|| "it was begun by another build of this program".to_owned())
    }

    /// The command that flies one run of the campaign alone.
    #[must_use]
    pub fn refly(&self, run: u64) -> String {
        format!("aeroshell fly {} --seed {} --run {run}", self.fly.join(" "), self.seed)
    }

    /// Number of the chunk of a run, and the range of runs in a chunk.
    fn chunk(&self, number: u64) -> std::ops::Range<u64> {
        let end = self.first + self.runs;
        (number * RUNS_PER_CHUNK).max(self.first)..((number + 1) * RUNS_PER_CHUNK).min(end)
    }

    fn chunks(&self) -> std::ops::Range<u64> {
        self.first / RUNS_PER_CHUNK..(self.first + self.runs).div_ceil(RUNS_PER_CHUNK)
    }
}

/// An open campaign folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    identity: Identity,
}

impl Folder {
    /// The folder the user named: new, or one in which the same campaign was begun. `force` replaces another campaign.
    ///
    /// # Errors
    /// It holds something else, or cannot be made.
    pub fn at(path: &Path, identity: &Identity, force: bool) -> Result<Self, HostError> {
        if path.exists() && !path.is_dir() {
            return Err(HostError::NotAFolder(path.to_owned()));
        }
        let found = read_identity(path).ok();
        if let Some(found) = &found
            && !force
            && let Some(difference) = identity.differs_from(found)
        {
            let path = path.display();
            return Err(HostError::Option(format!(
                "{path} holds another campaign: {difference}; choose another folder with --out, or replace it with --force"
            )));
        }
        let folder = Self { path: path.to_owned(), identity: identity.clone() };
        if found.is_none() || force {
            folder.clear(force)?;
        }
        fs::create_dir_all(folder.chunk_folder()).map_err(HostError::file("create", path))?;
        let text = serde_json::to_string_pretty(identity).map_err(io::Error::from);
        let text = text.map_err(HostError::file("write", path.join(IDENTITY)))?;
        if found.as_ref() != Some(identity) {
            folder.write(IDENTITY, |out| writeln!(out, "{text}"))?;
        }
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

    /// Removes an earlier campaign, or refuses when something else is there.
    fn clear(&self, force: bool) -> Result<(), HostError> {
        if !self.path.exists() {
            return Ok(());
        }
        let list = || fs::read_dir(&self.path)?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>();
        let names = list().map_err(HostError::file("read", &self.path))?;
        let ours = |name: &std::ffi::OsString| {
            let name = name.to_string_lossy();
            let name = name.strip_suffix(".part").unwrap_or(&name);
            FILES.contains(&name) || name == CHUNKS
        };
        if names.iter().any(|name| !(force && ours(name))) {
            return Err(HostError::Occupied(self.path.clone()));
        }
        for name in names {
            let path = self.path.join(&name);
            let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
            removed.map_err(HostError::file("replace", path))?;
        }
        Ok(())
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

    fn chunk_folder(&self) -> PathBuf {
        self.path.join(CHUNKS)
    }

    fn chunk_path(&self, number: u64) -> PathBuf {
        self.chunk_folder().join(format!("{number:012}.parquet"))
    }

    /// Chunks that are still to be flown.
    #[must_use]
    pub fn open_chunks(&self) -> Vec<std::ops::Range<u64>> {
        if self.runs().exists() {
            return Vec::new();
        }
        let is_done = |number: &u64| {
            let runs = self.identity.chunk(*number);
            // A file cut short by a full disk or a torn page is no chunk.
            Reader::open(&self.chunk_path(*number)).is_ok_and(|table| table.rows() == runs.end - runs.start)
        };
        self.identity.chunks().filter(|number| !is_done(number)).map(|number| self.identity.chunk(number)).collect()
    }

    /// Keeps the rows of a whole chunk, in any order.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn write_chunk(&self, headings: &[Heading], mut rows: Vec<Row>) -> Result<(), HostError> {
        rows.sort_by_key(run_of);
        let number = rows.first().map_or(0, run_of) / RUNS_PER_CHUNK;
        write_whole(&self.chunk_path(number), |out| {
            let mut writer = Writer::new(headings, out)?;
            rows.into_iter().try_for_each(|row| writer.push(row))?;
            writer.finish()
        })
    }

    /// Makes the final table out of the chunks and removes them.
    ///
    /// # Errors
    /// A chunk cannot be read, or the table not be written.
    pub fn gather(&self, headings: &[Heading]) -> Result<(), HostError> {
        if !self.runs().exists() {
            let chunks: Vec<PathBuf> = self.identity.chunks().map(|number| self.chunk_path(number)).collect();
            self.concatenate(headings, &chunks)?;
        }
        if self.chunk_folder().exists() {
            fs::remove_dir_all(self.chunk_folder()).map_err(HostError::file("remove", self.chunk_folder()))?;
        }
        Ok(())
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

/// The last part of a path, which tells campaigns apart.
#[must_use]
pub fn short(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

/// What the campaign in a folder is about.
///
/// # Errors
/// There is none.
pub fn read_identity(path: &Path) -> Result<Identity, HostError> {
    let file = path.join(IDENTITY);
    let text = fs::read_to_string(&file).map_err(HostError::file("read", &file))?;
    serde_json::from_str(&text).map_err(|e| HostError::Option(format!("{} is no campaign: {e}", file.display())))
}
