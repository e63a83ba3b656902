//! `cargo xtask budgets`: measures the firmware and holds it against `firmware/budgets.toml`.

mod file;
mod judge;
mod measure;
mod table;

use std::path::Path;

use anyhow::{Result, bail};
use clap::ValueEnum;
use xshell::Shell;

use crate::image::{self, TARGETS};
use crate::symbols::target_directory;
pub use file::written;
use file::{Budgets, Source};
use judge::{Verdict, judge};
use measure::{Figures, STACK_BOUND, STACK_HIGH_WATER};

/// The limits.
const FILE: &str = "firmware/budgets.toml";

/// Part of the budgets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// What needs no emulator: flash, RAM, the stack bound and what must not be in the image.
    Static,
}

/// Measures, prints the table and fails on an excess or on unrecorded growth; `bless` records instead of comparing.
pub fn run(shell: &Shell, only: Option<Part>, bless: bool) -> Result<()> {
    let path = shell.current_dir().join(FILE);
    let mut budgets = Budgets::read(&path)?;
    let wanted = |source| only.is_none() || source == Source::Image;
    let mut failures = Vec::new();
    let mut by_target = Vec::new();
    for target in TARGETS {
        let figures = measured(shell, target, only, &mut failures)?;
        by_target.push((target.name, figures));
    }
    let figure = |metric: &str, target: &str| -> Option<f64> {
        by_target.iter().find(|(name, _)| *name == target).and_then(|(_, figures)| figures.get(metric).copied())
    };
    if bless {
        for row in budgets.rows.clone() {
            if let Some(measured) = figure(&row.metric, &row.target) {
                budgets.record(&row.metric, &row.target, measured)?;
            }
        }
        budgets.write(&path)?;
        budgets = Budgets::read(&path)?;
    }
    let rows: Vec<_> = budgets.rows.iter().filter(|row| wanted(row.source)).collect();
    let rows: Vec<_> = rows.into_iter().map(|row| (row, figure(&row.metric, &row.target))).collect();
    for (budget, measured) in &rows {
        match judge(budget, *measured) {
            Verdict::Within => {}
            Verdict::Shrunk(hint) => println!("smaller than recorded: {hint}"),
            Verdict::Failed(reason) => failures.push(reason),
        }
    }
    println!("{}", table::text(&rows));
    keep(shell, "table.txt", &table::text(&rows))?;
    keep(shell, "budgets.json", &format!("{:#}\n", table::json(&rows)))?;
    if failures.is_empty() {
        return Ok(());
    }
    bail!("{}", failures.join("\n  "))
}

/// All figures of a target; shows where flash, RAM and stack go.
fn measured(shell: &Shell, target: image::Target, only: Option<Part>, failures: &mut Vec<String>) -> Result<Figures> {
    let inspection = image::inspect_flight(shell, target)?;
    let text = image::report::text(&inspection);
    println!("{} ({})\n{text}", target.name, target.triple);
    keep(shell, &format!("{}.txt", target.name), &text)?;
    if let Err(error) = image::report::fail_on_violations(&inspection) {
        failures.push(format!("{}: {error}", target.name));
    }
    failures.extend(handler_stack_is_small(target.name, &inspection));
    let mut figures = measure::of_image(&inspection);
    if only.is_none() {
        figures.extend(measure::of_flights(shell, target)?);
        measure::derive(&mut figures);
        failures.extend(bound_is_broken(target.name, &figures));
    }
    Ok(figures)
}

/// The handlers' own stack must hold what they need.
fn handler_stack_is_small(target: &str, inspection: &image::Inspection) -> Option<String> {
    let (needed, room) = (inspection.stack.as_ref()?.own_bytes(), inspection.handler_stack.unwrap_or(0));
    (needed > room).then(|| format!("{target}: handlers need {needed} B of their own stack, which has {room} B"))
}

/// More stack used in a flight than the bound allows would mean that the bound is wrong.
fn bound_is_broken(target: &str, figures: &Figures) -> Option<String> {
    let (bound, used) = (figures.get(STACK_BOUND)?, figures.get(STACK_HIGH_WATER)?);
    (used > bound).then(|| format!("{target}: a flight used {used} B of stack, more than the bound of {bound} B"))
}

/// Writes a result beside the other build products.
fn keep(shell: &Shell, name: &str, text: &str) -> Result<()> {
    let folder = target_directory(shell)?.join("budgets");
    shell.create_dir(&folder)?;
    Ok(shell.write_file(Path::new(&folder).join(name), text)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::executive::schedule::{FRAME_BUDGET, SCHEDULE};

    fn file() -> Budgets {
        Budgets::read(&crate::workspace_root().join(FILE)).unwrap()
    }

    fn limit(metric: &str, target: &str) -> Option<f64> {
        let file = file();
        file.rows.iter().find(|row| row.metric == metric && row.target == target).and_then(|row| row.limit)
    }

    #[test]
    fn the_file_and_the_schedule_in_the_core_give_every_slot_the_same_budget() {
        for slot in &SCHEDULE {
            assert_eq!(limit(&format!("slot.{}", slot.name), "m7"), Some(f64::from(slot.budget)), "{}", slot.name);
        }
        assert_eq!(limit("worst_frame_instructions", "m7"), Some(f64::from(FRAME_BUDGET)));
        let slots = file().rows.iter().filter(|row| row.target == "m7" && row.metric.starts_with("slot.")).count();
        assert_eq!(slots, SCHEDULE.len(), "the file has a slot that the schedule does not");
    }

    #[test]
    fn every_rule_for_images_has_a_limit_of_zero() {
        for target in TARGETS {
            for rule in image::Rule::ALL {
                assert_eq!(limit(rule.metric(), target.name), Some(0.0), "{} on {}", rule.metric(), target.name);
            }
        }
    }

    #[test]
    fn a_flight_that_uses_more_stack_than_the_bound_breaks_it() {
        let figures = |used| Figures::from([(STACK_BOUND.into(), 100.0), (STACK_HIGH_WATER.into(), used)]);
        assert_eq!(bound_is_broken("m7", &figures(100.0)), None);
        assert!(bound_is_broken("m7", &figures(101.0)).is_some());
    }
}
