//! One document laid over another, and where a field came from.

use std::path::Path;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use super::ScenarioError;
use super::table;

/// A layer that the user wrote: a file or one `--set`.
pub struct Layer {
    /// How messages call it: the file's name, or `--set …`.
    pub name: String,
    /// Its text, for line numbers; a `--set` has none.
    text: Option<String>,
    /// Field that a `--set` names.
    set_path: Option<Vec<String>>,
}

/// Settings that exclude others: giving one of the first drops the second ones from the layers below.
const EXCLUDES: &[(&[&str], &[&str])] = &[
    (
        &["position_km", "velocity_mps"],
        &["longitude_deg", "latitude_deg", "altitude_km", "speed_mps", "flight_path_angle_deg", "heading_deg"],
    ),
    (&["file"], &["rows"]),
    (&["rows"], &["file"]),
    (&["distribution"], &["three_sigma", "bounds"]),
];

/// Lays `over` over `base`: tables field by field, everything else as a whole.
pub fn merge(base: &mut Table, over: Table) {
    for (givens, dropped) in EXCLUDES {
        if givens.iter().any(|given| over.contains_key(*given)) {
            base.retain(|key, _| !dropped.contains(&key));
        }
    }
    if over.get("kind").and_then(Value::as_str) == Some("exponential") {
        base.retain(|key, _| key != "rows" && key != "file");
    }
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge(below, above),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

/// Parses a scenario text into a table and its layer. Table files are looked for in `directory`; without one they are
/// refused.
///
/// # Errors
/// The syntax error with its line.
pub fn document(name: &str, text: String, directory: Option<&Path>) -> Result<(Table, Layer), ScenarioError> {
    let mut table: Table = text.parse().map_err(|e: toml::de::Error| {
        let line = e.span().map_or(1, |span| line_of(&text, span.start));
        ScenarioError::new(format!("{name}, line {line}: not valid TOML: {}", e.message().replace('\n', ", ")))
    })?;
    let layer = Layer { name: name.into(), text: Some(text), set_path: None };
    inline_tables(&mut table, directory)
        .map_err(|(path, e)| ScenarioError::new(format!("{}: {e}", layer.place(&path))))?;
    Ok((table, layer))
}

/// Applies `dotted.field=value` to a table.
///
/// # Errors
/// No `=`, an index beyond an array, or a field inside something that has none.
pub fn set(table: &mut Table, assignment: &str) -> Result<Layer, ScenarioError> {
    let first_line = assignment.lines().next().unwrap_or_default();
    let bad = |what: String| ScenarioError::new(format!("--set {first_line}: {what}"));
    if assignment.trim().contains(['\n', '\r']) {
        return Err(bad("the value must stand on one line".into()));
    }
    let (path, text) = assignment.split_once('=').ok_or_else(|| bad("expected dotted.field=value".into()))?;
    let segments: Vec<String> = path.trim().split('.').map(|s| s.trim().to_owned()).collect();
    if segments.iter().any(String::is_empty) {
        return Err(bad(format!("`{path}` is not a dotted field name")));
    }
    let text = text.trim();
    // What is no TOML value (speed, orbiter-1) is meant as a string.
    let value = format!("v = {text}").parse::<Table>().ok().and_then(|mut t| t.remove("v"));
    let value = value.unwrap_or_else(|| Value::String(text.into()));
    assign(table, &segments, value).map_err(&bad)?;
    inline_tables(table, Some(Path::new(""))).map_err(|(_, e)| bad(e.message))?;
    Ok(Layer { name: format!("--set {assignment}"), text: None, set_path: Some(segments) })
}

/// Puts a value at a path; a table on the way that is missing is made.
fn assign(table: &mut Table, path: &[String], value: Value) -> Result<(), String> {
    let arrays = path.iter().position(|segment| segment.parse::<usize>().is_ok());
    let Some(at) = arrays else {
        if let Some(clash) = scalar_on_the_way(table, path) {
            return Err(clash);
        }
        let over = path.iter().rev().fold(value, |inner, key| Value::Table(Table::from_iter([(key.clone(), inner)])));
        if let Value::Table(over) = over {
            merge(table, over);
        }
        return Ok(());
    };
    let (before, after) = (&path[..at], &path[at + 1..]);
    let index: usize = path[at].parse().map_err(|_| "not an index".to_owned())?;
    let name = before.join(".");
    let mut place: Option<&mut Value> = None;
    for key in before {
        place = match place {
            None => table.get_mut(key),
            Some(Value::Table(inner)) => inner.get_mut(key),
            Some(_) => None,
        };
        if place.is_none() {
            return Err(format!("`{name}` is empty, so it has no index {index}"));
        }
    }
    let Some(Value::Array(array)) = place else { return Err(format!("`{name}` is not a list")) };
    let count = array.len();
    let slot = array.get_mut(index).ok_or_else(|| match count {
        0 => format!("`{name}` is empty, so it has no index {index}"),
        n => format!("`{name}` has no index {index}: the indices go from 0 to {}", n - 1),
    })?;
    match (slot, after) {
        (slot, []) => {
            *slot = value;
            Ok(())
        }
        (Value::Table(inner), after) => assign(inner, after, value),
        (Value::Array(_), _) => Err(format!("`{name}.{index}` is a list: give it as a whole")),
        _ => Err(format!("`{name}.{index}` is a value, not a table")),
    }
}

/// What is wrong with the first value on the way to a path that cannot hold fields.
fn scalar_on_the_way(table: &Table, path: &[String]) -> Option<String> {
    let mut here = table;
    for (k, key) in path[..path.len() - 1].iter().enumerate() {
        match here.get(key) {
            Some(Value::Table(inner)) => here = inner,
            Some(Value::Array(list)) => {
                let (name, last) = (path[..=k].join("."), list.len().saturating_sub(1));
                return Some(format!("`{name}` is a list: behind its name stands an index from 0 to {last}"));
            }
            Some(_) => return Some(format!("`{}` is a value, not a table", path[..=k].join("."))),
            None => return None,
        }
    }
    None
}

/// Replaces the names of table files by their rows. On error also tells the field.
fn inline_tables(all: &mut Table, directory: Option<&Path>) -> Result<(), (Vec<String>, ScenarioError)> {
    inline_in(all, directory, &[])?;
    if let Some(Value::Table(onboard)) = all.get_mut("onboard") {
        inline_in(onboard, directory, &["onboard"])?;
    }
    Ok(())
}

fn inline_in(
    tables: &mut Table,
    directory: Option<&Path>,
    prefix: &[&str],
) -> Result<(), (Vec<String>, ScenarioError)> {
    let path_of = |part: &str, field: &str| -> Vec<String> {
        prefix.iter().copied().chain([part, field]).map(String::from).collect()
    };
    let read = |name: &str, kind: &table::Kind| match directory {
        Some(directory) => table::read(&directory.join(name), kind),
        None => {
            Err(ScenarioError::new("a scenario that comes over a link names no table files: give the rows in line"))
        }
    };
    if let Some(Value::Table(vehicle)) = tables.get_mut("vehicle")
        && let Some(Value::String(name)) = vehicle.get("aero_table")
    {
        let rows = read(name, &table::AERO).map_err(|e| (path_of("vehicle", "aero_table"), e))?;
        vehicle.insert("aero_table".into(), rows);
    }
    if let Some(Value::Table(atmosphere)) = tables.get_mut("atmosphere")
        && let Some(Value::String(name)) = atmosphere.get("file")
    {
        let rows = read(name, &table::ATMOSPHERE).map_err(|e| (path_of("atmosphere", "file"), e))?;
        atmosphere.remove("file");
        atmosphere.insert("rows".into(), rows);
    }
    Ok(())
}

/// Where a field was written, for a message: the last layer that names it, else the built-in default.
pub fn place(layers: &[Layer], path: &[String]) -> String {
    layers
        .iter()
        .rev()
        .find(|layer| layer.mentions(path))
        .or_else(|| layers.first())
        .map_or_else(|| "scenario".into(), |layer| layer.place(path))
}

impl Layer {
    /// Whether this layer writes the field, something inside it, or all of what it is in.
    pub fn mentions(&self, path: &[String]) -> bool {
        match (&self.set_path, &self.text) {
            (Some(set), _) => set.iter().zip(path).all(|(a, b)| a == b),
            (None, Some(text)) => depth(text, path).is_some_and(|(found, _)| found == path.len() || found > 1),
            (None, None) => false,
        }
    }

    /// This layer's name with the line of the field, as far as the text has it.
    fn place(&self, path: &[String]) -> String {
        match self.text.as_deref().and_then(|text| Some((text, depth(text, path)?))) {
            Some((text, (_, at))) => format!("{}, line {}", self.name, line_of(text, at)),
            None => self.name.clone(),
        }
    }
}

/// How many segments of a path a text has, and the byte where the last of them stands.
fn depth(text: &str, path: &[String]) -> Option<(usize, usize)> {
    let document = DeTable::parse(text).ok()?;
    let mut found = None;
    let mut place: Option<&DeValue<'_>> = None;
    for (k, key) in path.iter().enumerate() {
        let table = match place {
            None => Some(document.get_ref()),
            Some(DeValue::Table(table)) => Some(table),
            _ => None,
        };
        if let Some(table) = table {
            let Some((name, value)) = table.iter().find(|(name, _)| name.get_ref().as_ref() == key.as_str()) else {
                break;
            };
            found = Some((k + 1, name.span().start));
            place = Some(value.get_ref());
        } else if let (Some(DeValue::Array(array)), Ok(index)) = (place, key.parse::<usize>()) {
            let Some(item) = array.get(index) else { break };
            found = Some((k + 1, item.span().start));
            place = Some(item.get_ref());
        } else {
            break;
        }
    }
    found
}

fn line_of(text: &str, byte: usize) -> usize {
    text.as_bytes().iter().take(byte).filter(|b| **b == b'\n').count() + 1
}
