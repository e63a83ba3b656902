//! [`Bank`]: filters side by side, each with another idea of the world, and one estimate from all of them (P3).
//!
//! The experts are [`Linear`] filters. In what they differ is their users' to say, by the [`Joint`] that comes with each
//! call: P3's seven EKFs have seven constants as parameters; augmented experts estimate the parameter and differ in where
//! they begin. By which [`Rule`](super::weights::Rule) they are believed is the business of [`Weights`].
//!
//! **An instant** is, for a bank of EKFs as for an interacting multiple model:
//!
//! ```text
//! for each expert i:  mix_expert(i)                 nothing, unless the truth may switch
//!                     predict_expert(i, …)
//!                     correct_expert(i, …)          once for each reading
//! weigh(readings)                                   densities become weights
//! fuse()                                            weights and experts become one estimate
//! ```
//!
//! Any of these may run in another minor frame than the one before it; experts may be worked on in any order.
//!
//! **An expert that fails** (its estimate has run away, or it could not take in what others could) retires: its weight is
//! zero and the others go on. A reading that is no number is refused by all alike and retires nobody. What cannot go on is
//! a [`BankError`] at each call from then on.

use nalgebra::SMatrix;

use super::joint::{Joint, Transition};
use super::linear::{Innovation, Linear};
use super::models::{Measurement, Process, Reading};
use super::weights::{Channels, WeightError, Weights};
use super::{EstimatorError, Part};
use crate::math::factor::add_column;
use crate::math::fun::sqrt;
use crate::math::num;

/// Why a bank did not do what was asked.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BankError {
    /// The expert is not there, or has retired.
    Absent {
        /// Its index.
        expert: u8,
    },
    /// The expert cannot do this. It has retired, unless only the reading was refused.
    Expert {
        /// Its index.
        expert: u8,
        /// Why not.
        error: EstimatorError,
    },
    /// There are no weights.
    Weights(WeightError),
    /// The fused estimate is no number.
    Fused(EstimatorError),
}

impl core::fmt::Display for BankError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Absent { expert } => write!(f, "expert {expert} is not there"),
            Self::Expert { expert, error } => write!(f, "expert {expert}: {error}"),
            Self::Weights(error) => error.fmt(f),
            Self::Fused(error) => write!(f, "fused estimate: {error}"),
        }
    }
}

impl core::error::Error for BankError {}

fn small(index: usize) -> u8 {
    u8::try_from(index).unwrap_or(u8::MAX)
}

/// `K` experts at most, each with a joint state of `J` numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Bank<const J: usize, const K: usize> {
    experts: [Linear<J>; K],
    weights: Weights<K>,
    /// Sum of the logarithms of the densities of this instant's readings.
    log_densities: [f64; K],
    /// How many readings of this instant an expert took in.
    taken: [u16; K],
    fused: Linear<J>,
}

impl<const J: usize, const K: usize> Bank<J, K> {
    /// No experts, all zero bytes: [`Self::start`] makes it a bank in place, for one does not fit onto a small stack.
    pub const NONE: Self = Self {
        experts: [Linear::NONE; K],
        weights: Weights::NONE,
        log_densities: [0.0; K],
        taken: [0; K],
        fused: Linear::NONE,
    };

    /// Experts before their first reading. Those that `weights` does not know are never looked at.
    ///
    /// # Errors
    /// The first estimate is no number.
    pub fn new(experts: [Linear<J>; K], weights: Weights<K>) -> Result<Self, BankError> {
        let first = experts.first().ok_or(BankError::Weights(WeightError::NoExpert))?;
        let fused = first.clone();
        let mut bank = Self { experts, weights, log_densities: [0.0; K], taken: [0; K], fused };
        bank.fuse()?;
        Ok(bank)
    }

    /// Becomes a bank of experts that all begin as `first`; [`Self::replace_expert`] makes them differ.
    pub fn start(&mut self, first: &Linear<J>, weights: Weights<K>) {
        self.experts.iter_mut().for_each(|expert| expert.clone_from(first));
        self.fused.clone_from(first);
        self.weights = weights;
        (self.log_densities, self.taken) = ([0.0; K], [0; K]);
    }

    /// The fused estimate, as [`Self::fuse`] made it last.
    #[must_use]
    pub const fn fused(&self) -> &Linear<J> {
        &self.fused
    }

    /// How much each expert is believed.
    #[must_use]
    pub const fn weights(&self) -> &Weights<K> {
        &self.weights
    }

