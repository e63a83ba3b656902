//! [`Watch`]: when a model-based filter is not to be believed any more.
//!
//! A filter that cannot go on says so itself. One that goes astray does not; but the strapdown solution, dead reckoning from
//! the same start, is at hand with a covariance that knows every sensor's errors. The two may differ by what both claim to
//! be uncertain of, in any direction of position and velocity together: an error of velocity must have left its trace in
//! position. A difference far beyond that, and lasting, is the filter's fault, for it is the one with a model of the air in it.

use nalgebra::{SMatrix, SVector};

use super::design::STATES;
use crate::link::packet::GivenUpCause;
use crate::math::fun::sqrt;
use crate::math::num::max;
use crate::math::sqrt_tools::{cholesky, solve_lower};
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::bank::BankError;
use crate::nav::estimators::weights::WeightError;
use crate::nav::filter::Uncertainty;
use crate::nav::strapdown::Nominal;
use crate::nav::{MAX_POSITION_SIGMA_M, MAX_VELOCITY_SIGMA_MPS};
use crate::slot::Slot;

/// Distance from dead reckoning, in standard deviations of their difference, that is no accident.
const LIMIT_SIGMAS: f64 = 6.0;
/// Epochs that it must last: one second.
const LASTING_EPOCHS: u16 = 10;

/// Why a filter was given up.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GivenUp {
    /// It could not take a step.
    Failed(EstimatorError),
    /// The experts of its bank are not to be weighed any more.
    NoWeights(WeightError),
    /// Its trajectory left the range of numbers.
    RanAway,
    /// It is uncertain of its position or velocity beyond all use: as many times the largest standard deviation of a valid estimate.
    Lost(f64),
    /// It contradicts dead reckoning by this many standard deviations.
    Contradicted(f64),
}

impl From<EstimatorError> for GivenUp {
    fn from(error: EstimatorError) -> Self {
        Self::Failed(error)
    }
}

impl From<BankError> for GivenUp {
    fn from(error: BankError) -> Self {
        match error {
            BankError::Absent { .. } => Self::NoWeights(WeightError::NoExpert),
            BankError::Weights(error) => Self::NoWeights(error),
            BankError::Expert { error, .. } | BankError::Fused(error) => Self::Failed(error),
        }
    }
}

/// The verdict so far.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    contradicted_epochs: u16,
    given_up: Slot<GivenUp>,
}

impl GivenUp {
    /// What telemetry says of it.
    #[must_use]
    pub const fn cause(&self) -> GivenUpCause {
        match self {
            Self::Failed(_) | Self::NoWeights(_) | Self::RanAway => GivenUpCause::Failed,
            Self::Lost(_) => GivenUpCause::Lost,
            Self::Contradicted(_) => GivenUpCause::Contradicted,
        }
    }
}

impl Watch {
    /// Nothing seen yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { contradicted_epochs: 0, given_up: Slot::Empty }
    }

    /// Why the filter was given up, if it was.
    #[must_use]
    pub fn given_up(&self) -> Option<GivenUp> {
        self.given_up.get().copied()
    }

    fn give_up(&mut self, why: GivenUp) {
        if self.given_up.get().is_none() {
            self.given_up.put(why);
        }
    }

    /// The filter could not take a step.
    pub fn failed(&mut self, why: GivenUp) {
        self.give_up(why);
    }

    /// Its trajectory is no number any more.
    pub fn run_away(&mut self) {
        self.give_up(GivenUp::RanAway);
    }

    /// Compares position and velocity (inertial) with dead reckoning of the same instant.
    pub fn compare(&mut self, state: &[f64; STATES], own: &Uncertainty, strapdown: &Nominal, reckoned: &Uncertainty) {
        let lost = max(
            own.position_sigma_m * (1.0 / MAX_POSITION_SIGMA_M),
            own.velocity_sigma_mps * (1.0 / MAX_VELOCITY_SIGMA_MPS),
        );
        if lost > 1.0 || lost.is_nan() {
            self.give_up(GivenUp::Lost(lost));
        }
        let worst = distance(state, own, strapdown, reckoned);
        let contradicted = worst > LIMIT_SIGMAS;
        self.contradicted_epochs = if contradicted { self.contradicted_epochs.saturating_add(1) } else { 0 };
        if self.contradicted_epochs >= LASTING_EPOCHS {
            self.give_up(GivenUp::Contradicted(worst));
        }
    }
}

