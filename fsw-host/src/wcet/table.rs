//! The table of execution cost: count, median, maximum, budget, margin, and where the maximum was.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use fsw_core::executive::schedule::{FRAME_BUDGET, SCHEDULE};
use fsw_core::guidance::cycle::MAX_EVALUATIONS;
use fsw_core::probe::Kernel;
use fsw_core::time::FRAMES_PER_SECOND;
use serde::Serialize;

use super::flights::Predicts;
use super::ledger::{FlightCost, evenness};
use crate::target::Target;

/// Budget of a whole second, instructions: its frames may use 40 % of theirs on average.
pub const SECOND_BUDGET: u32 = 2_000_000;
/// Budget of one evaluation of the equations of motion with rotation and J2, instructions, in the default mode: it pays for
/// its share of bank turns, reversals and alignment too.
pub const EVALUATION_BUDGET: u32 = 500;
/// The same in mode `paper`, which flies a held bank. That of the reference computer is a requirement; RISC-V, which needs
/// an instruction to form many an address, is held against its own.
#[must_use]
pub const fn paper_evaluation_budget(target: Target) -> u32 {
    match target {
        Target::M7 => 300,
        Target::Rv64 => 330,
    }
}
/// The worst frame of any second against the mean of that second.
pub const EVENNESS_BUDGET: f64 = 2.0;
/// Evaluations in a Runge–Kutta step.
const EVALUATIONS_PER_STEP: u32 = 4;
/// Most predictor calls of a guidance cycle.
const CALLS_BUDGET: f64 = 4.0;

/// Budget of a minor frame, cycles: a fifth of 20 ms at 100 MHz.
pub const FRAME_CYCLES: u32 = 400_000;

/// What figures are held against. What counts calls and evaluations has the same budget in any unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Budgets {
    /// Nothing: wall time, or a counter of which nobody said what it counts.
    None,
    /// The cycles that a minor frame may take.
    Cycles,
    /// The budgets of the schedule, and that of an evaluation where the processor is known.
    Instructions(Option<Target>),
}

impl Budgets {
    const fn in_instructions(self) -> bool {
        matches!(self, Self::Instructions(_))
    }

    fn frame(self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Cycles => Some(f64::from(FRAME_CYCLES)),
            Self::Instructions(_) => Some(f64::from(FRAME_BUDGET)),
        }
    }

    fn second(self) -> Option<f64> {
        match self {
            Self::Instructions(_) => Some(f64::from(SECOND_BUDGET)),
            Self::None | Self::Cycles => None,
        }
    }

    fn evaluation(self, predicts: Predicts) -> Option<f64> {
        let Self::Instructions(Some(target)) = self else { return None };
        match predicts {
            Predicts::Rehearsed => Some(f64::from(EVALUATION_BUDGET)),
            Predicts::Held => Some(f64::from(paper_evaluation_budget(target))),
            Predicts::InTables => None,
        }
    }
}

/// A flight and what it cost.
#[derive(Clone, Debug)]
pub struct Flown {
    /// Its name.
    pub name: String,
    /// What its predictions flew.
    pub predicts: Predicts,
    /// What it cost.
    pub cost: FlightCost,
}

/// One line of the table.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// What was measured.
    pub name: String,
    /// How many samples there are.
    pub count: usize,
    /// The middle one.
    pub median: f64,
    /// The largest one.
    pub maximum: f64,
    /// What it may be; none where there is no budget for it.
    pub budget: Option<f64>,
    /// Share of the budget that is left over at the maximum.
    pub margin: Option<f64>,
    /// The flight that held the maximum.
    pub flight: String,
    /// When, s.
    pub time_s: f64,
}

impl Row {
    /// True when the maximum is beyond the budget.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.margin.is_some_and(|margin| margin < 0.0)
    }
}

/// Samples of one quantity with their places.
#[derive(Debug)]
struct Samples<'a> {
    values: Vec<f64>,
    /// The largest, and where.
    largest: Option<(f64, &'a str, f64)>,
}

