//! What can go wrong before a flight begins; each is one sentence and ends the program with exit code 2.

use std::path::PathBuf;

use hil_sim::scenario::ScenarioError;
use hil_sim::session::SessionError;
use thiserror::Error;

use crate::ends::ComputerError;
use crate::linklog::LinkLogError;
use crate::report::ReportError;
use crate::target::TargetError;

/// Bad input, or a place that cannot be written.
#[derive(Debug, Error)]
pub enum HostError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// A run folder that holds something.
    #[error(
        "output folder {} is occupied: choose another with --out, or replace its run with --force",
        .0.display()
    )]
    Occupied(PathBuf),
    /// A file that exists.
    #[error("output file {} exists: choose another with --out, or replace it with --force", .0.display())]
    FileExists(PathBuf),
    /// A file where a folder is needed.
    #[error("output folder {} is a file: choose another with --out", .0.display())]
    NotAFolder(PathBuf),
    /// A folder where a file is needed.
    #[error("output file {} is a folder: choose another with --out", .0.display())]
    NotAFile(PathBuf),
    /// A file or folder that cannot be used.
    #[error("cannot {action} {}: {source}", .path.display())]
    File {
        /// What was tried.
        action: &'static str,
        /// On what.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A link log that cannot be read.
    #[error("cannot read {}: {source}", .path.display())]
    LinkLog {
        /// The file.
        path: PathBuf,
        /// Why.
        source: LinkLogError,
    },
    /// The report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// The flight computer somewhere else cannot be started.
    #[error(transparent)]
    Target(#[from] TargetError),
    /// The flight computer is lost.
    #[error(transparent)]
    Computer(#[from] ComputerError),
    /// The user stopped what was going on.
    #[error("interrupted: the same command goes on where it was")]
    Interrupted,
    /// An option with a bad value.
    #[error("{0}")]
    Option(String),
    /// The session cannot be opened: nobody there, another protocol, or a scenario that cannot be flown.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The other end cannot be reached or speaks another language.
    #[error("{0}")]
    Link(String),
}

impl HostError {
    /// Wraps an input/output error with what was tried on which path.
    pub fn file(action: &'static str, path: impl Into<PathBuf>) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.into();
        move |source| Self::File { action, path, source }
    }
}
