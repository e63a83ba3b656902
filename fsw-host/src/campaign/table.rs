//! Rows of runs as Parquet: written in groups of a fixed size, read back column by column.
//!
//! The bytes depend on the rows alone: no compression, no dictionary, no time of writing.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

/// Rows of one group: what a writer or a reader of columns holds at a time.
pub const ROWS_PER_GROUP: usize = 1_000;
/// Values taken from a column at a time.
const BATCH: usize = 1_024;

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

fn plain(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(other) => io::Error::other(other),
        },
        other => io::Error::other(other),
    }
}

/// Reads a table.
pub struct Reader {
    file: SerializedFileReader<File>,
    headings: Vec<Heading>,
}

impl Reader {
    /// Opens a table.
    ///
    /// # Errors
    /// It is none, or cannot be read.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = SerializedFileReader::new(File::open(path)?).map_err(plain)?;
        let columns = file.metadata().file_metadata().schema_descr().columns();
        let headings = columns.iter().map(|column| {
            let kind = match column.physical_type() {
                PhysicalType::DOUBLE => Kind::Number,
                PhysicalType::INT64 => Kind::Count,
                PhysicalType::BOOLEAN => Kind::Flag,
                _ => Kind::Word,
            };
            Heading::new(column.name(), kind)
        });
        let headings = headings.collect();
        Ok(Self { file, headings })
    }

    /// Names and kinds of the columns.
    #[must_use]
    pub fn headings(&self) -> &[Heading] {
        &self.headings
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> u64 {
        u64::try_from(self.file.metadata().file_metadata().num_rows()).unwrap_or(0)
    }

    /// Hands every row to `each`, in order, a group at a time.
    ///
    /// # Errors
    /// The table cannot be read, or `each` fails.
    pub fn for_each_row(&self, mut each: impl FnMut(Row) -> io::Result<()>) -> io::Result<()> {
        for group in 0..self.file.num_row_groups() {
            let columns: Vec<Vec<Cell>> =
                (0..self.headings.len()).map(|at| self.cells(group, at)).collect::<io::Result<_>>()?;
            let rows = columns.iter().map(Vec::len).min().unwrap_or(0);
            let mut columns: Vec<_> = columns.into_iter().map(Vec::into_iter).collect();
            for _ in 0..rows {
                each(columns.iter_mut().filter_map(Iterator::next).collect())?;
            }
        }
        Ok(())
    }

    /// All cells of one column; none when there is no such column.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn column(&self, name: &str) -> io::Result<Option<Vec<Cell>>> {
        let Some(at) = self.headings.iter().position(|heading| heading.name == name) else { return Ok(None) };
        let mut cells = Vec::new();
        for group in 0..self.file.num_row_groups() {
            cells.extend(self.cells(group, at)?);
        }
        Ok(Some(cells))
    }

    fn cells(&self, group: usize, column: usize) -> io::Result<Vec<Cell>> {
        let group = self.file.get_row_group(group).map_err(plain)?;
        Ok(match group.get_column_reader(column).map_err(plain)? {
            ColumnReader::DoubleColumnReader(r) => read(r, Cell::Number)?,
            ColumnReader::Int64ColumnReader(r) => read(r, Cell::Count)?,
            ColumnReader::BoolColumnReader(r) => read(r, Cell::Flag)?,
            ColumnReader::ByteArrayColumnReader(r) => {
                read(r, |bytes| Cell::Word(bytes.map(|b: ByteArray| String::from_utf8_lossy(b.data()).into_owned())))?
            }
            _ => return Err(io::Error::other("a column is of a kind that no campaign writes")),
        })
    }
}

fn read<T: parquet::data_type::DataType>(
    mut reader: parquet::column::reader::ColumnReaderImpl<T>,
    cell: impl Fn(Option<T::T>) -> Cell,
) -> io::Result<Vec<Cell>> {
    let mut cells = Vec::new();
    loop {
        let (mut values, mut levels) = (Vec::new(), Vec::new());
        let (records, ..) = reader.read_records(BATCH, Some(&mut levels), None, &mut values).map_err(plain)?;
        if records == 0 {
            return Ok(cells);
        }
        let mut values = values.into_iter();
        cells.extend(levels.iter().map(|level| cell(if *level > 0 { values.next() } else { None })));
    }
}

#[cfg(test)]
mod tests {
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

    #[test]
    fn what_is_no_number_becomes_an_empty_cell() {
        assert_eq!(number(Some(&Cell::Number(Some(f64::NAN)))), None);
        assert_eq!(number(Some(&Cell::from(2.0))), Some(2.0));
    }
}
