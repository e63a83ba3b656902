//! Writing rows in groups of a fixed size. The bytes depend on the rows alone: no compression, no dictionary, no time of
//! writing.

use std::io::{self, Write};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::{Cell, Heading, Kind, Row, plain};

/// Rows of one group: what a writer or a reader of columns holds at a time.
pub const ROWS_PER_GROUP: usize = 1_000;

/// Writes rows in the order given.
pub struct Writer<W: Write + Send> {
    headings: Vec<Heading>,
    file: SerializedFileWriter<W>,
    waiting: Vec<Row>,
}

impl<W: Write + Send> Writer<W> {
    /// A table under headings.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn new(headings: &[Heading], out: W) -> io::Result<Self> {
        let fields = headings.iter().map(field).collect::<Result<Vec<_>, _>>().map_err(plain)?;
        let schema = Type::group_type_builder("run").with_fields(fields).build().map_err(plain)?;
        let properties = WriterProperties::builder()
            .set_dictionary_enabled(false)
            .set_statistics_enabled(EnabledStatistics::None)
            .set_created_by("aeroshell".into())
            .build();
        let file = SerializedFileWriter::new(out, Arc::new(schema), Arc::new(properties)).map_err(plain)?;
        Ok(Self { headings: headings.to_vec(), file, waiting: Vec::new() })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn push(&mut self, row: Row) -> io::Result<()> {
        self.waiting.push(row);
        if self.waiting.len() >= ROWS_PER_GROUP { self.write_group() } else { Ok(()) }
    }

    /// Writes what waits and closes the table.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        if !self.waiting.is_empty() {
            self.write_group()?;
        }
        self.file.close().map_err(plain)?;
        Ok(())
    }

    fn write_group(&mut self) -> io::Result<()> {
        let rows = std::mem::take(&mut self.waiting);
        let mut group = self.file.next_row_group().map_err(plain)?;
        for (at, heading) in self.headings.iter().enumerate() {
            let Some(mut writer) = group.next_column().map_err(plain)? else { break };
            let cells = || rows.iter().map(|row| row.get(at));
            let written = match heading.kind {
                Kind::Number => {
                    let (values, levels) = split(cells().map(number));
                    writer.typed::<DoubleType>().write_batch(&values, Some(&levels), None)
                }
                Kind::Count => {
                    let (values, levels) = split(cells().map(count));
                    writer.typed::<Int64Type>().write_batch(&values, Some(&levels), None)
                }
                Kind::Flag => {
                    let (values, levels) = split(cells().map(flag));
                    writer.typed::<BoolType>().write_batch(&values, Some(&levels), None)
                }
                Kind::Word => {
                    let (values, levels) = split(cells().map(|cell| word(cell).map(ByteArray::from)));
                    writer.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)
                }
            };
            written.map_err(plain)?;
            writer.close().map_err(plain)?;
        }
        group.close().map_err(plain)?;
        Ok(())
    }
}

fn number(cell: Option<&Cell>) -> Option<f64> {
    match cell {
        // What is no number is empty, so that every reader sees the same.
        Some(Cell::Number(value)) => value.filter(|v| v.is_finite()),
        _ => None,
    }
}

fn count(cell: Option<&Cell>) -> Option<i64> {
    match cell {
        Some(Cell::Count(value)) => *value,
        _ => None,
    }
}

fn flag(cell: Option<&Cell>) -> Option<bool> {
    match cell {
        Some(Cell::Flag(value)) => *value,
        _ => None,
    }
}

fn word(cell: Option<&Cell>) -> Option<&str> {
    match cell {
        Some(Cell::Word(value)) => value.as_deref(),
        _ => None,
    }
}

/// The values that are there, and a definition level for every cell.
fn split<T>(cells: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    for cell in cells {
        levels.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    (values, levels)
}

fn field(heading: &Heading) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match heading.kind {
        Kind::Number => (PhysicalType::DOUBLE, None),
        Kind::Count => (PhysicalType::INT64, None),
        Kind::Flag => (PhysicalType::BOOLEAN, None),
        Kind::Word => (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(&heading.name, physical);
    builder.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_becomes_an_empty_cell() {
        assert_eq!(number(Some(&Cell::Number(Some(f64::NAN)))), None);
        assert_eq!(number(Some(&Cell::from(2.0))), Some(2.0));
    }
}
