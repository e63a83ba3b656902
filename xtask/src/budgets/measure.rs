//! The figures: from the image, from `aeroshell wcet`, and from both.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xshell::{Shell, cmd};

use crate::image::{Inspection, Rule, Target};

/// Figures by metric.
pub type Figures = BTreeMap<String, f64>;

/// Names that more than one place knows.
pub const STACK_BOUND: &str = "stack_bound_bytes";
pub const STACK_HIGH_WATER: &str = "stack_high_water_bytes";
const HANDLER_STACK: &str = "handler_stack_bytes";
const STATIC_RAM: &str = "static_ram_bytes";
const RAM_AND_STACK: &str = "ram_and_stack_bytes";

/// What the image itself tells.
#[allow(clippy::cast_precision_loss)] // far below 2^53
pub fn of_image(inspection: &Inspection) -> Figures {
    let mut figures = Figures::new();
    figures.insert("flash_bytes".into(), inspection.flash as f64);
    figures.insert(STATIC_RAM.into(), inspection.ram as f64);
    let initial_values = inspection.sections.iter().filter(|section| section.ram > 0).map(|section| section.flash);
    figures.insert("initial_value_bytes".into(), initial_values.sum::<u64>() as f64);
    for rule in Rule::ALL {
        figures.insert(rule.metric().into(), inspection.count(rule) as f64);
    }
    if let Some(bound) = &inspection.stack {
        figures.insert(STACK_BOUND.into(), bound.bytes() as f64);
        figures.insert(HANDLER_STACK.into(), bound.own_bytes() as f64);
    }
    figures
}

/// What the flights on the emulated processor tell.
pub fn of_flights(shell: &Shell, target: Target) -> Result<Figures> {
    let name = target.name;
    // It fails when a budget is broken; here the figures are judged.
    // The reference computer alone has a model of its cycles.
    let cycles = target.has_cycle_model.then_some("--cycles");
    let command =
        cmd!(shell, "cargo run --quiet --release --package fsw-host -- wcet --target {name} --json {cycles...}");
    let text = command.quiet().ignore_status().read()?;
    parse(&text, name).with_context(|| format!("what aeroshell wcet --target {name} --json printed"))
}

fn parse(text: &str, target: &str) -> Result<Figures> {
    let json: Value = serde_json::from_str(text)?;
    let told = json.get("target").and_then(Value::as_str).unwrap_or_default();
    ensure!(told == target, "figures for {told:?} where {target:?} was expected");
    let metrics = json.get("metrics").and_then(Value::as_object).context("no metrics")?;
    let figure = |(name, value): (&String, &Value)| {
        Ok((name.clone(), value.as_f64().with_context(|| format!("{name} is not a number"))?))
    };
    metrics.iter().map(figure).collect()
}

/// What follows from both.
pub fn derive(figures: &mut Figures) {
    if let (Some(ram), Some(stack)) = (figures.get(STATIC_RAM), figures.get(STACK_HIGH_WATER)) {
        figures.insert(RAM_AND_STACK.into(), ram + stack);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flight_figures_are_read_and_ram_is_added_up() {
        let text = r#"{"target": "m7", "metrics": {"stack_high_water_bytes": 1000, "evenness": 1.5}}"#;
        let mut figures = parse(text, "m7").unwrap();
        figures.insert(STATIC_RAM.into(), 500.0);
        derive(&mut figures);
        assert_eq!((figures["evenness"], figures[RAM_AND_STACK]), (1.5, 1500.0));
    }

    #[test]
    fn figures_of_another_target_and_words_for_numbers_are_refused() {
        assert!(parse(r#"{"target": "rv64", "metrics": {}}"#, "m7").is_err());
        assert!(parse(r#"{"target": "m7", "metrics": {"evenness": "low"}}"#, "m7").is_err());
    }
}
