//! Entries of a ranking that are done, a line of JSON each: what was interrupted goes on where it was.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::entry::Entry;
use crate::error::HostError;
use crate::runfolder::write_whole;

/// The file in the folder of a ranking, as long as it is not finished.
const FILE: &str = "entries.jsonl";

/// What entries must have in common to stand in one table.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Identity {
    /// Cases and digests of their scenarios.
    pub cases: Vec<(String, String)>,
    /// Seed of the dispersions.
    pub seed: u64,
    /// Filters in the order of the entries.
    pub filters: Vec<String>,
    /// No closed loop.
    pub open_loop: bool,
    /// Digest of the program.
    pub program_sha256: String,
}

impl Identity {
    fn differs_in(&self, other: &Self) -> &'static str {
        if self.cases != other.cases {
            "scenario or cases"
        } else if self.seed != other.seed {
            "seed"
        } else if self.filters != other.filters {
            "filters"
        } else if self.open_loop != other.open_loop {
            "--open-loop"
        } else {
            "build of this program"
        }
    }
}

/// A finished entry.
#[derive(Serialize, Deserialize)]
struct Line {
    case: String,
    run: u64,
    entry: Entry,
}

/// The entries of a ranking that is going on.
pub(super) struct Kept {
    path: PathBuf,
    file: Mutex<File>,
    done: BTreeMap<(String, u64), Entry>,
}

impl Kept {
    /// Opens what an interruption left in `folder`, or begins.
    ///
    /// # Errors
    /// The folder holds the unfinished entries of another ranking, or cannot be written.
    pub fn open(folder: &Path, identity: &Identity) -> Result<Self, HostError> {
        let path = folder.join(FILE);
        let done = match File::open(&path) {
            Ok(file) => read(&path, BufReader::new(file), identity)?,
            Err(e) if e.kind() == ErrorKind::NotFound => BTreeMap::new(),
            Err(e) => return Err(HostError::file("read", &path)(e)),
        };
        // Written anew: a line that was cut short is gone, and the next one begins on a line of its own.
        write_whole(&path, |out| {
            serde_json::to_writer(&mut *out, identity)?;
            writeln!(out)?;
            for ((case, run), entry) in &done {
                serde_json::to_writer(&mut *out, &Line { case: case.clone(), run: *run, entry: entry.clone() })?;
                writeln!(out)?;
            }
            Ok(())
        })?;
        let file = File::options().append(true).open(&path).map_err(HostError::file("write", &path))?;
        Ok(Self { path, file: Mutex::new(file), done })
    }

    /// An entry that is there already.
    pub fn find(&self, case: &str, run: u64) -> Option<&Entry> {
        self.done.get(&(case.to_owned(), run))
    }

    /// How many are there.
    pub fn len(&self) -> usize {
        self.done.len()
    }

    /// Keeps one more.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep(&self, case: &str, run: u64, entry: &Entry) -> Result<(), HostError> {
        let mut line = serde_json::to_vec(&Line { case: case.to_owned(), run, entry: entry.clone() })
            .map_err(|e| HostError::file("write", &self.path)(e.into()))?;
        line.push(b'\n');
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(&line).map_err(HostError::file("write", &self.path))
    }

    /// The ranking is written: its entries are no longer needed.
    ///
    /// # Errors
    /// The file cannot be removed.
    pub fn finish(self) -> Result<(), HostError> {
        fs::remove_file(&self.path).map_err(HostError::file("remove", &self.path))
    }
}

/// All whole lines; an entry whose line is damaged is flown again.
fn read(path: &Path, file: impl BufRead, identity: &Identity) -> Result<BTreeMap<(String, u64), Entry>, HostError> {
    let mut lines = file.lines().map_while(Result::ok);
    let Some(first) = lines.next() else { return Ok(BTreeMap::new()) };
    let Ok(found) = serde_json::from_str::<Identity>(&first) else {
        let what = format!("{} is no list of entries of a ranking: choose another folder with --out", path.display());
        return Err(HostError::Option(what));
    };
    if found != *identity {
        return Err(HostError::Option(format!(
            "{} holds an unfinished ranking of another {}: choose another folder with --out, or remove that file",
            path.display(),
            identity.differs_in(&found)
        )));
    }
    Ok(lines
        .filter_map(|line| serde_json::from_str::<Line>(&line).ok())
        .map(|line| ((line.case, line.run), line.entry))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::super::entry::{Curve, Judged};
    use super::*;

    fn identity() -> Identity {
        Identity {
            cases: vec![("plain".into(), "ab".into())],
            seed: 7,
            filters: vec!["ekf".into()],
            open_loop: false,
            program_sha256: "cd".into(),
        }
    }

    fn entry(k: u32) -> Entry {
        let curve = Curve::of(&[[f64::from(k) / 3.0, 0.1]]);
        Entry { bound: curve.clone(), flown: vec![Judged { errors: curve, nees: 0.1 + 0.2, ..Judged::default() }] }
    }

    #[test]
    fn what_was_kept_is_found_again_to_the_bit_and_a_line_cut_short_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let kept = Kept::open(folder.path(), &identity()).expect("begun");
        (0..3).for_each(|k| kept.keep("plain", u64::from(k), &entry(k)).expect("kept"));
        drop(kept);
        let path = folder.path().join(FILE);
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 20]).expect("cut");
        let again = Kept::open(folder.path(), &identity()).expect("goes on");
        assert_eq!((again.len(), again.find("plain", 1)), (2, Some(&entry(1))));
        again.keep("plain", 2, &entry(2)).expect("kept");
        assert_eq!(Kept::open(folder.path(), &identity()).expect("whole").len(), 3);
        again.finish().expect("removed");
        assert!(!path.exists());
    }

    #[test]
    fn entries_of_another_ranking_are_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(Kept::open(folder.path(), &identity()).expect("begun"));
        let other = Identity { seed: 8, ..identity() };
        let told = Kept::open(folder.path(), &other).err().expect("refused").to_string();
        assert!(told.contains("another seed") && told.contains(FILE), "{told}");
        fs::write(folder.path().join(FILE), "soup\n").expect("written");
        assert!(Kept::open(folder.path(), &identity()).is_err());
    }
}
