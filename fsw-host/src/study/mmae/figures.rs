//! P3's plots: weights of the models (Figs. 5 and 8), errors (6, 7 and 9), root mean square errors (10 and 11); and the
//! ranking over time.

use fsw_study::mmae::case::{CaseResult, FilterResult, Moment, Trace};

use crate::report::{Axis, Figure, Ink, Mark, Panel, Point};

/// Components with their labels.
const AXES: [&str; 6] = ["x, m", "y, m", "z, m", "vx, m/s", "vy, m/s", "vz, m/s"];
/// Height of a panel.
const PANEL: u32 = 140;
/// Colours of up to seven models, from the thinnest air to the densest.
const MODELS: [Ink; 7] = [Ink::Orange, Ink::Sky, Ink::Green, Ink::Muted, Ink::Purple, Ink::Vermillion, Ink::Blue];
/// Colours of the ranking.
const RANKED: [(&str, Ink); 6] = [
    ("ekf", Ink::Vermillion),
    ("bayes", Ink::Purple),
    ("imm", Ink::Sky),
    ("augmented", Ink::Blue),
    ("experts", Ink::Green),
    ("gauss-markov", Ink::Text),
];

fn gating(case: &CaseResult) -> Option<&FilterResult> {
    case.filters.iter().find(|filter| filter.label.starts_with("gating"))
}

/// A time axis, labelled in the last of some panels.
fn time(is_last: bool) -> Axis {
    let axis = Axis::fit(if is_last { "time, s" } else { "" }).including(0.0);
    if is_last { axis } else { axis.silent() }
}

/// One panel a component.
fn panels(y: impl Fn(usize) -> Axis, lines: impl Fn(Panel, usize) -> Panel) -> Vec<Panel> {
    (0..AXES.len())
        .map(|axis| {
            let is_last = axis + 1 == AXES.len();
            lines(Panel::new(time(is_last), y(axis), if is_last { PANEL + 30 } else { PANEL }), axis)
        })
        .collect()
}

fn label(axis: usize) -> &'static str {
    AXES.get(axis).copied().unwrap_or_default()
}

fn component(of: &[f64; 6], axis: usize) -> f64 {
    of.get(axis).copied().unwrap_or(f64::NAN)
}

/// Figs. 5 and 8.
pub fn weights(cases: &[CaseResult], densities: &[f64]) -> Figure {
    let panel = |(at, case): (usize, &CaseResult)| {
        let is_last = at + 1 == cases.len();
        let panel = Panel::new(time(is_last), Axis::fixed("weight", 0.0, 1.0), if is_last { 230 } else { 200 })
            .named(format!("scenario {}: {}", case.scenario, gating(case).map_or("", |f| &f.label)));
        let Some(trace) = gating(case).map(|filter| &filter.first) else { return panel };
        let curve = |model: usize| -> Vec<Point> {
            let weight = |w: &Vec<f64>| w.get(model).copied().unwrap_or(f64::NAN);
            trace.time_s.iter().zip(&trace.weights).map(|(t, w)| (*t, weight(w))).collect()
        };
        densities.iter().enumerate().fold(panel, |panel, (model, _)| panel.line(curve(model), model_ink(model)))
    };
    Figure {
        title: "Weights of the models (P3, Figs. 5 and 8)",
        caption: "The truth is that of the special case, its density between the last two models' and closest to the \
                  last's. In scenario 1 it depends on the noise and the rate whether the bank finds it: in pressure and \
                  force a density larger by 9.5 % is a vehicle lower by 680 m, and the altitude at entry is known to \
                  261 m (1 σ) only. Past the peak of the load the weights relax by themselves: they are proportional, in \
                  logarithm, to the present size of the readings."
            .into(),
        legend: densities
            .iter()
            .enumerate()
            .map(|(model, density)| (Mark::Line, model_ink(model), format!("{}: Δ = {density}", model + 1)))
            .collect(),
        panels: cases.iter().enumerate().map(panel).collect(),
        missing: "No bank was flown.",
    }
}

fn model_ink(model: usize) -> Ink {
    MODELS.get(model).copied().unwrap_or(Ink::Muted)
}

fn errors_of(trace: &Trace, axis: usize) -> Vec<Point> {
    trace.time_s.iter().zip(&trace.errors).map(|(t, e)| (*t, component(e, axis))).collect()
}

