//! P2's plots: state errors on a logarithmic axis (its fig. 2), order against time, nonlinearity against time (fig. 3), and
//! both under three thresholds (figs. 4 and 5).

use fsw_study::ddf::reference::middle;
use fsw_study::ddf::{Config, Kind, Knowledge, Limit, Outcome, STATES, Units};

use crate::report::{Axis, Figure, Ink, Mark, Panel, Point};

/// State names with the unit of the plots, and the factor to it.
const AXES: [(&str, f64); STATES] = [
    ("radius, m", 1.0),
    ("speed, m/s", 1.0),
    ("path angle, deg", 57.295_779_513_082_32),
    ("longitude, deg", 57.295_779_513_082_32),
    ("latitude, deg", 57.295_779_513_082_32),
    ("heading, deg", 57.295_779_513_082_32),
];
/// Height of a panel.
const PANEL: u32 = 150;
/// What axes of time add to it.
const TIME_AXIS: u32 = 30;
/// What a logarithmic axis shows of a zero: nothing below it matters.
const FLOOR: f64 = 1e-12;
/// Inks of three thresholds, the lowest first.
const THRESHOLDS: [Ink; 3] = [Ink::Green, Ink::Blue, Ink::Vermillion];

/// A curve over time from values after each step.
fn curve(config: &Config, values: impl Iterator<Item = f64>) -> Vec<Point> {
    values.enumerate().map(|(index, value)| ((index + 1) as f64 * config.experiment.step_s, value)).collect()
}

fn decades(value: f64) -> f64 {
    if value > FLOOR { value.log10() } else { f64::NAN }
}

fn time(is_last: bool) -> (Axis, u32) {
    let axis = Axis::fit(if is_last { "time, s" } else { "" }).including(0.0);
    if is_last { (axis, PANEL + TIME_AXIS) } else { (axis.silent(), PANEL) }
}

fn state_errors(config: &Config, history: &[[f64; STATES]], state: usize) -> Vec<Point> {
    let factor = AXES.get(state).map_or(1.0, |axis| axis.1);
    curve(config, history.iter().map(|rmse| decades(rmse.get(state).map_or(f64::NAN, |x| x * factor))))
}

/// Errors of the states after each step, and the ink of their curves.
type History<'a> = (&'a [[f64; STATES]], Ink);

/// Fig. 2: state errors of the filters that the paper compares, and of the EKFs that it does not, beside the least errors of
/// who is as uncertain of the parameters as the desensitized filters.
pub fn errors(config: &Config, outcomes: &[Outcome], limits: &[Limit]) -> Figure {
    let shown: Vec<(&Outcome, Ink)> = [
        (Kind::Ekf, Ink::Muted),
        (Kind::EkfTuned, Ink::Vermillion),
        (Kind::Rddf1, Ink::Orange),
        (Kind::Rddf2, Ink::Blue),
        (Kind::ArddfFree, Ink::Green),
    ]
    .into_iter()
    .filter_map(|(kind, ink)| Some((middle(outcomes, kind)?, ink)))
    .collect();
    let least = limits.iter().find(|limit| limit.knowledge == Knowledge::Statistics);
    let named = least.map(|limit| (Mark::Line, Ink::Text, limit.knowledge.name().to_owned()));
    let filters = shown.iter().map(|(outcome, ink)| (Mark::Line, *ink, outcome.name.clone()));
    let mut curves: Vec<History<'_>> = least.map(|limit| (&limit.history[..], Ink::Text)).into_iter().collect();
    curves.extend(shown.iter().map(|(outcome, ink)| (&outcome.history[..], *ink)));
    Figure {
        title: "State errors (P2, Fig. 2)",
        caption: "Root mean square over all runs, logarithmic; the Cramér–Rao bound in the mean over flights.".into(),
        legend: named.into_iter().chain(filters).collect(),
        panels: (0..STATES).map(|state| state_panel(config, &curves, state, state + 1 == STATES)).collect(),
        missing: "No filter was flown.",
    }
}

/// The outcomes of the thresholds of a kind, at most three, with their inks.
fn thresholds(outcomes: &[Outcome], kind: Kind) -> Vec<(&Outcome, Ink)> {
    outcomes.iter().filter(|outcome| outcome.filter.kind == kind).zip(THRESHOLDS).collect()
}

fn threshold_legend(shown: &[(&Outcome, Ink)]) -> Vec<(Mark, Ink, String)> {
    let name = |outcome: &Outcome| outcome.filter.threshold.map_or_else(String::new, |t| format!("threshold {t}"));
    shown.iter().map(|(outcome, ink)| (Mark::Line, *ink, name(outcome))).collect()
}

