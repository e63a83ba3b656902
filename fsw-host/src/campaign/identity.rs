//! What a campaign is about, and how two of them differ.

use std::fs;
use std::io;
use std::ops::Range;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::HostError;

/// Runs of one chunk: what a kill or a full disk may cost each thread.
pub const RUNS_PER_CHUNK: u64 = 16;
/// The file that says what a campaign is about.
pub const IDENTITY: &str = "campaign.json";

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

    /// The run behind the last.
    #[must_use]
    pub fn end(&self) -> u64 {
        self.first + self.runs
    }

    /// The runs of a chunk.
    #[must_use]
    pub fn chunk(&self, number: u64) -> Range<u64> {
        (number * RUNS_PER_CHUNK).max(self.first)..((number + 1) * RUNS_PER_CHUNK).min(self.end())
    }

    /// Numbers of its chunks.
    #[must_use]
    pub fn chunks(&self) -> Range<u64> {
        self.first / RUNS_PER_CHUNK..self.end().div_ceil(RUNS_PER_CHUNK)
    }
}

/// What the campaign in a folder is about.
///
/// # Errors
/// There is none.
pub fn read_identity(path: &Path) -> Result<Identity, HostError> {
    let file = path.join(IDENTITY);
    let text = fs::read_to_string(&file).map_err(|e| match e.kind() {
        io::ErrorKind::NotFound if path.is_dir() => {
            HostError::Option(format!("{} is no campaign folder: there is no {IDENTITY} in it", path.display()))
        }
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
            HostError::Option(format!("{} is no campaign folder", path.display()))
        }
        _ => HostError::file("read", &file)(e),
    })?;
    serde_json::from_str(&text).map_err(|e| HostError::Option(format!("{} is damaged: {e}", file.display())))
}
