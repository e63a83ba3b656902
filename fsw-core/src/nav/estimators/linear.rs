//! [`Linear`]: the one linearised kernel. Square-root form: predict by triangularization, correct by scalar updates whose
//! gain is, component by component, optimal, tied to another component's, or none.
//!
//! | filter | joint state | gains |
//! |---|---|---|
//! | EKF | x | all [`Gain::Optimal`] |
//! | SEKF, SEKF-ρ (P1 in its joint form) | x, d | d: [`Gain::Tied`] to its state by 1 or ρ; [`Linear::forget`] d before the start |
//! | augmented EKF | x, b, α, bias in any selection | all [`Gain::Optimal`] |
//! | Schmidt's filter (Schmidt 1966) | x, b or α | b, α: [`Gain::Considered`] |
//!
//! **Why any gain keeps the covariance sound.** With u = P·h, s = hᵀu + R and any gain g, the covariance after the update is
//! (I − g hᵀ) P (I − g hᵀ)ᵀ + g R gᵀ = (P − u uᵀ/s) + s (g − u/s)(g − u/s)ᵀ: Joseph's form is the optimal update plus a
//! square. The factor takes both without a subtraction of covariances.
//!
//! **Scalar by scalar is the batch.** Measurements of one instant are all linearised about the prediction, and their noises
//! are independent, so that one after the other they give the batch update: for optimal and tied gains exactly, for
//! considered components as long as no measurement of the batch depends on them directly; where one does, the result is
//! consistent but (slightly) not the batch's minimum.

use nalgebra::SMatrix;

use super::joint::{Joint, Transition};
use super::models::{Measurement, Process, Reading};
use super::{EstimatorError, Part, finite};
use crate::math::factor::{add_column, reduce, whitened};
use crate::math::fun::{ln, sqrt};
use crate::math::gate::sigma_gate;
use crate::math::sqrt_tools::tria;

/// Standard deviation, in any unit, of what is not known at all: beyond all physics, and its square is still a number.
pub const UNKNOWN: f64 = 1e150;

/// How a component of the joint state is corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gain {
    /// By the gain of least variance.
    Optimal,
    /// By `factor` times the gain of component `to`, which must be optimal.
    Tied {
        /// That component.
        to: usize,
        /// ρ: 1 in the SEKF of P1, 0 in an EKF.
        factor: f64,
    },
    /// Not at all; its uncertainty counts, and stays.
    Considered,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// Read minus expected, given the prediction and the measurements of the instant that were taken in before.
    pub value: f64,
    /// Its variance as the filter believes.
    pub variance: f64,
    /// False when it lay beyond the gate and corrected nothing.
    pub used: bool,
}

impl Innovation {
    /// Natural logarithm of the probability density of this value; the densities of all measurements of an instant
    /// multiply to that of the batch.
    #[must_use]
    pub fn log_density(&self) -> f64 {
        -0.5 * (self.value * self.value / self.variance + ln(2.0 * core::f64::consts::PI * self.variance))
    }
}

/// A linearised filter: joint state and covariance. `J` numbers; everything in place, nothing allocated.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear<const J: usize> {
    state: [f64; J],
    /// The state about which measurements of this instant are linearised.
    anchor: [f64; J],
    factor: SMatrix<f64, J, J>,
    gains: [Gain; J],
}

