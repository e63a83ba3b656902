//! [`Least`]: Cramér–Rao bounds over time, averaged over true flights as the filters' errors are over runs.

use fsw_core::nav::estimators::EstimatorError;

use crate::runs;
use crate::tally::{mean_from, means_from};

/// True flights that are averaged: they hardly differ.
pub const FLIGHTS: u64 = 20;

/// Least variances along a flight, step by step: of the states, and of the position, m².
pub type Variances<const N: usize> = Vec<([f64; N], f64)>;

/// Least root mean square errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Least<const N: usize> {
    /// Of each state, averaged over time as the filters' are.
    pub rmse: [f64; N],
    /// The same of the position, m.
    pub position_rmse_m: f64,
    /// Of each state after each step.
    pub history: Vec<[f64; N]>,
}

impl<const N: usize> Least<N> {
    /// Of the first [`FLIGHTS`] of so many runs, with so many steps each; means over time are from step `from` on.
    ///
    /// # Errors
    /// That of the first flight along which the model has no value.
    pub fn over(
        runs: u64,
        (steps, from): (usize, usize),
        along: impl Fn(u64) -> Result<Variances<N>, EstimatorError> + Sync,
    ) -> Result<Self, EstimatorError> {
        let flights = runs::collect(runs.min(FLIGHTS), along);
        let mut sums: Variances<N> = vec![([0.0; N], 0.0); steps];
        let count = flights.len() as f64;
        for flight in flights {
            for ((states, position), (variances, place)) in sums.iter_mut().zip(flight?) {
                states.iter_mut().zip(variances).for_each(|(sum, variance)| *sum += variance / count);
                *position += place / count;
            }
        }
        let history: Vec<[f64; N]> = sums.iter().map(|(states, _)| states.map(f64::sqrt)).collect();
        let position: Vec<f64> = sums.iter().map(|(_, position)| position.sqrt()).collect();
        Ok(Self { rmse: means_from(&history, from), position_rmse_m: mean_from(&position, from), history })
    }
}

/// Variance of the place, m², in spherical states r, v, γ, θ, λ, ψ: radius, longitude and latitude stand on each other at
/// right angles.
#[must_use]
pub fn position_variance(&[r, _, _, _, latitude, _]: &[f64; 6], variance: impl Fn(usize) -> f64) -> f64 {
    let east = r * latitude.cos();
    variance(0) + east * east * variance(3) + r * r * variance(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variances_are_averaged_over_flights_and_roots_over_time() {
        let along = |run: u64| Ok(vec![([9.0], 1.0), ([(1 + 6 * run) as f64], 4.0), ([9.0], 16.0)]);
        let least = Least::over(2, (3, 1), along).unwrap();
        assert_eq!(least.history, [[3.0], [2.0], [3.0]]);
        assert_eq!((least.rmse, least.position_rmse_m), ([2.5], 3.0));
    }

    #[test]
    fn a_degree_of_longitude_is_shorter_at_higher_latitude() {
        let at = |latitude: f64| position_variance(&[2.0, 0.0, 0.0, 0.0, latitude, 0.0], |i| f64::from(i == 3));
        assert!((at(0.0) - 4.0).abs() < 1e-15 && (at(std::f64::consts::FRAC_PI_3) - 1.0).abs() < 1e-15);
    }
}