/// Figs. 6, 7 and 9: errors of the special case with three standard deviations, beside the EKF with the nominal density.
pub fn errors(case: &CaseResult) -> Figure {
    let ours = gating(case).map(|filter| &filter.first);
    let single = case.filter("ekf").map(|filter| &filter.first);
    let band = |axis: usize| -> Vec<(f64, f64, f64)> {
        let three = |s: &[f64; 6]| 3.0 * component(s, axis);
        ours.map_or_else(Vec::new, |trace| {
            trace.time_s.iter().zip(&trace.sigmas).map(|(t, s)| (*t, -three(s), three(s))).collect()
        })
    };
    Figure {
        title: if case.scenario == 1 {
            "Errors, scenario 1 (P3, Figs. 6 and 7)"
        } else {
            "Errors, scenario 2 (P3, Fig. 9)"
        },
        caption:
            "Estimate less truth in the special case: the bank under the paper's gating with its own three standard \
                  deviations, and one EKF with the nominal density."
                .into(),
        legend: vec![
            (Mark::Line, Ink::Blue, "bank, gating".into()),
            (Mark::Band, Ink::Blue, "its 3 σ".into()),
            (Mark::Line, Ink::Vermillion, "one EKF".into()),
        ],
        panels: panels(
            |axis| Axis::fit(label(axis)).symmetric(),
            |panel, axis| {
                let panel = panel.band(band(axis), Ink::Blue);
                let panel =
                    single.iter().fold(panel, |panel, trace| panel.line(errors_of(trace, axis), Ink::Vermillion));
                ours.iter().fold(panel, |panel, trace| panel.line(errors_of(trace, axis), Ink::Blue))
            },
        ),
        missing: "No filter was flown.",
    }
}

fn rmse_of(history: &[Moment], axis: usize) -> Vec<Point> {
    history.iter().map(|m| (m.time_s, component(&m.rmse, axis))).collect()
}

/// Figs. 10 and 11: root mean square errors with three standard deviations as the filter believes.
pub fn rmse(case: &CaseResult) -> Figure {
    let empty = FilterResult::default();
    let filter = gating(case).unwrap_or(&empty);
    let sigma = |axis: usize| -> Vec<Point> {
        filter.history.iter().map(|m| (m.time_s, 3.0 * component(&m.sigma, axis))).collect()
    };
    let bound = |axis| case.bound.map_or(f64::NAN, |bound| component(&bound.unknown_density.axes, axis));
    Figure {
        title: if case.scenario == 1 {
            "Root mean square errors, scenario 1 (P3, Fig. 10)"
        } else {
            "Root mean square errors, scenario 2 (P3, Fig. 11)"
        },
        caption: format!(
            "{} runs, {}; reading {:?} of Table 1 at {} Hz. The level is the bound at the parachute's opening.",
            case.runs, filter.label, case.reading, case.rate_hz
        ),
        legend: vec![
            (Mark::Line, Ink::Blue, "RMSE".into()),
            (Mark::Line, Ink::Vermillion, "3 σ".into()),
            (Mark::Line, Ink::Green, "bound at the end".into()),
        ],
        panels: panels(
            |axis| Axis::fit(label(axis)).including(0.0),
            |panel, axis| {
                panel
                    .level(bound(axis), Ink::Green, "")
                    .line(sigma(axis), Ink::Vermillion)
                    .line(rmse_of(&filter.history, axis), Ink::Blue)
            },
        ),
        missing: "No bank was flown.",
    }
}

/// Position error over time of the filters on the same draws, logarithmic.
pub fn ranking(cases: &[CaseResult], title: &'static str) -> Figure {
    let shown = |case: &CaseResult| -> Vec<(Ink, Vec<Point>)> {
        let ranked = RANKED.iter().filter_map(|(name, ink)| Some((*ink, case.filter(name)?)));
        let best = case.best_gating().map(|filter| (Ink::Orange, filter));
        ranked.chain(best).map(|(ink, filter)| (ink, distance(filter))).collect()
    };
    let panel = |(at, case): (usize, &CaseResult)| {
        let is_last = at + 1 == cases.len();
        let panel = Panel::new(
            time(is_last),
            Axis::fit("3-D position RMSE, m").including(2.0).including(3.0).decades(),
            if is_last { 280 } else { 250 },
        )
        .named(format!("scenario {}", case.scenario));
        let panel = match &case.bound {
            Some(bound) => panel.level(bound.unknown_density.position_m.log10(), Ink::Muted, "bound"),
            None => panel,
        };
        shown(case).into_iter().fold(panel, |panel, (ink, points)| panel.line(points, ink))
    };
    let mut legend: Vec<_> = RANKED.iter().map(|(name, ink)| (Mark::Line, *ink, (*name).to_owned())).collect();
    legend.push((Mark::Line, Ink::Orange, "gating at its best rate".into()));
    Figure {
        title,
        caption: "All filters on the same draws; the level is the bound at the parachute's opening, where it applies."
            .into(),
        legend,
        panels: cases.iter().enumerate().map(panel).collect(),
        missing: "No filter was flown.",
    }
}

fn distance(filter: &FilterResult) -> Vec<Point> {
    let norm = |m: &Moment| m.rmse.iter().take(3).map(|e| e * e).sum::<f64>().sqrt();
    filter.history.iter().map(|m| (m.time_s, norm(m).log10())).collect()
}