    /// Logarithms of the densities with which the experts expected this instant's readings so far.
    #[must_use]
    pub const fn log_densities(&self) -> &[f64; K] {
        &self.log_densities
    }

    /// An expert that is there.
    #[must_use]
    pub fn expert(&self, index: usize) -> Option<&Linear<J>> {
        self.experts.get(index).filter(|_| self.weights.is_present(index))
    }

    /// Puts a filter in an expert's place, its readings of this instant forgotten.
    ///
    /// # Errors
    /// The expert is not there.
    pub fn replace_expert(&mut self, index: usize, by: &Linear<J>) -> Result<(), BankError> {
        self.present(index)?.clone_from(by);
        if let Some((sum, taken)) = self.log_densities.get_mut(index).zip(self.taken.get_mut(index)) {
            (*sum, *taken) = (0.0, 0);
        }
        Ok(())
    }

    /// An expert's share of what the truth may have switched to, before its prediction (interacting multiple model; other
    /// rules change nothing). Relies on [`Self::fused`] being of the last instant.
    ///
    /// # Errors
    /// The expert is not there, or the mixture is no number.
    #[inline(never)]
    pub fn mix_expert(&mut self, index: usize) -> Result<(), BankError> {
        let keep = self.weights.kept(index);
        if keep >= 1.0 {
            return self.present(index).map(|_| ());
        }
        let other = self.fused.clone();
        let expert = self.present(index)?;
        let mut difference = *expert.state();
        difference.iter_mut().zip(other.state()).for_each(|(x, y)| *x -= y);
        let mut state = *other.state();
        state.iter_mut().zip(&difference).for_each(|(x, d)| *x += keep * d);
        let outcome = expert.renew(state, |factor| {
            *factor *= sqrt(keep);
            add_covariance(factor, other.factor(), sqrt(1.0 - keep));
            let spread = sqrt(keep * (1.0 - keep));
            add_column(factor, &difference.map(|d| spread * d));
        });
        self.settle(index, outcome)
    }

    /// One step of an expert's model, then noise of these standard deviations; see [`Linear::predict`].
    ///
    /// # Errors
    /// The expert is not there, or it fails and retires.
    pub fn predict_expert<M: Process<N, P>, const N: usize, const P: usize, const W: usize>(
        &mut self,
        index: usize,
        joint: &Joint<'_, M, N, P, W>,
        step_s: f64,
        sigmas: &[f64; J],
    ) -> Result<(), BankError> {
        let outcome = self.present(index)?.predict(joint, step_s, sigmas);
        self.settle(index, outcome)
    }

    /// The same for a step that was found elsewhere, or could not be; see [`Linear::advance`].
    ///
    /// # Errors
    /// As [`Self::predict_expert`].
    pub fn advance_expert<const N: usize>(
        &mut self,
        index: usize,
        step: Result<Transition<N, J>, EstimatorError>,
        sigmas: &[f64; J],
    ) -> Result<(), BankError> {
        let expert = self.present(index)?;
        let outcome = step.and_then(|step| expert.advance(&step, sigmas));
        self.settle(index, outcome)
    }

    /// An expert takes in a reading of the predicted instant; see [`Linear::correct`]. For its weight, a reading beyond the
    /// gate counts as one at the gate.
    ///
    /// # Errors
    /// The expert is not there; or it refuses the reading, and nothing has changed; or it fails and retires.
    pub fn correct_expert<M, Z, const N: usize, const P: usize, const W: usize>(
        &mut self,
        index: usize,
        joint: &Joint<'_, M, N, P, W>,
        reading: &Reading<Z>,
        gate_sigma: f64,
    ) -> Result<Innovation, BankError>
    where
        M: Process<N, P>,
        Z: Measurement<N, P>,
    {
        let outcome = self.present(index)?.correct(joint, reading, gate_sigma);
        self.count(index, outcome, gate_sigma)
    }

    /// The same for a reading that is already linearised; see [`Linear::absorb`].
    ///
    /// # Errors
    /// As [`Self::correct_expert`].
    pub fn absorb_expert(
        &mut self,
        index: usize,
        innovation: f64,
        row: &[f64; J],
        noise: f64,
        gate_sigma: f64,
    ) -> Result<Innovation, BankError> {
        let outcome = self.present(index)?.absorb(innovation, row, noise, gate_sigma);
        self.count(index, outcome, gate_sigma)
    }

