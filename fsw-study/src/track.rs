//! What a filter did in one run.

use alloc::vec::Vec;

use fsw_core::nav::estimators::EstimatorError;
use nalgebra::SMatrix;

use crate::consistency::{is_indefinite, is_indefinite_factor, nees, nees_of_covariance};

/// Errors of a run, step by step; `N` components of the vehicle's state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Track<const N: usize> {
    /// Estimate less truth after each step; ends where the filter failed.
    pub errors: Vec<[f64; N]>,
    /// Distance of the estimated position from the true one, m.
    pub position_m: Vec<f64>,
    /// Normalised estimation error squared.
    pub nees: Vec<f64>,
    /// Steps with an indefinite covariance.
    pub indefinite: u64,
    /// Why it stopped, if it did.
    pub failure: Option<EstimatorError>,
}

/// How closely a flight is watched: judging can cost more than the filter itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// Errors, consistency and definiteness.
    All,
    /// Errors of the states alone.
    Errors,
    /// Nothing: the filter is timed.
    Nothing,
}

impl<const N: usize> Track<N> {
    /// Takes down a step: what was estimated, what was true, their distance, and the lower triangular factor of the joint
    /// covariance whose first `N` components are the state's. Under [`Watch::Errors`] only the errors, under
    /// [`Watch::Nothing`] nothing.
    pub fn note<const J: usize>(
        &mut self,
        watch: Watch,
        pair: (&[f64; N], &[f64; N]),
        distance_m: impl FnOnce() -> f64,
        factor: impl FnOnce() -> SMatrix<f64, J, J>,
    ) {
        self.judge(watch, pair, distance_m, |error| {
            let factor = factor();
            (nees(error, &factor), is_indefinite_factor(&factor))
        });
    }

    /// [`Self::note`] for a filter that keeps the covariance itself. Where it is not positive definite, there is no
    /// normalised error: not a number.
    pub fn note_covariance(
        &mut self,
        watch: Watch,
        pair: (&[f64; N], &[f64; N]),
        distance_m: impl FnOnce() -> f64,
        covariance: &SMatrix<f64, N, N>,
    ) {
        self.judge(watch, pair, distance_m, |error| {
            (nees_of_covariance(error, covariance).unwrap_or(f64::NAN), is_indefinite(covariance))
        });
    }

    fn judge(
        &mut self,
        watch: Watch,
        (estimate, truth): (&[f64; N], &[f64; N]),
        distance_m: impl FnOnce() -> f64,
        consistency: impl FnOnce(&[f64; N]) -> (f64, bool),
    ) {
        if watch == Watch::Nothing {
            return;
        }
        let mut error = *estimate;
        error.iter_mut().zip(truth).for_each(|(e, x)| *e -= x);
        self.errors.push(error);
        if watch == Watch::Errors {
            return;
        }
        let (nees, is_indefinite) = consistency(&error);
        self.position_m.push(distance_m());
        self.nees.push(nees);
        self.indefinite += u64::from(is_indefinite);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_watched_is_taken_down() {
        let noted = |watch| {
            let mut track = Track::<2>::default();
            let factor = || SMatrix::<f64, 3, 3>::identity() * 2.0;
            track.note(watch, (&[3.0, 1.0], &[1.0, 1.0]), || 2.0, factor);
            (track.errors, track.position_m, track.nees, track.indefinite)
        };
        assert_eq!(noted(Watch::All), (vec![[2.0, 0.0]], vec![2.0], vec![1.0], 0));
        assert_eq!(noted(Watch::Errors), (vec![[2.0, 0.0]], vec![], vec![], 0));
        assert_eq!(noted(Watch::Nothing), (vec![], vec![], vec![], 0));
    }

    #[test]
    fn a_covariance_that_is_none_has_no_normalised_error() {
        let mut track = Track::<2>::default();
        track.note_covariance(Watch::All, (&[3.0, 1.0], &[1.0, 1.0]), || 2.0, &(SMatrix::identity() * 4.0));
        track.note_covariance(Watch::All, (&[3.0, 1.0], &[1.0, 1.0]), || 2.0, &-SMatrix::identity());
        assert!((track.nees[0] - 1.0).abs() < 1e-15 && track.nees[1].is_nan());
        assert_eq!(track.indefinite, 1);
    }
}
