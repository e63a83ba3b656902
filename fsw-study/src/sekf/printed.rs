//! The SEKF as P1 prints it: prediction (11), covariance (12) with (16), update (14), started by (19), S₁ = P₁; and the same
//! with the exact start. Not shipped: (19) is not the covariance it stands for, and behind the exact start the asymmetry that
//! rounding leaves in the covariance grows by many decades where little is observed. What is true of these equations is flown
//! as the joint form, see `doc/equations.md` E9.
//!
//! Readings of an instant are taken one after the other about the same prediction, which is their batch.

use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::{Joint, Layout};
use fsw_core::nav::estimators::models::{Measurement, Spherical};
use nalgebra::{SMatrix, SVector};

use super::STATES;
use super::config::Settings;
use super::draw::Draw;
use super::filters::{PARAMETERS, Setup, distance_m};
use crate::track::{Track, Watch};

/// First step (from 1) that has all that (16) needs.
const EARLIEST_START: usize = 3;

type Matrix = SMatrix<f64, STATES, STATES>;
type Vector = SVector<f64, STATES>;
type Model<'a> = Joint<'a, Spherical, STATES, PARAMETERS, STATES>;

/// What the recursion keeps; k − 1 is the last step.
struct Recursion {
    /// x at k − 1.
    state: Vector,
    /// F(x) at k − 2.
    carried: Vector,
    /// P at k − 1 and k − 2.
    covariance: [Matrix; 2],
    /// Φ at k − 2 and k − 3.
    transition: [Matrix; 2],
    /// I − K H at k − 1 and k − 2.
    kept: [Matrix; 2],
    /// S at k − 1, once there is one.
    cross: Option<Matrix>,
    /// Q of every step.
    noise: Matrix,
    /// How S begins.
    start: Start,
}

/// How S begins, when self-calibration does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// (19): S₁ = P₁.
    Printed,
    /// S₂ = A₂Φ₁P₁, what it is after steps of an EKF.
    Exact,
}

/// Flies it over a draw.
pub(super) fn fly(setup: &Setup<'_>, start: Start, settings: &Settings, draw: &Draw, watch: Watch) -> Track<STATES> {
    let mut track = Track::default();
    track.failure = steps(setup, start, settings, draw, |state, covariance, truth| {
        track.note_covariance(watch, (state, truth), || distance_m(state, truth), covariance);
    })
    .err();
    track
}

fn steps(
    setup: &Setup<'_>,
    start: Start,
    settings: &Settings,
    draw: &Draw,
    mut note: impl FnMut(&[f64; STATES], &Matrix, &[f64; STATES]),
) -> Result<(), EstimatorError> {
    let model = Model { model: &setup.model, parameters: [0.0; PARAMETERS], layout: Layout::default() };
    let square = |sigmas: [f64; STATES]| Matrix::from_diagonal(&Vector::from(sigmas.map(|sigma| sigma * sigma)));
    let state = Vector::from(setup.config.initial.state());
    let mut recursion = Recursion {
        state,
        carried: state,
        covariance: [square(setup.start_sigmas()); 2],
        transition: [Matrix::identity(); 2],
        kept: [Matrix::identity(); 2],
        cross: None,
        noise: square(setup.process_sigmas(settings)),
        start,
    };
    let from = setup.config.filters.sekf_start_step.max(EARLIEST_START);
    for (index, (truth, readings)) in draw.truth.iter().zip(&draw.readings).enumerate() {
        let bias = setup.config.filters.bias_sigma_mps2;
        let sensors = setup.sensors(index, settings, bias).zip(readings.iter().copied());
        recursion.predict(&model, setup.config.experiment.step_s, index + 1 >= from)?;
        let corrected = recursion.correct(&model, sensors);
        // A step that fails is taken down too: it fails because its covariance is none.
        note(recursion.state.as_ref(), &recursion.covariance[0], truth);
        corrected?;
    }
    Ok(())
}

