//! Reading rows a group at a time, or a column as a whole.

use std::fs::File;
use std::io;
use std::path::Path;

use parquet::basic::Type as PhysicalType;
use parquet::column::reader::ColumnReader;
use parquet::data_type::ByteArray;
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::{Cell, Heading, Kind, Row, plain};

/// Values taken from a column at a time.
const BATCH: usize = 1_024;

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
