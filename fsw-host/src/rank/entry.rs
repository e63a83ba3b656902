//! What one dispersed entry gave, brief enough to keep thousands of them.

use serde::{Deserialize, Serialize};

use super::navigate::Track;
use crate::campaign::observer::Flown;

/// Epochs between two points of a curve: four seconds.
pub(super) const THINNING: usize = 40;
/// Seconds between two epochs.
pub(super) const EPOCH_S: f64 = 0.1;

/// One entry on its own link log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Least variances.
    pub bound: Curve,
    /// Of each filter.
    pub flown: Vec<Judged>,
}

/// Squares over a flight: of errors, or least variances; position (m²) and velocity ((m/s)²).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Curve {
    /// When the parachute opens.
    pub last: [f64; 2],
    /// Sum over all epochs.
    pub sum: [f64; 2],
    /// Epochs.
    pub epochs: u32,
    /// One in [`THINNING`].
    pub thinned: Vec<[f32; 2]>,
}

impl Curve {
    /// Of the squares ten times a second.
    pub fn of(squares: &[[f64; 2]]) -> Self {
        let sum = squares.iter().fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]);
        Self {
            last: squares.last().copied().unwrap_or_default(),
            sum,
            epochs: u32::try_from(squares.len()).unwrap_or(u32::MAX),
            thinned: squares.iter().step_by(THINNING).map(|square| square.map(|s| s as f32)).collect(),
        }
    }
}

/// What a filter did.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Judged {
    /// On the log.
    pub errors: Curve,
    /// Sum of the normalised errors squared.
    pub nees: f64,
    /// Epochs that have one.
    pub judged: u32,
    /// Those inside the central 95 %.
    pub inside: u32,
    /// Epochs whose covariance was not positive definite.
    pub indefinite: u32,
    /// Times that the full covariance was restarted.
    pub restarted: u32,
    /// Estimates with a number that is not finite.
    pub not_finite: u32,
    /// When it was given up, s.
    pub given_up_s: Option<f64>,
    /// In closed loop, where it was flown so.
    pub closed: Option<Closed>,
}

/// A flight in closed loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Closed {
    /// Distance from the target, m, where the parachute opened.
    pub miss_m: Option<f64>,
    /// The parachute opened.
    pub opened: bool,
    /// Inside the box.
    pub success: bool,
}

impl Judged {
    /// Of a flight over a log, and one in closed loop.
    pub fn of(track: &Track, flown: Option<&Flown>) -> Self {
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        Self {
            errors: Curve::of(&track.errors),
            nees: track.nees.iter().sum(),
            judged: count(track.nees.len()),
            inside: count(track.inside),
            indefinite: count(track.indefinite),
            restarted: track.restarted.into(),
            not_finite: count(track.not_finite),
            given_up_s: track.given_up.map(|(time_s, _)| time_s),
            closed: flown.map(|flown| Closed {
                miss_m: flown.miss_m,
                opened: flown.deploy.is_some(),
                success: flown.reason.is_none(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_keeps_sums_end_and_one_point_in_forty() {
        let squares: Vec<[f64; 2]> = (0..81).map(|k| [f64::from(k), 2.0 * f64::from(k)]).collect();
        let curve = Curve::of(&squares);
        assert_eq!((curve.epochs, curve.sum, curve.last), (81, [3240.0, 6480.0], [80.0, 160.0]));
        assert_eq!(curve.thinned, [[0.0, 0.0], [40.0, 80.0], [80.0, 160.0]]);
        assert_eq!(Curve::of(&[]), Curve::default());
    }
}
