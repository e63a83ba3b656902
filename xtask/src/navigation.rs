//! `cargo xtask navigation`: what every navigation mode costs on the reference computer, held against
//! `firmware/navigation-cost.toml`, which `aeroshell rank` shows beside the errors of each.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::Value;
use toml_edit::{DocumentMut, Item, Table, value};
use xshell::{Shell, cmd};

/// The record.
const FILE: &str = "firmware/navigation-cost.toml";
/// What is recorded of each mode.
const FIGURES: [&str; 3] = ["worst_frame", "frame_budget", "navigation_per_second"];
/// A figure may differ from its record by so much: instructions repeat, but a compiler's last word may be another.
const TOLERANCE: f64 = 0.02;
const HEAD: &str = "\
# Cost of every navigation mode on the reference computer (Cortex-M7, emulated): instructions, not cycles.
#   [short]  ten seconds of two flights, which every gate run repeats:  cargo xtask navigation --bless
#   [long]   three whole flights, repeated by hand:                     cargo xtask navigation --long --bless
# worst_frame: the dearest minor frame, guidance and link in it; frame_budget: what it may cost in this mode;
# navigation_per_second: the slot `navigation` over a second, on average.
";

/// Measures, prints, and fails on a broken budget or on what differs from the record; `bless` writes the record anew.
pub fn run(shell: &Shell, long: bool, bless: bool) -> Result<()> {
    let extent = if long { "long" } else { "short" };
    let command =
        cmd!(shell, "cargo run --quiet --release --package fsw-host -- wcet --target m7 --navigation {extent} --json");
    let text = command.quiet().ignore_status().read()?;
    let report: Value = serde_json::from_str(&text).context("what aeroshell wcet --navigation --json printed")?;
    let modes = report.get("modes").and_then(Value::as_array).context("no modes")?;
    let path = shell.current_dir().join(FILE);
    let mut record = read(&path)?;
    if bless {
        record[extent] = Item::Table(recorded(modes)?);
        let tables = record.to_string();
        let body = tables.trim_start_matches(HEAD);
        std::fs::write(&path, format!("{HEAD}{body}")).with_context(|| path.display().to_string())?;
        record = read(&path)?;
    }
    let failures = judge(modes, record.get(extent))?;
    if failures.is_empty() {
        return Ok(());
    }
    bail!("{}", failures.join("\n  "))
}

fn read(path: &Path) -> Result<DocumentMut> {
    let text = if path.exists() { std::fs::read_to_string(path)? } else { String::new() };
    text.parse().with_context(|| path.display().to_string())
}

fn name(mode: &Value) -> Result<&str> {
    mode.get("filter").and_then(Value::as_str).context("a mode without a name")
}

fn figure(mode: &Value, what: &str) -> Result<i64> {
    mode.get(what).and_then(Value::as_i64).with_context(|| format!("no {what}"))
}

fn recorded(modes: &[Value]) -> Result<Table> {
    let mut table = Table::new();
    for mode in modes {
        let mut row = toml_edit::InlineTable::new();
        for what in FIGURES {
            row.insert(what, figure(mode, what)?.into());
        }
        table.insert(name(mode)?, value(row));
    }
    Ok(table)
}

/// One sentence for each mode that breaks its budget, is not recorded, or is not what it was.
#[allow(clippy::cast_precision_loss)] // far below 2^53
fn judge(modes: &[Value], record: Option<&Item>) -> Result<Vec<String>> {
    let mut failures = Vec::new();
    println!("{:<16} {:>11} {:>8} {:>12}", "filter", "worst frame", "budget", "navigation/s");
    for mode in modes {
        let name = name(mode)?;
        let [worst, budget, per_second] = FIGURES.map(|what| figure(mode, what));
        let (worst, budget) = (worst?, budget?);
        println!("{name:<16} {worst:>11} {budget:>8} {:>12}", per_second?);
        if worst > budget {
            failures.push(format!("{name}: a frame of {worst} instructions, the budget is {budget}"));
        }
        let before = record.and_then(|record| record.get(name));
        for what in ["worst_frame", "navigation_per_second"] {
            let now = figure(mode, what)? as f64;
            match before.and_then(|row| row.get(what)).and_then(Item::as_integer) {
                None => failures.push(format!("{name}: {what} is not recorded in {FILE}")),
                Some(was) if (now - was as f64).abs() > TOLERANCE * was as f64 => {
                    failures.push(format!("{name}: {what} is {now}, recorded is {was}: record it anew with --bless"));
                }
                Some(_) => {}
            }
        }
    }
    Ok(failures)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn mode(worst: i64) -> Value {
        json!({"filter": "imm", "worst_frame": worst, "frame_budget": 200, "navigation_per_second": 50})
    }

    #[test]
    fn what_was_recorded_is_accepted_and_a_change_a_gap_and_an_excess_are_told() {
        let mut record = DocumentMut::new();
        record["short"] = Item::Table(recorded(&[mode(100)]).unwrap());
        let text = record.to_string();
        let record: DocumentMut = text.parse().unwrap();
        let judged = |worst| judge(&[mode(worst)], record.get("short")).unwrap();
        assert!(judged(100).is_empty() && judged(102).is_empty());
        assert!(judged(103)[0].contains("recorded is 100"));
        assert!(judged(97)[0].contains("worst_frame is 97"));
        assert!(judged(201)[0].contains("the budget is 200"));
        assert_eq!(judge(&[mode(100)], None).unwrap().len(), 2);
    }
}
