//! `firmware/budgets.toml`: every limit, where it comes from, and what was measured last.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use toml_edit::{DocumentMut, Item, TableLike, Value};

use crate::image::TARGETS;

/// Who measures a metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The inspection of the image.
    Image,
    /// `aeroshell wcet` on the emulated processor.
    Wcet,
    /// Both: computed from the others.
    Derived,
}

/// The budget of one metric on one target.
#[derive(Clone, Debug, PartialEq)]
pub struct Budget {
    pub metric: String,
    pub target: String,
    pub unit: String,
    pub source: Source,
    /// None where the figure is only reported and held against its own growth.
    pub limit: Option<f64>,
    pub recorded: Option<f64>,
}

/// The file, with its comments.
#[derive(Debug)]
pub struct Budgets {
    document: DocumentMut,
    /// In the order of the file, target by target.
    pub rows: Vec<Budget>,
}

/// The table that holds the metrics.
const METRICS: &str = "metric";

impl Budgets {
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
        Self::parse(&text).with_context(|| path.display().to_string())
    }

    pub fn parse(text: &str) -> Result<Self> {
        let document: DocumentMut = text.parse()?;
        let metrics = document.get(METRICS).and_then(Item::as_table_like).context("no table of metrics")?;
        let mut rows = Vec::new();
        for target in TARGETS {
            for (name, item) in metrics.iter() {
                let fields = item.as_table_like().with_context(|| format!("{name}: a table was expected"))?;
                rows.extend(budget(name, target.name, fields).with_context(|| format!("metric {name}"))?);
            }
        }
        Ok(Self { document, rows })
    }

    /// Replaces a recorded value, and nothing else.
    pub fn record(&mut self, metric: &str, target: &str, measured: f64) -> Result<()> {
        let fields = self.document[METRICS][metric][target].as_table_like_mut();
        let fields = fields.with_context(|| format!("{metric} has no entry for {target}"))?;
        let mut value: Value = written(measured).parse()?;
        match fields.get_mut("recorded").and_then(Item::as_value_mut) {
            Some(old) => {
                *value.decor_mut() = old.decor().clone();
                *old = value;
            }
            None => {
                fields.insert("recorded", Item::Value(value));
            }
        }
        Ok(())
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        std::fs::write(path, self.document.to_string()).with_context(|| path.display().to_string())
    }
}

/// The budget of a metric on a target; none where it is not measured there.
fn budget(name: &str, target: &str, fields: &dyn TableLike) -> Result<Option<Budget>> {
    let known = ["unit", "source", "why"];
    let unknown = |key: &str| !known.contains(&key) && TARGETS.iter().all(|target| target.name != key);
    if let Some((key, _)) = fields.iter().find(|(key, _)| unknown(key)) {
        bail!("unknown field {key}");
    }
    let text = |key: &str| fields.get(key).and_then(Item::as_str).with_context(|| format!("the text {key} is missing"));
    let source = match text("source")? {
        "image" => Source::Image,
        "wcet" => Source::Wcet,
        "derived" => Source::Derived,
        other => bail!("source {other}: image, wcet or derived expected"),
    };
    ensure!(!text("why")?.is_empty(), "why is empty");
    let Some(figures) = fields.get(target) else { return Ok(None) };
    let figures = figures.as_table_like().with_context(|| format!("{target}: a table was expected"))?;
    if let Some((key, _)) = figures.iter().find(|(key, _)| !["limit", "recorded"].contains(key)) {
        bail!("unknown field {key} for {target}");
    }
    let figure =
        |key: &str| figures.get(key).map(|item| number(item).with_context(|| format!("{key} is not a number")));
    Ok(Some(Budget {
        metric: name.to_owned(),
        target: target.to_owned(),
        unit: text("unit")?.to_owned(),
        source,
        limit: figure("limit").transpose()?,
        recorded: figure("recorded").transpose()?,
    }))
}

#[allow(clippy::cast_precision_loss)] // far below 2^53
fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|integer| integer as f64))
}

/// A figure as this file and the table show it: whole numbers in groups of three digits, others with three decimals.
pub fn written(value: f64) -> String {
    if value.fract() != 0.0 {
        return format!("{value:.3}");
    }
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push('_');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "# Head.\n[metric.flash_bytes]\nunit = \"B\"\nsource = \"image\" # how\nwhy = \"the ROM\"\n\
                        m7 = { limit = 163_840, recorded = 100 } # last\nrv64 = { recorded = 200 }\n";

    #[test]
    fn the_recorded_value_changes_and_comments_stay() {
        let mut budgets = Budgets::parse(FILE).unwrap();
        assert_eq!(budgets.rows.len(), 2);
        assert_eq!(budgets.rows[0].limit, Some(163_840.0));
        assert_eq!((budgets.rows[1].target.as_str(), budgets.rows[1].limit), ("rv64", None));
        budgets.record("flash_bytes", "m7", 1_234_567.0).unwrap();
        budgets.record("flash_bytes", "rv64", 0.5).unwrap();
        let expected =
            FILE.replace("recorded = 100", "recorded = 1_234_567").replace("recorded = 200", "recorded = 0.500");
        assert_eq!(budgets.document.to_string(), expected);
    }

    #[test]
    fn misspelt_fields_and_targets_are_refused() {
        for (from, to) in [("limit", "limt"), ("rv64", "rv46"), ("\"image\"", "\"imag\""), ("unit", "units")] {
            assert!(Budgets::parse(&FILE.replacen(from, to, 1)).is_err(), "{to} was accepted");
        }
    }

    #[test]
    fn numbers_are_written_in_groups() {
        assert_eq!([0.0, 999.0, 1000.0, 2_000_000.0, 1.5].map(written), ["0", "999", "1_000", "2_000_000", "1.500"]);
    }
}