impl Recursion {
    /// To the instant before the update; the ordinary EKF until `is_calibrating`.
    fn predict(&mut self, model: &Model<'_>, step_s: f64, is_calibrating: bool) -> Result<(), EstimatorError> {
        let step = model.step::<STATES>(self.state.as_ref(), step_s)?;
        let carried = Vector::from(step.next);
        let transition = Matrix::from_fn(|i, j| step.rows[i][j]);
        let [last, before] = self.covariance;
        let q = self.noise;
        let (state, predicted) = if is_calibrating {
            let [phi, phi_before] = self.transition;
            let [kept, kept_before] = self.kept;
            // (16), given S of the step before.
            let next = |s: &Matrix| {
                kept * ((Matrix::identity() + phi) * before - phi_before * s.transpose() - q * kept_before.transpose())
            };
            let cross = match (&self.cross, self.start) {
                (Some(cross), _) => next(cross),
                (None, Start::Printed) => next(&before),
                (None, Start::Exact) => kept * phi * before,
            };
            self.cross = Some(cross);
            let through = Matrix::identity() + transition;
            let x = through * cross * phi.transpose();
            let y = through * kept * q;
            let own = through * last * through.transpose() + phi * before * phi.transpose();
            (carried + self.state - self.carried, own - x - x.transpose() - y - y.transpose() + q + q)
        } else {
            (carried, transition * last * transition.transpose() + q)
        };
        (self.state, self.carried) = (state, carried);
        self.covariance = [predicted, last];
        self.transition = [transition, self.transition[0]];
        self.kept = [Matrix::identity(), self.kept[0]];
        Ok(())
    }

    /// (14): the readings of the instant, all linearised about the prediction.
    fn correct<Z: Measurement<STATES, PARAMETERS>>(
        &mut self,
        model: &Model<'_>,
        readings: impl Iterator<Item = (Z, f64)>,
    ) -> Result<(), EstimatorError> {
        let anchor = self.state;
        for (sensor, value) in readings {
            let seen = model.see(&sensor, anchor.as_ref())?;
            let row = Vector::from(seen.row);
            let noise = sensor.variance(seen.expected);
            let column = self.covariance[0] * row;
            let variance = row.dot(&column) + noise;
            if variance.is_nan() || variance <= 0.0 {
                return Err(EstimatorError::BadVariance(variance));
            }
            let gain = column / variance;
            let innovation = sensor.innovation(value, seen.expected) - row.dot(&(self.state - anchor));
            self.state += gain * innovation;
            let keep = Matrix::identity() - gain * row.transpose();
            self.covariance[0] = keep * self.covariance[0];
            self.kept[0] = keep * self.kept[0];
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::Config;
    use super::super::draw::Suite;
    use super::super::kind::Kind;
    use super::*;

    #[test]
    fn behind_the_exact_start_it_is_the_joint_form_but_for_rounding_and_behind_the_printed_one_it_has_no_covariance() {
        let config = Config::default();
        let suite = Suite::new(&config, 1.0);
        let draw = Draw::new(&config, &suite, 5, 0);
        let setup = Setup { config: &config, suite: &suite, model: config.truth.model(50.0) };
        let [ekf, joint, printed, exact] = [Kind::Ekf, Kind::Sekf, Kind::SekfPrinted, Kind::SekfUnfactored]
            .map(|kind| setup.fly(kind, &Settings::default(), &draw, Watch::All));
        let differs =
            |a: &Track<STATES>, b: &Track<STATES>, step: usize| (a.position_m[step] - b.position_m[step]).abs();
        // Two ways to compute the same update: rounding of states of 3e6 m, which grows 1.3 times in a step.
        for step in 0..2 {
            assert!(differs(&ekf, &printed, step) < 1e-4 && differs(&ekf, &exact, step) < 1e-4, "step {step}");
        }
        for step in 2..20 {
            assert!(differs(&joint, &exact, step) < 1e-2, "step {step}: {}", differs(&joint, &exact, step));
        }
        let latest = (100..200).map(|step| differs(&joint, &exact, step)).fold(0.0, f64::max);
        // One flight differs from another by the metres that asymmetry has grown to.
        assert!(latest > 0.1, "{latest}");
        assert!(joint.indefinite == 0 && joint.failure.is_none());
        assert!(printed.indefinite > 0 && printed.failure.is_some() && printed.errors.len() < 10);
    }
}
