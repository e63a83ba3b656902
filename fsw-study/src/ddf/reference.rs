//! What the paper and an independent implementation found, and what the project asks for.

use serde::Serialize;

use super::filters::Kind;
use super::outcome::Outcome;

/// Figures of an independent implementation in another language: default settings, 200 runs, means from 20 s on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// Distance from the planet's centre, m.
    pub radius_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Position, m.
    pub position_m: f64,
    /// Share of steps of second order.
    pub second_share: Option<f64>,
    /// Cost relative to RDDF1.
    pub cost: f64,
}

/// Of a kind of filter, if it was flown there. ARDDF's thresholds were 5e-3 of the raw rank-sampled degree, as here, and
/// 2e-5 of a free one that was measured otherwise.
#[must_use]
pub const fn of(kind: Kind) -> Option<Reference> {
    let (radius_m, speed_mps, position_m, second_share, cost) = match kind {
        Kind::Ekf => (1_724.0, 38.6, 18_439.0, None, 0.46),
        Kind::EkfTuned => (1_317.0, 14.8, 5_315.0, None, 0.46),
        Kind::EkfForces => return None,
        Kind::Ddf1 => (1_724.0, 38.6, 18_439.0, None, 0.96),
        Kind::Ddf2 => (1_724.0, 38.6, 18_439.0, None, 1.06),
        Kind::Rddf1 => (746.0, 4.92, 3_387.0, Some(0.0), 1.0),
        Kind::Rddf2 => (729.0, 4.90, 3_371.0, Some(1.0), 2.17),
        Kind::Rddf2Lite => (729.0, 4.90, 3_370.0, Some(1.0), 1.13),
        Kind::ArddfRank => (767.0, 4.97, 3_427.0, Some(0.28), 2.89),
        Kind::ArddfFree => (754.0, 4.95, 3_429.0, Some(0.38), 1.06),
        Kind::Ekf8 => (797.0, 4.60, 3_461.0, None, 0.42),
    };
    Some(Reference { radius_m, speed_mps, position_m, second_share, cost })
}

/// Seconds of a run of 2000 steps in the paper (its Table 3; Matlab, 3.6 GHz).
#[must_use]
pub const fn paper_s(kind: Kind) -> Option<f64> {
    match kind {
        Kind::Rddf1 => Some(0.8917),
        Kind::Rddf2 => Some(18.5218),
        Kind::ArddfRank => Some(6.5316),
        _ => None,
    }
}

/// A claim of the project with what was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bar {
    /// What.
    pub what: String,
    /// Measured; nothing when it was not.
    pub value: Option<f64>,
    /// The bound.
    pub bound: f64,
    /// Whether it is a least value (or a greatest).
    pub is_least: bool,
}

impl Bar {
    /// Whether it is cleared; nothing when it was not measured.
    #[must_use]
    pub fn is_cleared(&self) -> Option<bool> {
        self.value.map(|value| if self.is_least { value >= self.bound } else { value <= self.bound })
    }
}

/// All claims; costs are those of the Cortex-M7. Of the adaptive filters the middle threshold counts.
#[must_use]
pub fn bars(outcomes: &[Outcome]) -> Vec<Bar> {
    let of = |kind| middle(outcomes, kind);
    let mut bars = Vec::new();
    let mut claim = |what: &str, is_least, bound, pair: (Kind, Kind), value: &dyn Fn(&Outcome) -> Option<f64>| {
        let ratio = of(pair.0).and_then(value).zip(of(pair.1).and_then(value)).map(|(a, b)| a / b);
        bars.push(Bar { what: what.to_owned(), value: ratio, bound, is_least });
    };
    let position = |o: &Outcome| Some(o.position_rmse_m);
    let speed = |o: &Outcome| Some(o.rmse[1]);
    let cost = |o: &Outcome| o.m7_instructions_per_step;
    use Kind::{ArddfFree, Ekf, EkfTuned, Rddf1, Rddf2, Rddf2Lite};
    claim("position, EKF over RDDF1", true, 5.0, (Ekf, Rddf1), &position);
    claim("speed, EKF over RDDF1", true, 7.0, (Ekf, Rddf1), &speed);
    claim("position, tuned EKF over RDDF1", true, 1.5, (EkfTuned, Rddf1), &position);
    claim("speed, tuned EKF over RDDF1", true, 2.7, (EkfTuned, Rddf1), &speed);
    claim("cost on the M7, RDDF2 over RDDF1", false, 2.2, (Rddf2, Rddf1), &cost);
    claim("cost on the M7, RDDF2 with first-order sensitivities over RDDF1", false, 1.2, (Rddf2Lite, Rddf1), &cost);
    claim("cost on the M7, ARDDF with the free measure over RDDF1", false, 1.15, (ArddfFree, Rddf1), &cost);
    claim("position, ARDDF with the free measure over RDDF2", false, 1.05, (ArddfFree, Rddf2), &position);
    claim("speed, ARDDF with the free measure over RDDF2", false, 1.05, (ArddfFree, Rddf2), &speed);
    bars
}

/// The outcome of a kind; of several thresholds the middle one.
#[must_use]
pub fn middle(outcomes: &[Outcome], kind: Kind) -> Option<&Outcome> {
    let all: Vec<_> = outcomes.iter().filter(|outcome| outcome.filter.kind == kind).collect();
    all.get(all.len() / 2).copied()
}
