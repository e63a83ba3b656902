//! Rows of runs as Parquet.

mod reader;
mod writer;

pub use reader::Reader;
pub use writer::{ROWS_PER_GROUP, Writer};

use std::io;

use parquet::errors::ParquetError;

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Number,
    /// A whole number.
    Count,
    /// Yes or no.
    Flag,
    /// Text.
    Word,
}

/// One cell; empty where there is nothing to say.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A number.
    Number(Option<f64>),
    /// A whole number.
    Count(Option<i64>),
    /// Yes or no.
    Flag(Option<bool>),
    /// Text.
    Word(Option<String>),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(Some(value))
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        Self::Number(value)
    }
}

impl From<u32> for Cell {
    fn from(value: u32) -> Self {
        Self::Count(Some(i64::from(value)))
    }
}

impl From<bool> for Cell {
    fn from(value: bool) -> Self {
        Self::Flag(Some(value))
    }
}

impl From<Option<String>> for Cell {
    fn from(value: Option<String>) -> Self {
        Self::Word(value)
    }
}

/// Name and kind of a column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Heading {
    /// Name with unit.
    pub name: String,
    /// What its cells are.
    pub kind: Kind,
}

impl Heading {
    /// A heading.
    #[must_use]
    pub fn new(name: impl Into<String>, kind: Kind) -> Self {
        Self { name: name.into(), kind }
    }
}

/// One run: a cell under every heading, the number of the run first.
pub type Row = Vec<Cell>;

/// Number of the run of a row.
#[must_use]
pub fn run_of(row: &Row) -> u64 {
    match row.first() {
        Some(Cell::Count(Some(run))) => run.cast_unsigned(),
        _ => u64::MAX,
    }
}

/// What the system says, where it is the system that says it.
fn plain(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    #[test]
    fn what_is_written_reads_back_with_its_gaps_across_groups() {
        let path = std::env::temp_dir().join(format!("aeroshell-table-{}.parquet", std::process::id()));
        let headings = [
            Heading::new("run", Kind::Count),
            Heading::new("x_m", Kind::Number),
            Heading::new("good", Kind::Flag),
            Heading::new("why", Kind::Word),
        ];
        let row = |k: u32| -> Row {
            let word = k.is_multiple_of(3).then(|| format!("because {k}"));
            vec![
                k.into(),
                Cell::Number((k % 7 != 2).then_some(f64::from(k) * 0.1)),
                k.is_multiple_of(2).into(),
                word.into(),
            ]
        };
        let mut writer = Writer::new(&headings, File::create(&path).unwrap()).unwrap();
        (0..2_500).for_each(|k| writer.push(row(k)).unwrap());
        writer.finish().unwrap();
        let reader = Reader::open(&path).unwrap();
        assert_eq!((reader.rows(), reader.headings()), (2_500, headings.as_slice()));
        let mut next = 0;
        reader
            .for_each_row(|read| {
                assert_eq!(read, row(next));
                next += 1;
                Ok(())
            })
            .unwrap();
        assert_eq!(next, 2_500);
        assert_eq!(reader.column("x_m").unwrap().unwrap().len(), 2_500);
        assert!(reader.column("nothing").unwrap().is_none());
        std::fs::remove_file(path).unwrap();
    }
}