impl<'a> Samples<'a> {
    /// Value, flight and time of each.
    fn of(samples: impl Iterator<Item = (f64, &'a str, f64)>) -> Self {
        let mut all = Self { values: Vec::new(), largest: None };
        for sample in samples {
            all.values.push(sample.0);
            if all.largest.is_none_or(|largest| sample.0 > largest.0) {
                all.largest = Some(sample);
            }
        }
        all
    }

    /// None when there are no samples.
    fn row(mut self, name: impl Into<String>, budget: Option<f64>) -> Option<Row> {
        let (maximum, flight, time_s) = self.largest?;
        let count = self.values.len();
        let (_, median, _) = self.values.select_nth_unstable_by(count / 2, f64::total_cmp);
        let margin = budget.map(|budget| 1.0 - maximum / budget);
        let flight = flight.to_owned();
        Some(Row { name: name.into(), count, median: *median, maximum, budget, margin, flight, time_s })
    }
}

/// The table of a set of flights.
#[must_use]
pub fn rows(flights: &[Flown], budgets: Budgets) -> Vec<Row> {
    let budgeted = budgets.in_instructions();
    let mut rows: Vec<Option<Row>> = Vec::new();
    let budget = |budget: u32| budgeted.then_some(f64::from(budget));
    for slot in &SCHEDULE {
        let cost = frames(flights).map(|(name, f)| (f64::from(f.slots[slot.id as usize]), name, f.time_s()));
        rows.push(Samples::of(cost).row(format!("slot {}", slot.name), budget(slot.budget)));
    }
    let whole = frames(flights).map(|(name, f)| (f64::from(f.whole), name, f.time_s()));
    rows.push(Samples::of(whole).row("whole frame", budgets.frame()));
    let seconds = || flights.iter().flat_map(|flown| flown.cost.seconds().map(|second| (flown.name.as_str(), second)));
    let sums = seconds().map(|(name, second)| {
        let sum: u64 = second.iter().map(|frame| u64::from(frame.whole)).sum();
        (sum as f64, name, second.first().map_or(0.0, |frame| frame.time_s()))
    });
    rows.push(Samples::of(sums).row("whole second", budgets.second()));
    let ratios = seconds().filter_map(|(name, second)| {
        let worst = second.iter().max_by_key(|frame| frame.whole)?;
        Some((evenness(second)?, name, worst.time_s()))
    });
    rows.push(Samples::of(ratios).row("worst frame / mean", Some(EVENNESS_BUDGET).filter(|_| budgeted)));
    rows.extend(algorithms(flights, budgets));
    rows.into_iter().flatten().collect()
}

fn algorithms(flights: &[Flown], budgets: Budgets) -> Vec<Option<Row>> {
    let per_unit = |kernel: Kernel, units: u32| {
        let kernel = kernel as usize;
        Samples::of(frames(flights).filter(move |(_, f)| f.units[kernel] > 0).map(move |(name, f)| {
            let cost = f64::from(f.kernels[kernel]) / f64::from(f.units[kernel]);
            (cost * f64::from(units), name, f.time_s())
        }))
    };
    let mut rows = Vec::new();
    for (kernel, what) in [
        (Kernel::Decode, "packet decode"),
        (Kernel::Strapdown, "strapdown"),
        (Kernel::FilterPredict, "filter predict, a slice"),
        (Kernel::FilterUpdate, "filter update, a scalar"),
    ] {
        rows.push(per_unit(kernel, 1).row(what, None));
    }
    for (predicts, what) in [
        (Predicts::Rehearsed, "predictor evaluation"),
        (Predicts::Held, "predictor evaluation, paper"),
        (Predicts::InTables, "predictor evaluation, tables"),
    ] {
        let kernel = Kernel::Predictor as usize;
        let by_model = flights.iter().filter(move |flown| flown.predicts == predicts);
        let samples = by_model.flat_map(|flown| flown.cost.frames.iter().map(|f| (flown.name.as_str(), f)));
        let samples = samples.filter(|(_, f)| f.units[kernel] > 0);
        let samples =
            samples.map(|(name, f)| (f64::from(f.kernels[kernel]) / f64::from(f.units[kernel]), name, f.time_s()));
        rows.push(Samples::of(samples).row(what, None));
    }
    rows.push(per_unit(Kernel::Predictor, EVALUATIONS_PER_STEP).row("predictor step", None));
    rows.push(per_unit(Kernel::Corrector, 1).row("corrector, a frame", None));
    let cycles = || flights.iter().flat_map(|flown| flown.cost.cycles.iter().map(|c| (flown.name.as_str(), c)));
    let time_s = |frame: u32| f64::from(frame) / f64::from(FRAMES_PER_SECOND);
    let cost = cycles().map(|(name, c)| (f64::from(c.cost), name, time_s(c.frame)));
    rows.push(Samples::of(cost).row("corrector cycle", None));
    let calls = cycles().map(|(name, c)| (f64::from(c.predictions), name, time_s(c.frame)));
    rows.push(Samples::of(calls).row("predictor calls / cycle", Some(CALLS_BUDGET)));
    let evaluations = cycles().map(|(name, c)| (f64::from(c.evaluations), name, time_s(c.frame)));
    rows.push(Samples::of(evaluations).row("evaluations / cycle", Some(f64::from(MAX_EVALUATIONS))));
    rows.push(per_unit(Kernel::Encode, 1).row("packet encode", None));
    for (predicts, name) in [(Predicts::Rehearsed, "evaluation, mean"), (Predicts::Held, "evaluation, mean, paper")] {
        rows.push(mean_row(flights, predicts, budgets.evaluation(predicts), name));
    }
    rows
}

/// The mean cost of an evaluation over all flights that predict alike.
fn mean_row(flights: &[Flown], predicts: Predicts, budget: Option<f64>, name: &str) -> Option<Row> {
    let evaluation = mean_evaluation(flights, predicts)?;
    Some(Row {
        name: name.into(),
        count: 1,
        median: evaluation,
        maximum: evaluation,
        budget,
        margin: budget.map(|budget| 1.0 - evaluation / budget),
        flight: "all with the default model".into(),
        time_s: 0.0,
    })
}

fn frames(flights: &[Flown]) -> impl Iterator<Item = (&str, &super::ledger::FrameCost)> {
    flights.iter().flat_map(|flown| flown.cost.frames.iter().map(|frame| (flown.name.as_str(), frame)))
}

/// Cost of an evaluation of the equations of motion: all of the predictor's over all its evaluations.
fn mean_evaluation(flights: &[Flown], predicts: Predicts) -> Option<f64> {
    let alike = flights.iter().filter(|flown| flown.predicts == predicts);
    let totals = alike.map(|flown| flown.cost.total(Kernel::Predictor));
    let (cost, evaluations) = totals.fold((0, 0), |sum, (cost, units)| (sum.0 + cost, sum.1 + units));
    (evaluations > 0).then(|| cost as f64 / evaluations as f64)
}

/// Figures by the names of `firmware/budgets.toml`, which are those of instructions; in another unit there is only the
/// stack.
#[must_use]
pub fn metrics(flights: &[Flown], rows: &[Row], budgets: Budgets) -> BTreeMap<String, f64> {
    let mut metrics = BTreeMap::new();
    let stack = flights.iter().map(|flown| flown.cost.stack_high_water_bytes).max().filter(|bytes| *bytes > 0);
    metrics.extend(stack.map(|bytes| ("stack_high_water_bytes".to_owned(), f64::from(bytes))));
    if !budgets.in_instructions() {
        return metrics;
    }
    let maximum = |name: &str| rows.iter().find(|row| row.name == name).map(|row| row.maximum);
    let named = [
        ("worst_frame_instructions", "whole frame"),
        ("worst_second_instructions", "whole second"),
        ("evenness", "worst frame / mean"),
        ("predictor_calls_per_cycle", "predictor calls / cycle"),
        ("predictor_evaluations_per_cycle", "evaluations / cycle"),
    ];
    for (metric, row) in named {
        metrics.extend(maximum(row).map(|value| (metric.to_owned(), value)));
    }
    for slot in &SCHEDULE {
        metrics.extend(maximum(&format!("slot {}", slot.name)).map(|value| (format!("slot.{}", slot.name), value)));
    }
    for (predicts, metric) in [
        (Predicts::Rehearsed, "predictor_instructions_per_evaluation"),
        (Predicts::Held, "predictor_instructions_per_evaluation_paper"),
    ] {
        metrics.extend(mean_evaluation(flights, predicts).map(|value| (metric.to_owned(), value)));
    }
    metrics
}

/// The table for people.
#[must_use]
pub fn text(rows: &[Row]) -> String {
    let mut text = format!(
        "{:<29} {:>7} {:>10} {:>10} {:>10} {:>7}  {}\n",
        "", "count", "median", "maximum", "budget", "margin", "maximum in"
    );
    for row in rows {
        let budget = row.budget.map_or_else(|| "-".into(), number);
        let margin = row.margin.map_or_else(|| "-".into(), |margin| format!("{:.0} %", 100.0 * margin));
        let place = format!("{}, {:.2} s", row.flight, row.time_s);
        let (median, maximum) = (number(row.median), number(row.maximum));
        let name = &row.name;
        // Writing into a string cannot fail.
        let _ =
            writeln!(text, "{name:<29} {:>7} {median:>10} {maximum:>10} {budget:>10} {margin:>7}  {place}", row.count);
    }
    text
}

/// Whole numbers in groups of three digits, small ones with two decimals.
fn number(value: f64) -> String {
    if value < 1000.0 && value.fract() != 0.0 {
        return format!("{value:.2}");
    }
    let digits = format!("{value:.0}");
    let mut grouped = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

#[cfg(test)]
mod tests {
    use super::super::ledger::tests::frame;
    use super::*;

    fn flown(name: &str, costs: &[u32]) -> Flown {
        let mut cost = FlightCost::default();
        cost.stack_high_water_bytes = 900;
        (1..).zip(costs).for_each(|(index, whole)| cost.enter(frame(index, *whole)));
        Flown { name: name.into(), predicts: Predicts::Rehearsed, cost }
    }

    const M7: Budgets = Budgets::Instructions(Some(Target::M7));

    fn row<'a>(rows: &'a [Row], name: &str) -> &'a Row {
        rows.iter().find(|row| row.name == name).unwrap()
    }