    /// Makes weights of the densities of this instant's readings; `channels` are the readings as a gating network is to see
    /// them (other rules do not look). An expert that took in fewer readings than another retires: its density would be
    /// one of something else.
    ///
    /// # Errors
    /// There are no weights any more.
    #[inline(never)]
    pub fn weigh(&mut self, channels: &Channels) -> Result<(), BankError> {
        let most = (0..K)
            .zip(&self.taken)
            .filter(|(i, _)| self.weights.is_present(*i))
            .map(|(_, taken)| *taken)
            .fold(0, core::cmp::Ord::max);
        for (index, taken) in self.taken.iter().enumerate() {
            if self.weights.is_present(index) && *taken < most {
                self.weights.retire(index);
            }
        }
        let outcome = if most == 0 { Ok(()) } else { self.weights.update(&self.log_densities, channels) };
        self.log_densities = [0.0; K];
        self.taken = [0; K];
        outcome.map_err(BankError::Weights)
    }

    /// Mean and covariance over all experts, P3 eqs. 15–16: x̂ = Σ wᵢ xᵢ, P = Σ wᵢ (Pᵢ + (xᵢ − x̂)(xᵢ − x̂)ᵀ).
    ///
    /// # Errors
    /// There are no weights: [`Self::fused`] keeps the last estimate. Or it is no number: its covariance says so.
    #[inline(never)]
    pub fn fuse(&mut self) -> Result<&Linear<J>, BankError> {
        if let Some(failure) = self.weights.failure() {
            return Err(BankError::Weights(failure));
        }
        let weights = *self.weights.values();
        self.fuse_by(&weights)
    }

    /// The same by weights of another's making, which sum to one; what [`Self::fused`] gives from here on.
    ///
    /// # Errors
    /// The result is no number: its covariance says so.
    pub fn fuse_by(&mut self, weights: &[f64; K]) -> Result<&Linear<J>, BankError> {
        let Self { experts, fused, .. } = self;
        let believed = || experts.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
        let mut mean = [0.0; J];
        for (expert, weight) in believed() {
            mean.iter_mut().zip(expert.state()).for_each(|(m, x)| *m += weight * x);
        }
        let outcome = fused.renew(mean, |factor| {
            factor.fill(0.0);
            for (expert, weight) in believed() {
                let root = sqrt(*weight);
                add_covariance(factor, expert.factor(), root);
                let mut offset = mean;
                offset.iter_mut().zip(expert.state()).for_each(|(m, x)| *m = root * (x - *m));
                add_column(factor, &offset);
            }
        });
        outcome.map_err(BankError::Fused)?;
        Ok(&self.fused)
    }

    fn present(&mut self, index: usize) -> Result<&mut Linear<J>, BankError> {
        let is_there = self.weights.is_present(index);
        self.experts.get_mut(index).filter(|_| is_there).ok_or(BankError::Absent { expert: small(index) })
    }

    /// An expert that has failed retires.
    fn settle<T>(&mut self, index: usize, outcome: Result<T, EstimatorError>) -> Result<T, BankError> {
        outcome.map_err(|error| {
            let is_refusal = matches!(
                error,
                EstimatorError::NotFinite { part: Part::Measurement, .. } | EstimatorError::BadVariance(_)
            );
            if !is_refusal {
                self.weights.retire(index);
            }
            BankError::Expert { expert: small(index), error }
        })
    }

    fn count(
        &mut self,
        index: usize,
        outcome: Result<Innovation, EstimatorError>,
        gate_sigma: f64,
    ) -> Result<Innovation, BankError> {
        let innovation = self.settle(index, outcome)?;
        let limit = gate_sigma * sqrt(innovation.variance);
        let told = Innovation { value: num::min(num::abs(innovation.value), limit), ..innovation };
        if let Some((sum, taken)) = self.log_densities.get_mut(index).zip(self.taken.get_mut(index)) {
            *sum += told.log_density();
            *taken = taken.saturating_add(1);
        }
        Ok(innovation)
    }
}

/// Factor of L·Lᵀ + (scale·M)(scale·M)ᵀ.
fn add_covariance<const J: usize>(factor: &mut SMatrix<f64, J, J>, other: &SMatrix<f64, J, J>, scale: f64) {
    for column in other.column_iter() {
        let mut v = [0.0; J];
        v.iter_mut().zip(column.iter()).for_each(|(v, x)| *v = scale * x);
        add_column(factor, &v);
    }
}

#[cfg(test)]
#[path = "bank_tests.rs"]
mod tests;
