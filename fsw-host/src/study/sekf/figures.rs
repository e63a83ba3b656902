//! P1's plots: the profile of the unknown input (Fig. 1), errors of one run (Fig. 2), root mean square errors (Fig. 3).

use fsw_study::sekf::STATES;
use fsw_study::sekf::cases::Outcome;
use fsw_study::sekf::config::Config;
use fsw_study::sekf::kind::Kind;
use fsw_study::sekf::limit::{Knowledge, Limit};

use crate::report::{Axis, Figure, Ink, Mark, Panel, Point};

/// State names with the unit of the plots, and the factor to it.
pub(super) const AXES: [(&str, f64); STATES] = [
    ("altitude, m", 1.0),
    ("speed, m/s", 1.0),
    ("path angle, deg", 57.295_779_513_082_32),
    ("longitude, deg", 57.295_779_513_082_32),
    ("latitude, deg", 57.295_779_513_082_32),
    ("heading, deg", 57.295_779_513_082_32),
];
/// Height of a panel.
const PANEL: u32 = 150;

fn ink(kind: Kind) -> Ink {
    match kind {
        Kind::Ekf => Ink::Vermillion,
        Kind::Sekf => Ink::Blue,
        Kind::Aekf12 => Ink::Green,
        Kind::Aekf17 => Ink::Purple,
        _ => Ink::Muted,
    }
}

/// The outcomes of some filters, in that order.
fn of<'a>(outcomes: &'a [Outcome], kinds: &[Kind]) -> Vec<&'a Outcome> {
    kinds.iter().filter_map(|kind| outcomes.iter().find(|outcome| outcome.filter == *kind)).collect()
}

fn legend(outcomes: &[&Outcome]) -> Vec<(Mark, Ink, String)> {
    outcomes.iter().map(|o| (Mark::Line, ink(o.filter), o.filter.name().to_owned())).collect()
}

/// Fig. 1.
pub fn profile(config: &Config) -> Figure {
    let experiment = &config.experiment;
    let corners = |piece: usize| {
        let from = piece as f64 * config.input.piece_s;
        let to = (from + config.input.piece_s).min(experiment.duration_s);
        let alpha = config.input.alpha(from);
        [(from, alpha), (to, alpha)]
    };
    let pieces = (experiment.duration_s / config.input.piece_s).ceil() as usize;
    let panel = Panel::new(Axis::fit("time, s").including(0.0), Axis::fit("α").symmetric().including(1.2), 200)
        .line((0..pieces).flat_map(corners).collect(), Ink::Text);
    Figure {
        title: "Unknown input (P1, Fig. 1)",
        caption:
            "The factor α of the unknown input in the equations of motion. The paper shows such a profile without its \
                  values; this one is a setting."
                .into(),
        legend: Vec::new(),
        panels: vec![panel],
        missing: "No input.",
    }
}

/// One panel a state.
fn panels(y: impl Fn(usize) -> Axis, lines: impl Fn(Panel, usize) -> Panel) -> Vec<Panel> {
    (0..STATES)
        .map(|state| {
            let last = state + 1 == STATES;
            let x = Axis::fit(if last { "time, s" } else { "" }).including(0.0);
            lines(Panel::new(if last { x } else { x.silent() }, y(state), if last { PANEL + 30 } else { PANEL }), state)
        })
        .collect()
}

fn label(state: usize) -> &'static str {
    AXES.get(state).map_or("", |axis| axis.0)
}

/// A component in the unit of its plot.
pub(super) fn value(of: &[f64; STATES], state: usize) -> f64 {
    of.get(state).zip(AXES.get(state)).map_or(f64::NAN, |(value, axis)| value * axis.1)
}

/// Fig. 2: errors of run 0.
pub fn single(config: &Config, outcomes: &[Outcome]) -> Figure {
    let shown = of(outcomes, &[Kind::Ekf, Kind::Sekf]);
    let curve = |o: &Outcome, state: usize| -> Vec<Point> {
        let time = |index: usize| (index + 1) as f64 * config.experiment.step_s;
        o.single.iter().enumerate().map(|(index, error)| (time(index), value(error, state))).collect()
    };
    Figure {
        title: "Errors of one run (P1, Fig. 2)",
        caption: "Estimate less truth, untuned filters, run 0.".into(),
        legend: legend(&shown),
        panels: panels(
            |state| Axis::fit(label(state)).symmetric(),
            |panel, state| shown.iter().fold(panel, |panel, o| panel.line(curve(o, state), ink(o.filter))),
        ),
        missing: "No filter was flown.",
    }
}

/// Fig. 3: root mean square errors of a case, logarithmic, and the bound of who does not know the input.
pub fn rmse(
    config: &Config,
    title: &'static str,
    caption: &str,
    (outcomes, limits): (&[Outcome], &[Limit]),
    kinds: &[Kind],
) -> Figure {
    let shown = of(outcomes, kinds);
    let curve = |history: &[[f64; STATES]], state: usize| -> Vec<Point> {
        let time = |index: usize| (index + 1) as f64 * config.experiment.step_s;
        history.iter().enumerate().map(|(index, rmse)| (time(index), value(rmse, state).log10())).collect()
    };
    let bound = limits.iter().find(|limit| limit.knowledge == Knowledge::Statistics);
    let named = bound.map(|limit| (Mark::Line, Ink::Muted, limit.knowledge.name().to_owned()));
    Figure {
        title,
        caption: caption.to_owned(),
        legend: legend(&shown).into_iter().chain(named).collect(),
        panels: panels(
            |state| Axis::fit(label(state)).decades(),
            |panel, state| {
                let panel =
                    bound.iter().fold(panel, |panel, limit| panel.thin(curve(&limit.history, state), Ink::Muted));
                shown.iter().fold(panel, |panel, o| panel.line(curve(&o.history, state), ink(o.filter)))
            },
        ),
        missing: "No filter was flown.",
    }
}
