//! The table of a campaign, column by column, as figures and pages want it.

use std::io;
use std::path::Path;

use super::identity::Identity;
use super::table::{Cell, Reader};
use crate::error::HostError;

/// The table with its columns at hand.
pub struct Runs {
    reader: Reader,
}

impl Runs {
    /// The table of a complete campaign.
    ///
    /// # Errors
    /// It cannot be read, or holds other runs than those of the campaign.
    pub fn open(table: &Path, identity: &Identity) -> Result<Self, HostError> {
        let read = || {
            let runs = Self::new(Reader::open(table)?);
            runs.numbers("run").map(|numbers| (runs, numbers))
        };
        let (runs, numbers) = read().map_err(HostError::file("read", table))?;
        if !numbers.iter().copied().eq((identity.first..identity.end()).map(|run| run as f64)) {
            let (table, last) = (table.display(), identity.end().saturating_sub(1));
            let what = format!("{table} does not hold runs {} to {last}, of which its campaign is", identity.first);
            return Err(HostError::Option(what));
        }
        Ok(runs)
    }

    /// Of a table.
    #[must_use]
    pub fn new(reader: Reader) -> Self {
        Self { reader }
    }

    /// A column of numbers or counts; NaN where a cell is empty, and empty when there is no such column.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn numbers(&self, name: &str) -> io::Result<Vec<f64>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(as_number).collect())
    }

    /// A column of flags; false where a cell is empty.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn flags(&self, name: &str) -> io::Result<Vec<bool>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(|cell| cell == Cell::Flag(Some(true))).collect())
    }

    /// A column of words.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn words(&self, name: &str) -> io::Result<Vec<Option<String>>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(|cell| if let Cell::Word(word) = cell { word } else { None }).collect())
    }

    /// Names of the columns that begin with a prefix.
    pub fn names<'a>(&'a self, prefix: &'a str) -> impl Iterator<Item = &'a str> {
        self.reader.headings().iter().map(|heading| heading.name.as_str()).filter(move |name| name.starts_with(prefix))
    }

    /// Number of rows.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.reader.rows()
    }
}

fn as_number(cell: Cell) -> f64 {
    match cell {
        Cell::Number(Some(value)) => value,
        Cell::Count(Some(value)) => value as f64,
        _ => f64::NAN,
    }
}