impl<const J: usize> Linear<J> {
    /// Nothing, all zero bytes: stands where no filter has begun yet.
    pub const NONE: Self = Self {
        state: [0.0; J],
        anchor: [0.0; J],
        factor: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; J]; J])),
        gains: [Gain::Optimal; J],
    };

    /// A filter that knows `state` to within `sigmas`, uncorrelated; zero is known exactly.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn new(state: [f64; J], sigmas: &[f64; J], gains: [Gain; J]) -> Result<Self, EstimatorError> {
        finite(Part::Start, &state)?;
        finite(Part::Start, sigmas)?;
        let mut factor = SMatrix::<f64, J, J>::zeros();
        for (i, sigma) in sigmas.iter().enumerate() {
            if let Some(diagonal) = factor.get_mut((i, i)) {
                *diagonal = crate::math::num::abs(*sigma);
            }
        }
        Ok(Self { state, anchor: state, factor, gains })
    }

    /// The estimate.
    #[must_use]
    pub const fn state(&self) -> &[f64; J] {
        &self.state
    }

    /// Lower triangular L with covariance L·Lᵀ.
    #[must_use]
    pub const fn factor(&self) -> &SMatrix<f64, J, J> {
        &self.factor
    }

    /// Covariance of two components; zero beyond the joint state.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        (0..J).map(|k| self.element(i, k) * self.element(j, k)).sum()
    }

    /// Standard deviation of a component.
    #[must_use]
    pub fn sigma(&self, i: usize) -> f64 {
        sqrt(self.covariance(i, i))
    }

    fn element(&self, i: usize, j: usize) -> f64 {
        self.factor.get((i, j)).copied().unwrap_or(0.0)
    }

    /// Sets `count` components from `first` on to exactly zero. SEKF before its start: its d is not yet at work.
    pub fn forget(&mut self, first: usize, count: usize) {
        for i in (0..J).skip(first).take(count) {
            for j in 0..J {
                if let Some(element) = self.factor.get_mut((i, j)) {
                    *element = 0.0;
                }
            }
        }
        for whole in [&mut self.state, &mut self.anchor] {
            whole.iter_mut().skip(first).take(count).for_each(|x| *x = 0.0);
        }
    }

    /// Carries state and covariance over a step (without process noise).
    ///
    /// # Errors
    /// The covariance leaves the range of numbers. The state is as before; its covariance says that nothing is known
    /// ([`UNKNOWN`]).
    #[inline(never)]
    pub fn transport<const N: usize>(&mut self, step: &Transition<N, J>) -> Result<(), EstimatorError> {
        for column in 0..J {
            let before: [f64; J] = core::array::from_fn(|i| self.element(i, column));
            // The factor is lower triangular: above the diagonal there is nothing to carry.
            let below = before.get(column..).unwrap_or_default();
            for (i, (&old, &persistence)) in before.iter().zip(&step.persistence).enumerate() {
                let after = match step.rows.get(i) {
                    Some(row) => row.iter().skip(column).zip(below).map(|(phi, l)| phi * l).sum(),
                    None => persistence * old,
                };
                if let Some(element) = self.factor.get_mut((i, column)) {
                    *element = after;
                }
            }
        }
        tria(&mut self.factor);
        self.check_factor()?;
        self.state = step.next;
        self.anchor = step.next;
        Ok(())
    }

    /// Adds process noise that drives all components in proportion: covariance + column·columnᵀ.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn add_noise(&mut self, column: &[f64; J]) -> Result<(), EstimatorError> {
        finite(Part::ProcessNoise, column)?;
        add_column(&mut self.factor, column);
        self.check_factor()
    }

    /// Another state, and its factor changed: how a bank makes mixtures.
    ///
    /// # Errors
    /// A number that is not finite: the state is as before then; a covariance that is none says so.
    pub(super) fn renew(
        &mut self,
        state: [f64; J],
        change: impl FnOnce(&mut SMatrix<f64, J, J>),
    ) -> Result<(), EstimatorError> {
        finite(Part::Estimate, &state)?;
        change(&mut self.factor);
        self.check_factor()?;
        self.state = state;
        self.anchor = state;
        Ok(())
    }

    /// A covariance that is no number any more becomes one that claims nothing.
    fn check_factor(&mut self) -> Result<(), EstimatorError> {
        let checked = finite(Part::Covariance, self.factor.as_slice());
        if checked.is_err() {
            self.factor = SMatrix::from_diagonal_element(UNKNOWN);
        }
        checked
    }

    /// Adds process noise that is independent in every component, given its standard deviations over the step.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn add_independent_noise(&mut self, sigmas: &[f64; J]) -> Result<(), EstimatorError> {
        finite(Part::ProcessNoise, sigmas)?;
        for (i, &sigma) in sigmas.iter().enumerate().filter(|(_, sigma)| **sigma != 0.0) {
            let mut column = [0.0; J];
            column.iter_mut().skip(i).take(1).for_each(|c| *c = sigma);
            add_column(&mut self.factor, &column);
        }
        self.check_factor()
    }

    /// One step of the model, then noise of these standard deviations.
    ///
    /// # Errors
    /// The model has no finite value here: nothing has changed then. Or as in [`Self::transport`].
    pub fn predict<M: Process<N, P>, const N: usize, const P: usize, const W: usize>(
        &mut self,
        joint: &Joint<'_, M, N, P, W>,
        step_s: f64,
        sigmas: &[f64; J],
    ) -> Result<(), EstimatorError> {
        let step = joint.step(&self.state, step_s)?;
        self.advance(&step, sigmas)
    }

    /// A step with its derivatives, then noise of these standard deviations.
    ///
    /// # Errors
    /// As [`Self::transport`].
    pub fn advance<const N: usize>(
        &mut self,
        step: &Transition<N, J>,
        sigmas: &[f64; J],
    ) -> Result<(), EstimatorError> {
        self.transport(step)?;
        self.add_independent_noise(sigmas)
    }

    /// The state about which readings of this instant are linearised: that of the last prediction.
    #[must_use]
    pub const fn anchor(&self) -> &[f64; J] {
        &self.anchor
    }

    /// Takes in a reading of the predicted instant; beyond `gate_sigma` deviations (infinite: no gate) it corrects nothing.
    ///
    /// # Errors
    /// The measurement has no finite value here, or its variance is not positive: nothing has changed then. Or as in
    /// [`Self::absorb`].
    pub fn correct<M, Z, const N: usize, const P: usize, const W: usize>(
        &mut self,
        joint: &Joint<'_, M, N, P, W>,
        reading: &Reading<Z>,
        gate_sigma: f64,
    ) -> Result<Innovation, EstimatorError>
    where
        M: Process<N, P>,
        Z: Measurement<N, P>,
    {
        let seen = joint.see(&reading.sensor, &self.anchor)?;
        let innovation = reading.sensor.innovation(reading.value, seen.expected);
        self.absorb(innovation, &seen.row, reading.sensor.variance(seen.expected), gate_sigma)
    }

    /// The update itself: `innovation` and its derivatives `row` are those at the prediction, `noise` is the variance of
    /// the measurement.
    ///
    /// # Errors
    /// A number that is not finite, or a variance that is not positive: nothing has changed then. If the corrected estimate
    /// or covariance leaves the range of numbers, the state is as before and the covariance says so.
    #[inline(never)]
    pub fn absorb(
        &mut self,
        innovation: f64,
        row: &[f64; J],
        noise: f64,
        gate_sigma: f64,
    ) -> Result<Innovation, EstimatorError> {
        finite(Part::Measurement, row)?;
        finite(Part::Measurement, &[innovation])?;
        let f = whitened(&self.factor, row);
        let variance = noise + f.iter().map(|f| f * f).sum::<f64>();
        if !(noise > 0.0 && variance.is_finite()) {
            return Err(EstimatorError::BadVariance(if noise > 0.0 { variance } else { noise }));
        }
        // What the measurements before have corrected since the prediction.
        let corrected: f64 = row.iter().zip(self.state.iter().zip(&self.anchor)).map(|(h, (x, a))| h * (x - a)).sum();
        let value = innovation - corrected;
        let used = sigma_gate(value, variance, gate_sigma).accepted;
        let told = Innovation { value, variance, used };
        if !used {
            return Ok(told);
        }
        let gain = self.gain_and_reduce(&f, noise, variance);
        let mut state = self.state;
        state.iter_mut().zip(&gain).for_each(|(x, g)| *x += g * value);
        self.check_factor()?;
        finite(Part::Estimate, &state)?;
        self.state = state;
        Ok(told)
    }

    /// Takes the measurement into the covariance; gives the gain.
    fn gain_and_reduce(&mut self, f: &[f64; J], noise: f64, variance: f64) -> [f64; J] {
        let optimal = reduce(&mut self.factor, f, noise).map(|u| u / variance);
        let mut gain = optimal;
        let mut excess = [0.0; J];
        let root = sqrt(variance);
        let components = gain.iter_mut().zip(&mut excess).zip(self.gains.iter().zip(&optimal));
        for ((gain, excess), (rule, &best)) in components {
            *gain = match *rule {
                Gain::Optimal => best,
                Gain::Tied { to, factor } => factor * optimal.get(to).copied().unwrap_or(0.0),
                Gain::Considered => 0.0,
            };
            *excess = root * (*gain - best);
        }
        add_column(&mut self.factor, &excess);
        gain
    }
}

#[cfg(test)]
#[path = "linear_tests.rs"]
mod tests;