    #[test]
    fn a_row_has_count_median_maximum_margin_and_the_first_place_of_the_maximum() {
        let rows = rows(&[flown("a", &[10, 40, 20]), flown("b", &[40, 30])], M7);
        let whole = row(&rows, "whole frame");
        assert_eq!((whole.count, whole.median, whole.maximum), (5, 30.0, 40.0));
        assert_eq!((whole.flight.as_str(), whole.time_s), ("a", 0.04));
        assert_eq!((whole.budget, whole.margin), (Some(100_000.0), Some(1.0 - 40.0 / 100_000.0)));
        assert_eq!(row(&rows, "whole second").maximum, 70.0);
        assert_eq!(row(&rows, "predictor evaluation").maximum, 5.0);
        assert_eq!(row(&rows, "predictor step").maximum, 20.0);
        assert!(rows.iter().all(|row| !row.is_over()));
    }

    #[test]
    fn a_frame_beyond_the_budget_is_told() {
        let rows = rows(&[flown("a", &[100_001])], M7);
        assert!(row(&rows, "whole frame").is_over());
        let free = super::rows(&[flown("a", &[100_001])], Budgets::None);
        assert!(free.iter().all(|row| !row.is_over()), "wall time has no budget");
    }

    #[test]
    fn cycles_are_held_against_cycles_and_no_other_unit_has_the_names_of_instructions() {
        let flights = [flown("a", &[100_001; 50])];
        let cycles = rows(&flights, Budgets::Cycles);
        assert!(cycles.iter().all(|row| !row.is_over()));
        let held: Vec<_> = cycles.iter().filter(|row| row.budget.is_some()).map(|row| row.name.as_str()).collect();
        assert_eq!(held, ["whole frame"]);
        assert!(row(&rows(&[flown("a", &[400_001])], Budgets::Cycles), "whole frame").is_over());
        let named = metrics(&flights, &cycles, Budgets::Cycles);
        assert_eq!(named.into_iter().collect::<Vec<_>>(), [("stack_high_water_bytes".to_owned(), 900.0)]);
        let unknown = rows(&flights, Budgets::Instructions(None));
        assert_eq!(row(&unknown, "evaluation, mean").budget, None);
        assert!(row(&unknown, "whole frame").is_over());
    }

    #[test]
    fn metrics_have_the_names_of_the_budgets() {
        let flights = [flown("a", &[100; 100]), flown("b", &[400; 60])];
        let metrics = metrics(&flights, &rows(&flights, M7), M7);
        assert_eq!(metrics["worst_frame_instructions"], 400.0);
        assert_eq!(metrics["worst_second_instructions"], 20_000.0);
        assert_eq!((metrics["evenness"], metrics["stack_high_water_bytes"]), (1.0, 900.0));
        assert_eq!(metrics["slot.guidance"], 200.0);
        // A quarter of the cost over two evaluations a frame.
        assert_eq!(metrics["predictor_instructions_per_evaluation"], (25.0 * 100.0 + 100.0 * 60.0) / 320.0);
    }

    #[test]
    fn numbers_are_grouped() {
        assert_eq!([0.5, 7.0, 1234.5, 1_234_567.0].map(number), ["0.50", "7", "1,234", "1,234,567"]);
    }
}
