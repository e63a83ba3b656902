//! The report of a flight: one self-contained HTML page, and the one picture that tells the flight.
//!
//! [`plot`] is the toolkit, [`figures`] describe what to draw, `page` sets them; nothing here changes a result.

pub mod figures;
mod overview;
mod page;
pub mod palette;
pub mod plot;
#[cfg(test)]
mod synthetic;
mod tables;

use std::io;
use std::path::{Path, PathBuf};

use crate::record::FlightRecord;
use plot::PlotError;

/// A report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The plotting library failed.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// The file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
}

/// Writes the report of `record` to `path`: one HTML file that needs nothing else. Incomplete flights give a page
/// that says what is missing.
///
/// # Errors
/// When a plot cannot be drawn or the file cannot be written.
pub fn write(record: &FlightRecord, path: &Path) -> Result<(), ReportError> {
    save(path, &page::html(record)?)
}

/// Writes the overview picture of `record` to `path`.
///
/// # Errors
/// When it cannot be drawn or the file cannot be written.
pub fn write_overview(record: &FlightRecord, path: &Path) -> Result<(), ReportError> {
    save(path, &overview::svg(record)?)
}

/// The overview picture as SVG: the descent over the ground coloured by load, the bank history and the end about the
/// target. Empty when it cannot be drawn.
#[must_use]
pub fn overview_svg(record: &FlightRecord) -> String {
    overview::svg(record).unwrap_or_default()
}

fn save(path: &Path, content: &str) -> Result<(), ReportError> {
    std::fs::write(path, content).map_err(|source| ReportError::Write { path: path.to_owned(), source })
}
