//! Tables in CSV files: air by altitude, aerodynamics by Mach number.

use std::io::Read;
use std::path::Path;

use toml::Value;

use super::ScenarioError;
use super::ranges::range_of;

/// Longest file that is read: far more than any scenario or table needs.
const MAX_FILE_BYTES: u64 = 16 << 20;

/// A kind of table: where its rows live in a scenario, and its columns.
pub struct Kind {
    /// Dotted path of the rows, for their ranges.
    rows_path: &'static str,
    /// Column names, first the one that must rise.
    columns: &'static [&'static str],
    /// Numbers of leading columns that make a row.
    widths: &'static [usize],
}

/// Aerodynamics by Mach number.
pub const AERO: Kind = Kind { rows_path: "vehicle.aero_table", columns: &["mach", "cd", "cl"], widths: &[3] };
/// Air by altitude.
pub const ATMOSPHERE: Kind = Kind {
    rows_path: "atmosphere.rows",
    columns: &["altitude_km", "density_kgpm3", "temperature_k", "wind_east_mps", "wind_north_mps"],
    widths: &[2, 3, 5],
};

/// Reads a table file into rows of numbers, ready for a scenario.
///
/// The first line names the columns, in any order; lines that start with `#` and empty lines are skipped.
///
/// # Errors
/// A sentence that names file and line.
pub fn read(path: &Path, kind: &Kind) -> Result<Value, ScenarioError> {
    let name = path.display();
    let text =
        read_text(path).map_err(|e| ScenarioError::new(format!("{name}: the table cannot be read: {}", reason(&e))))?;
    // Spreadsheets begin their files with a byte order mark.
    let mut lines = text
        .trim_start_matches('\u{feff}')
        .lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let at = |line: usize, what: String| ScenarioError::new(format!("{name}, line {line}: {what}"));

    let Some((header_line, header)) = lines.next() else {
        return Err(ScenarioError::new(format!(
            "{name}: the table is empty; its first line must name the columns {}",
            kind.columns.join(", ")
        )));
    };
    let order = column_order(header, kind).map_err(|what| at(header_line, what))?;

    let mut rows: Vec<Value> = Vec::new();
    let mut last = f64::NEG_INFINITY;
    for (line, text) in lines {
        let numbers = numbers_of(text, &order, kind).map_err(|what| at(line, what))?;
        if numbers[0] <= last {
            let first = kind.columns[0];
            return Err(at(line, format!("{first} must rise from line to line, but {} follows {last}", numbers[0])));
        }
        last = numbers[0];
        rows.push(Value::Array(numbers.into_iter().map(Value::Float).collect()));
    }
    if rows.len() < 2 {
        return Err(ScenarioError::new(format!(
            "{name}: the table has {} data lines where at least 2 are needed",
            rows.len()
        )));
    }
    Ok(Value::Array(rows))
}

/// For each column of the file, its index among the kind's columns.
fn column_order(header: &str, kind: &Kind) -> Result<Vec<usize>, String> {
    let mut order = Vec::new();
    for name in header.split(',').map(str::trim) {
        let index = kind
            .columns
            .iter()
            .position(|column| *column == name)
            .ok_or_else(|| format!("unknown column `{name}`; the columns are {}", kind.columns.join(", ")))?;
        if order.contains(&index) {
            return Err(format!("column `{name}` stands twice"));
        }
        order.push(index);
    }
    let complete = kind.widths.contains(&order.len()) && (0..order.len()).all(|k| order.contains(&k));
    if complete {
        Ok(order)
    } else {
        let missing = (0..kind.columns.len()).find(|k| !order.contains(k)).unwrap_or(0);
        Err(format!("column `{}` is missing; the columns are {}", kind.columns[missing], kind.columns.join(", ")))
    }
}

/// The numbers of one line in the kind's order, each within its range.
fn numbers_of(line: &str, order: &[usize], kind: &Kind) -> Result<Vec<f64>, String> {
    let cells: Vec<&str> = line.split(',').map(str::trim).collect();
    if cells.len() != order.len() {
        return Err(format!("{} values where the first line names {} columns", cells.len(), order.len()));
    }
    let mut numbers = vec![0.0; order.len()];
    for (cell, &index) in cells.iter().zip(order) {
        let column = kind.columns[index];
        let x: f64 = cell.parse().map_err(|_| format!("{column}: \"{cell}\" is not a number"))?;
        let path: Vec<String> =
            kind.rows_path.split('.').map(String::from).chain(["0".into(), index.to_string()]).collect();
        if let Some(range) = range_of(&path)
            && !(x >= range.min && x <= range.max)
        {
            return Err(format!("{column} = {x} is outside {} to {} {}", range.min, range.max, range.unit)
                .trim_end()
                .into());
        }
        numbers[index] = x;
    }
    Ok(numbers)
}

/// Reads a text file, as long as it is not endless.
///
/// # Errors
/// It cannot be read, is no text, or is longer than [`MAX_FILE_BYTES`].
pub fn read_text(path: &Path) -> std::io::Result<String> {
    let mut bytes = Vec::new();
    std::fs::File::open(path)?.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(std::io::Error::other(format!("it is longer than {} MiB", MAX_FILE_BYTES >> 20)));
    }
    String::from_utf8(bytes).map_err(|_| std::io::ErrorKind::InvalidData.into())
}

/// An input/output error in the words of a user.
pub fn reason(e: &std::io::Error) -> String {
    match e.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        std::io::ErrorKind::IsADirectory => "it is a directory".into(),
        std::io::ErrorKind::InvalidData => "it is not text (UTF-8)".into(),
        _ => e.to_string(),
    }
}
