//! What is asked of the figures, and whether they meet it.

use serde::Serialize;

use super::Study;
use super::case::{CaseResult, Rmse};

/// P3 Table 5: x, y, z (m), vx, vy, vz (m/s) at the parachute's opening, scenario 1 and 2.
pub const TABLE_5: [[f64; 6]; 2] =
    [[589.92, 425.66, 183.26, 0.0569, 0.0833, 0.1747], [319.1, 342.42, 28.25, 0.0074, 0.0400, 0.0371]];

/// One figure against what is asked of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// What is asked.
    pub what: String,
    /// The figure; none when it was not flown.
    pub value: Option<f64>,
    /// At least.
    pub low: Option<f64>,
    /// At most.
    pub high: Option<f64>,
    /// Whether it is met.
    pub is_met: bool,
}

impl Bar {
    fn new(what: String, value: Option<f64>, low: Option<f64>, high: Option<f64>) -> Self {
        let is_met = value.is_some_and(|v| low.is_none_or(|low| v >= low) && high.is_none_or(|high| v <= high));
        Self { what, value, low, high, is_met }
    }

    fn below(what: String, value: Option<f64>, high: f64) -> Self {
        Self::new(what, value, None, Some(high))
    }
}

/// When the weight of the last model first passed `level`, s; none if it never did.
#[must_use]
pub fn last_model_passes_s(case: &CaseResult, level: f64) -> Option<f64> {
    let trace = &case.filters.iter().find(|f| f.label.starts_with("gating"))?.first;
    let passed = trace.weights.iter().position(|w| w.last().is_some_and(|w| *w > level))?;
    trace.time_s.get(passed).copied()
}

/// What is asked of the figures, in the order of the study.
#[must_use]
pub fn bars(study: &Study) -> Vec<Bar> {
    let mut bars = fixed(study);
    for case in &study.table5 {
        bars.extend(table5(case));
    }
    for case in &study.ranking {
        bars.extend(ranking(case));
    }
    for case in &study.efficiency {
        bars.extend(efficiency(case));
    }
    for case in &study.robust {
        bars.extend(robust(case));
    }
    bars
}

fn fixed(study: &Study) -> Vec<Bar> {
    let Some(case) = study.fixed.iter().find(|case| case.scenario == 2) else { return Vec::new() };
    let gating = case.filters.iter().find(|f| f.label.starts_with("gating"));
    let name = |what: &str| format!("fixed density, scenario 2: {what}");
    vec![
        Bar::below(name("time at which model 7 passes 0.9, s"), last_model_passes_s(case, 0.9), 70.0),
        Bar::below(name("position error at the end, m"), gating.map(|f| f.rmse.position_m), 100.0),
        Bar::below(name("velocity error at the end, m/s"), gating.map(|f| f.rmse.velocity_mps), 0.1),
    ]
}

fn table5(case: &CaseResult) -> Vec<Bar> {
    let Some(gating) = case.filters.iter().find(|f| f.label.starts_with("gating")) else { return Vec::new() };
    let said = Rmse::of_roots(TABLE_5[usize::from(case.scenario == 2)]);
    let name = |what| format!("Table 5, scenario {}, {}: {what} over the paper's", case.scenario, gating.label);
    let ratio = |ours: f64, theirs: f64| Some(ours / theirs);
    vec![
        Bar::new(name("3-D position"), ratio(gating.rmse.position_m, said.position_m), Some(0.85), Some(1.15)),
        Bar::new(name("3-D velocity"), ratio(gating.rmse.velocity_mps, said.velocity_mps), Some(0.75), Some(1.25)),
    ]
}

fn ranking(case: &CaseResult) -> Vec<Bar> {
    let scenario = case.scenario;
    let name = |what: &str| format!("scenario {scenario}: {what}");
    let augmented = case.filter("augmented");
    let experts = case.filter("experts");
    let of_gating = |ours: Option<f64>| Some(ours? / case.best_gating()?.rmse.position_m);
    let most = if scenario == 1 { 0.95 } else { 0.5 };
    let indefinite = case.filters.iter().map(|f| f.indefinite_share).reduce(f64::max);
    vec![
        Bar::below(name("augmented, cost in EKFs on the M7"), augmented.and_then(|f| f.m7_ekfs), 1.4),
        Bar::new(name("experts, NEES"), experts.and_then(|f| f.nees), Some(5.5), Some(6.6)),
        Bar::below(
            name("augmented, 3-D position over the best gating's"),
            of_gating(augmented.map(|f| f.rmse.position_m)),
            most,
        ),
        Bar::below(
            name("experts, 3-D position over the best gating's"),
            of_gating(experts.map(|f| f.rmse.position_m)),
            most,
        ),
        Bar::below(name("largest share of indefinite covariances"), indefinite, 0.0),
    ]
}

fn efficiency(case: &CaseResult) -> Vec<Bar> {
    let name = |what: &str| format!("scenario {}, {} runs: {what}", case.scenario, case.runs);
    let least = case.bound.map(|bound| bound.unknown_density);
    let attained = case.bound.map(|bound| bound.attained);
    let augmented = case.filter("augmented");
    let over = |least: Option<Rmse>, of: fn(&Rmse) -> f64| Some(of(&augmented?.rmse) / of(&least?));
    let worst_axis = |least: Option<Rmse>| {
        let (ours, least) = (augmented?.rmse.axes, least?.axes);
        ours.iter().zip(&least).map(|(a, b)| a / b).reduce(f64::max)
    };
    vec![
        Bar::below(name("augmented, 3-D position over the bound"), over(least, |r| r.position_m), 1.03),
        Bar::below(name("augmented, 3-D velocity over the bound"), over(least, |r| r.velocity_mps), 1.03),
        Bar::below(name("augmented, worst axis over the bound"), worst_axis(least), 1.07),
        // Against what attains the bound on the same draws: without the scatter that both have in common.
        Bar::below(name("position over what attains the bound here"), over(attained, |r| r.position_m), 1.03),
        Bar::below(name("velocity over what attains the bound here"), over(attained, |r| r.velocity_mps), 1.03),
        Bar::below(name("worst axis over what attains the bound here"), worst_axis(attained), 1.07),
        Bar::below(name("augmented, NEES"), augmented.and_then(|f| f.nees), 7.2),
    ]
}

fn robust(case: &CaseResult) -> Vec<Bar> {
    let filter = case.filter("gauss-markov");
    let name = |what: &str| format!("waves and bias, scenario {}: gauss-markov, {what}", case.scenario);
    let most = if case.scenario == 1 { 550.0 } else { 210.0 };
    vec![
        Bar::below(name("3-D position, m"), filter.map(|f| f.rmse.position_m), most),
        Bar::below(name("NEES"), filter.and_then(|f| f.nees), 8.0),
    ]
}