/// Mahalanobis distance of two estimates of position and velocity: their difference in standard deviations of it, in the
/// direction where that is most. The covariance of the difference is taken as the sum of both, which is more than it is for
/// two estimates of the same sensors. What is not a number contradicts everything.
#[inline(never)]
fn distance(state: &[f64; STATES], own: &Uncertainty, strapdown: &Nominal, reckoned: &Uncertainty) -> f64 {
    let (mut sum, mut difference) = (SMatrix::<f64, STATES, STATES>::zeros(), SVector::<f64, STATES>::zeros());
    let lower = (0..STATES).flat_map(|i| (0..=i).map(move |j| (i, j)));
    for (place, (own, reckoned)) in lower.zip(own.covariance.iter().zip(&reckoned.covariance)) {
        if let Some(element) = sum.get_mut(place) {
            *element = own + reckoned;
        }
    }
    let other = strapdown.r_i.to_array().into_iter().chain(strapdown.v_i.to_array());
    for (difference, (x, y)) in difference.iter_mut().zip(state.iter().zip(other)) {
        *difference = x - y;
    }
    if cholesky(&mut sum).is_err() {
        return f64::INFINITY;
    }
    solve_lower(&sum, &mut difference);
    let distance = sqrt(difference.iter().map(|x| x * x).sum());
    if distance.is_nan() { f64::INFINITY } else { distance }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Vec3;
    use crate::link::packet::COVARIANCE_ELEMENTS;

    fn within(sigma: f64) -> Uncertainty {
        let mut uncertainty = Uncertainty { covariance: [0.0; COVARIANCE_ELEMENTS], ..Uncertainty::NONE };
        for i in 0..STATES {
            uncertainty.covariance[i * (i + 3) / 2] = sigma * sigma;
        }
        uncertainty
    }

    fn after(epochs: u16, difference: f64) -> Option<GivenUp> {
        let mut watch = Watch::new();
        let strapdown = Nominal { r_i: Vec3::new(3.4e6, 0.0, 0.0), v_i: Vec3::new(0.0, 1e3, 0.0), ..Nominal::none() };
        let state = [3.4e6, 0.0, 0.0, 0.0, 1e3 + difference, 0.0];
        for _ in 0..epochs {
            watch.compare(&state, &within(3.0), &strapdown, &within(4.0));
        }
        watch.given_up()
    }

    #[test]
    fn a_filter_is_given_up_only_for_a_lasting_difference_that_both_cannot_explain() {
        // Together both are uncertain of 5.
        assert_eq!(after(100, 29.9), None);
        assert_eq!(after(LASTING_EPOCHS - 1, 31.0), None);
        assert!(matches!(after(LASTING_EPOCHS, 31.0), Some(GivenUp::Contradicted(r)) if (r - 6.2).abs() < 1e-6));
        assert!(matches!(after(LASTING_EPOCHS, f64::NAN), Some(GivenUp::Contradicted(_))));
    }

    #[test]
    fn a_velocity_that_has_left_no_trace_in_position_is_a_contradiction_in_itself() {
        // Both are uncertain of 600 m and 3 m/s along x, almost wholly of one velocity over 200 s.
        let mut drifting = within(1e-3);
        (drifting.covariance[0], drifting.covariance[6], drifting.covariance[9]) = (3.6e5, 0.999 * 1.8e3, 9.0);
        let strapdown = Nominal { r_i: Vec3::new(3.4e6, 0.0, 0.0), v_i: Vec3::new(1e3, 0.0, 0.0), ..Nominal::none() };
        let apart =
            |x: f64, v: f64| distance(&[3.4e6 + x, 0.0, 0.0, 1e3 + v, 0.0, 0.0], &drifting, &strapdown, &drifting);
        assert!(apart(600.0, 3.0) < 1.0);
        assert!(apart(600.0, -3.0) > 20.0);
        assert!(apart(0.0, 3.0) > 10.0);
    }

    #[test]
    fn covariances_that_are_none_contradict_everything() {
        let strapdown = Nominal { r_i: Vec3::new(3.4e6, 0.0, 0.0), ..Nominal::none() };
        let state = [3.4e6, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert!(distance(&state, &within(1.0), &strapdown, &within(1.0)) < 1e-12);
        assert_eq!(distance(&state, &within(0.0), &strapdown, &within(0.0)), f64::INFINITY);
        assert_eq!(distance(&state, &within(f64::NAN), &strapdown, &within(1.0)), f64::INFINITY);
    }

    #[test]
    fn the_first_reason_stays() {
        let mut watch = Watch::new();
        watch.failed(GivenUp::Failed(EstimatorError::BadVariance(-1.0)));
        watch.run_away();
        assert_eq!(watch.given_up(), Some(GivenUp::Failed(EstimatorError::BadVariance(-1.0))));
    }
}
