//! The table of a case, for terminal and page.

use fsw_study::sekf::cases::{Flown, Outcome};
use fsw_study::sekf::kind::Kind;
use fsw_study::sekf::limit::Limit;
use fsw_study::sekf::reference;

use crate::report::number;

/// Columns.
const COLUMNS: usize = 12;
/// The column of the ratio to the EKF.
const RATIO: usize = 3;
/// NEES beyond which its order of magnitude is all that matters.
const HUGE: f64 = 1e4;

/// Heads of the columns of [`cells`].
pub const HEADS: [&str; COLUMNS] = [
    "filter",
    "position m",
    "reference",
    "EKF/filter",
    "reference",
    "at least",
    "NEES",
    "indefinite %",
    "diverged",
    "ns a step",
    "M7 instr.",
    "M7 EKFs",
];

/// What the figures of the flight processor are.
pub const M7: &str = "M7: instructions of a step on the Cortex-M7, and over those of the EKF, as cargo xtask study-cost counted \
    them for the default settings, of a filter that stops up to that step; with others there is no figure.";

/// A figure, or a dash where there is none.
pub fn figure(value: f64, decimals: usize) -> String {
    if value.is_finite() { number(value, decimals) } else { "–".to_owned() }
}

/// A row: filter, errors, reference, consistency, cost.
pub fn cells(case: &Flown, outcome: &Outcome) -> [String; COLUMNS] {
    let known = reference::of(case.case, outcome.filter);
    let known = |value: fn(&reference::Reference) -> Option<f64>| known.and_then(value).unwrap_or(f64::NAN);
    let ekf = case.filters.iter().find(|other| other.filter == Kind::Ekf);
    let ekf = ekf.and_then(|ekf| ekf.m7_instructions_per_step).unwrap_or(f64::NAN);
    let m7 = outcome.m7_instructions_per_step.unwrap_or(f64::NAN);
    [
        outcome.filter.name().to_owned(),
        figure(outcome.position_rmse_m, 0),
        figure(known(|r| Some(r.position_m)), 0),
        figure(outcome.ratio_to_ekf, 3),
        figure(known(|r| Some(r.ratio)), 2),
        figure(known(|r| r.at_least), 2),
        if outcome.nees > HUGE { format!("{:.0e}", outcome.nees) } else { figure(outcome.nees, 1) },
        figure(100.0 * outcome.indefinite_share, 1),
        outcome.diverged.to_string(),
        figure(outcome.host_ns_per_step, 0),
        figure(m7, 0),
        figure(m7 / ekf, 2),
    ]
}

/// A row of a bound: errors alone.
pub fn limit_cells(limit: &Limit) -> [String; COLUMNS] {
    let mut cells = [const { String::new() }; COLUMNS];
    let figures = [limit.knowledge.name().to_owned(), figure(limit.position_rmse_m, 0)];
    cells.iter_mut().zip(figures).for_each(|(cell, text)| *cell = text);
    if let Some(ratio) = cells.get_mut(RATIO) {
        *ratio = figure(limit.ratio_to_ekf, 3);
    }
    cells
}
