//! The figures beside their budgets, as a reader and as a program want them.

use std::fmt::Write;

use serde_json::{Value, json};

use super::file::{Budget, written};

/// A budget and what was measured for it.
pub type Row<'a> = (&'a Budget, Option<f64>);

/// One aligned table.
pub fn text(rows: &[Row<'_>]) -> String {
    let head = ["target", "metric", "measured", "recorded", "limit", "margin", "unit"].map(String::from);
    let lines: Vec<[String; 7]> = std::iter::once(head).chain(rows.iter().map(line)).collect();
    let width = |column: usize| lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; 7] = std::array::from_fn(width);
    let mut text = String::new();
    for [target, metric, measured, recorded, limit, margin, unit] in &lines {
        let [w0, w1, w2, w3, w4, w5, _] = widths;
        let _ = writeln!(
            text,
            "{target:<w0$}  {metric:<w1$}  {measured:>w2$}  {recorded:>w3$}  {limit:>w4$}  {margin:>w5$}  {unit}"
        );
    }
    text
}

fn line((budget, measured): &Row<'_>) -> [String; 7] {
    let figure = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), written);
    let margin = match (measured, budget.limit) {
        (Some(measured), Some(limit)) if limit > 0.0 => format!("{:.1} %", 100.0 * (1.0 - measured / limit)),
        _ => String::new(),
    };
    let Budget { metric, target, unit, limit, recorded, .. } = budget;
    [target.clone(), metric.clone(), figure(*measured), figure(*recorded), figure(*limit), margin, unit.clone()]
}

/// The same for a program.
pub fn json(rows: &[Row<'_>]) -> Value {
    let entry = |(budget, measured): &Row<'_>| {
        let Budget { metric, target, unit, limit, recorded, .. } = budget;
        json!({ "target": target, "metric": metric, "measured": measured, "recorded": recorded, "limit": limit, "unit": unit })
    };
    Value::Array(rows.iter().map(entry).collect())
}

#[cfg(test)]
mod tests {
    use super::super::file::Source;
    use super::*;

    #[test]
    fn columns_are_aligned_and_margins_shown() {
        let budget = |metric: &str, limit| Budget {
            metric: metric.into(),
            target: "m7".into(),
            unit: "B".into(),
            source: Source::Image,
            limit,
            recorded: None,
        };
        let (flash, ram) = (budget("flash_bytes", Some(1000.0)), budget("ram", None));
        let shown = text(&[(&flash, Some(750.0)), (&ram, None)]);
        assert_eq!(
            shown,
            "target  metric       measured  recorded  limit  margin  unit\n\
             m7      flash_bytes       750         –  1_000  25.0 %  B\n\
             m7      ram                 –         –      –          B\n"
        );
    }
}