/// A logarithmic axis that shows whole decades.
fn whole_decades<'a>(label: &str, curves: impl Iterator<Item = &'a Vec<Point>>) -> Axis {
    let values: Vec<f64> = curves.flatten().map(|(_, value)| *value).filter(|value| value.is_finite()).collect();
    let low = values.iter().copied().fold(f64::INFINITY, f64::min).floor();
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max).ceil();
    if values.is_empty() { Axis::fit(label).decades() } else { Axis::fixed(label, low, high).decades() }
}

/// A panel of a state's errors.
fn state_panel(config: &Config, shown: &[History<'_>], state: usize, is_last: bool) -> Panel {
    let (x, height) = time(is_last);
    let label = AXES.get(state).map_or("", |axis| axis.0);
    let curves: Vec<_> = shown.iter().map(|(history, _)| state_errors(config, history, state)).collect();
    let panel = Panel::new(x, whole_decades(label, curves.iter()), height);
    curves.into_iter().zip(shown).fold(panel, |panel, (curve, (_, ink))| panel.line(curve, *ink))
}

fn mean_orders(config: &Config, outcome: &Outcome) -> Vec<Point> {
    curve(config, outcome.second_history.iter().map(|share| 1.0 + share))
}

/// Order and nonlinearity against time, with the thresholds.
pub fn nonlinearity(config: &Config, outcomes: &[Outcome], kind: Kind) -> Figure {
    let shown = thresholds(outcomes, kind);
    let one = middle(outcomes, kind);
    let (x, height) = time(false);
    let mut order = Panel::new(x, Axis::fixed("mean order", 0.95, 2.05).every(0.5), height);
    let (x, height) = time(true);
    let mut degree = Panel::new(x, Axis::fit("degree of nonlinearity").decades(), height + PANEL / 2);
    if let Some(outcome) = one {
        order = order.line(mean_orders(config, outcome), Ink::Blue);
        let values = outcome.nonlinearity_history.iter().map(|degree| decades(*degree));
        degree = degree.line(curve(config, values), Ink::Blue);
    }
    for (outcome, ink) in &shown {
        if let Some(threshold) = outcome.filter.threshold {
            degree = degree.level(decades(threshold), *ink, "");
        }
    }
    let is_rank = kind == Kind::ArddfRank;
    Figure {
        title: if is_rank {
            "Order and nonlinearity, rank-sampled (P2, Fig. 3)"
        } else {
            "Order and nonlinearity, from the difference points"
        },
        caption: if is_rank {
            format!(
                "Means over all runs at the middle threshold; the degree is P2's, of [F(x); h(F(x))], {}.",
                match config.filters.rank_units {
                    Units::Raw => "in m, m/s, rad and Pa as they are",
                    Units::Deviations => "in standard deviations of start and noise",
                }
            )
        } else {
            "Means over all runs at the middle threshold; the degree is that of step and measurements together, in standard \
             deviations of start and noise."
                .into()
        },
        legend: threshold_legend(&shown),
        panels: vec![order, degree],
        missing: "No adaptive filter was flown.",
    }
}

/// Figs. 4 and 5: speed errors and order under three thresholds.
pub fn three(config: &Config, outcomes: &[Outcome], kind: Kind) -> Figure {
    let shown = thresholds(outcomes, kind);
    let (radius, speed) = (0, 1);
    let histories: Vec<_> = shown.iter().map(|(outcome, ink)| (&outcome.history[..], *ink)).collect();
    let (x, height) = time(true);
    let order = shown
        .iter()
        .fold(Panel::new(x, Axis::fixed("mean order", 0.95, 2.05).every(0.5), height), |panel, (outcome, ink)| {
            panel.line(mean_orders(config, outcome), *ink)
        });
    Figure {
        title: if kind == Kind::ArddfRank {
            "Three thresholds, rank-sampled (P2, Figs. 4 and 5)"
        } else {
            "Three thresholds, from the difference points (P2, Figs. 4 and 5)"
        },
        caption:
            "Root mean square errors, logarithmic, and the mean order. A lower threshold is longer of second order."
                .into(),
        legend: threshold_legend(&shown),
        panels: vec![
            state_panel(config, &histories, radius, false),
            state_panel(config, &histories, speed, false),
            order,
        ],
        missing: "No adaptive filter was flown.",
    }
}
