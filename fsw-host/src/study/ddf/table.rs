//! The tables of the study, for terminal and page.

use fsw_study::ddf::reference::{self, Bar};
use fsw_study::ddf::{Kind, Limit};

use super::Flown;
use crate::report::number;

/// Columns.
pub const COLUMNS: usize = 14;
/// NEES beyond which its order of magnitude is all that matters.
const HUGE: f64 = 1e4;

/// Heads of the columns of [`rows`].
pub const HEADS: [&str; COLUMNS] = [
    "filter",
    "radius m",
    "speed m/s",
    "position m",
    "NEES",
    "2nd order %",
    "indefinite %",
    "diverged",
    "ms a run",
    "paper s",
    "instr. a step",
    "cost",
    "M7 instr.",
    "M7 cost",
];

/// What stands under the table.
pub const NOTES: [&str; 8] = [
    "In brackets an independent implementation at 200 runs. Errors: root mean square over runs, then the mean from 20 s on.",
    "NEES of six states: 6 is right. Indefinite: share of steps. Cost: instructions relative to RDDF1, of this machine and",
    "of the flight processor. M7: instructions of a step on the Cortex-M7, the mean over a run, as cargo xtask study-cost",
    "counted them for the default settings; with others there is no figure.",
    "Tuned: process noise and what is believed of accelerations and pressure searched (--tune); \"for forces\" scales the",
    "noise of speed, path angle and heading alone. No pair of either grid comes near RDDF1 in position and in speed.",
    "Bounds are Cramér and Rao's, averaged over the first 20 flights: for who knows density, lift and bias, and for who knows",
    "of density and lift the variances W, of each accelerometer's bias its size.",
];

/// A figure, or a dash where there is none.
pub fn figure(value: Option<f64>, decimals: usize) -> String {
    value.filter(|value| value.is_finite()).map_or_else(|| "–".to_owned(), |value| number(value, decimals))
}

/// A row of a bound: errors alone.
pub fn limit_row(limit: &Limit) -> [String; COLUMNS] {
    let [radius, speed, ..] = limit.rmse;
    let mut row = [const { String::new() }; COLUMNS];
    let figures =
        [limit.knowledge.name().to_owned(), number(radius, 0), number(speed, 2), number(limit.position_rmse_m, 0)];
    row.iter_mut().zip(figures).for_each(|(cell, figure)| *cell = figure);
    row
}

/// A row for each filter.
pub fn rows(flown: &[Flown]) -> Vec<[String; COLUMNS]> {
    let base = flown.iter().find(|f| f.outcome.filter.kind == Kind::Rddf1).map(costs);
    let is_middle = |f: &Flown| {
        let kind: Vec<_> = flown.iter().filter(|other| other.outcome.filter.kind == f.outcome.filter.kind).collect();
        kind.get(kind.len() / 2).is_some_and(|middle| std::ptr::eq(*middle, f))
    };
    flown.iter().map(|flown| row(flown, base.unwrap_or_default(), is_middle(flown))).collect()
}

/// Instructions of a step: of this machine, of the Cortex-M7.
fn costs(flown: &Flown) -> [Option<f64>; 2] {
    [flown.instructions_per_step, flown.outcome.m7_instructions_per_step]
}

/// Of several thresholds only the middle one is comparable.
fn row(flown: &Flown, base: [Option<f64>; 2], is_comparable: bool) -> [String; COLUMNS] {
    let o = &flown.outcome;
    let known = reference::of(o.filter.kind).filter(|_| is_comparable);
    let paper_s = reference::paper_s(o.filter.kind).filter(|_| is_comparable);
    let beside = |value: f64, decimals: usize, known: Option<f64>| match known {
        Some(known) => format!("{} ({})", number(value, decimals), number(known, decimals)),
        None => number(value, decimals),
    };
    let [radius, speed, ..] = o.rmse;
    let [here, m7] = costs(flown);
    let [base_here, base_m7] = base;
    let relative = here.zip(base_here).map(|(a, b)| a / b);
    [
        o.name.clone(),
        beside(radius, 0, known.map(|k| k.radius_m)),
        beside(speed, 2, known.map(|k| k.speed_mps)),
        beside(o.position_rmse_m, 0, known.map(|k| k.position_m)),
        if o.nees > HUGE { format!("{:.0e}", o.nees) } else { number(o.nees, 1) },
        beside(100.0 * o.second_share, 0, known.and_then(|k| k.second_share).map(|share| 100.0 * share)),
        number(100.0 * o.indefinite_share, 1),
        o.diverged.to_string(),
        number(o.host_ms_per_run, 1),
        figure(paper_s, 2),
        figure(here, 0),
        relative.map_or_else(|| "–".to_owned(), |relative| beside(relative, 2, known.map(|k| k.cost))),
        figure(m7, 0),
        figure(m7.zip(base_m7).map(|(a, b)| a / b), 2),
    ]
}

/// A bar in words.
pub fn said(bar: &Bar) -> String {
    let verdict = match bar.is_cleared() {
        Some(true) => "yes",
        Some(false) => "NO",
        None => "not measured",
    };
    let bound = if bar.is_least { "at least" } else { "at most" };
    format!("{}: {} ({bound} {}): {verdict}", bar.what, figure(bar.value, 2), number(bar.bound, 2))
}
