//! What a filter did in all runs of a case: root mean squares over runs for each step, then means over time.

use crate::track::Track;

/// Sums over runs, step by step.
#[derive(Clone, Debug, PartialEq)]
pub struct Tally<const N: usize> {
    squares: Vec<[f64; N]>,
    position: Vec<f64>,
    nees: Vec<f64>,
    /// Runs that came as far as the step: with errors, and with the rest.
    count: Vec<(u64, u64)>,
    indefinite: u64,
    /// Runs with a position error beyond the bound, or stopped by an error.
    pub diverged: u64,
    /// Runs stopped by an error.
    pub failed: u64,
    /// Runs.
    pub runs: u64,
}

/// When a run counts as diverged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// First step (from 0) that counts: after the pull-in.
    pub from_step: usize,
    /// Position error beyond it, m.
    pub beyond_m: f64,
}

impl<const N: usize> Tally<N> {
    /// Nothing yet of flights of so many steps.
    #[must_use]
    pub fn new(steps: usize) -> Self {
        Self {
            squares: vec![[0.0; N]; steps],
            position: vec![0.0; steps],
            nees: vec![0.0; steps],
            count: vec![(0, 0); steps],
            indefinite: 0,
            diverged: 0,
            failed: 0,
            runs: 0,
        }
    }

    /// Adds a run. Steps that it did not reach are missing from their means: `failed` tells of them.
    pub fn add(&mut self, track: &Track<N>, divergence: Divergence) {
        for ((squares, count), error) in self.squares.iter_mut().zip(&mut self.count).zip(&track.errors) {
            squares.iter_mut().zip(error).for_each(|(sum, e)| *sum += e * e);
            count.0 += 1;
        }
        let sums = self.position.iter_mut().zip(&mut self.nees).zip(&mut self.count);
        for (((position, nees), count), (distance, normalised)) in sums.zip(track.position_m.iter().zip(&track.nees)) {
            *position += distance * distance;
            *nees += normalised;
            count.1 += 1;
        }
        self.indefinite += track.indefinite;
        // Written so that a distance that is no number counts as beyond.
        let is_near = |m: &f64| *m <= divergence.beyond_m;
        let is_lost = !track.position_m.iter().skip(divergence.from_step).all(is_near);
        self.diverged += u64::from(is_lost || track.failure.is_some());
        self.failed += u64::from(track.failure.is_some());
        self.runs += 1;
    }

    /// Root mean square error of each component after each step; not a number where no run came so far.
    #[must_use]
    pub fn history(&self) -> Vec<[f64; N]> {
        let each = self.squares.iter().zip(&self.count);
        each.map(|(squares, count)| squares.map(|sum| (sum / count.0 as f64).sqrt())).collect()
    }

    /// Root mean square of the distance after each step, m.
    #[must_use]
    pub fn position_history_m(&self) -> Vec<f64> {
        self.position.iter().zip(&self.count).map(|(sum, count)| (sum / count.1 as f64).sqrt()).collect()
    }

    /// Mean normalised error squared after each step.
    #[must_use]
    pub fn nees_history(&self) -> Vec<f64> {
        self.nees.iter().zip(&self.count).map(|(sum, count)| sum / count.1 as f64).collect()
    }

    /// Share of all watched steps with an indefinite covariance.
    #[must_use]
    pub fn indefinite_share(&self) -> f64 {
        let watched: u64 = self.count.iter().map(|count| count.1).sum();
        if watched == 0 { 0.0 } else { self.indefinite as f64 / watched as f64 }
    }
}

/// Mean of a history from a step on; not a number when nothing is left.
#[must_use]
pub fn mean_from(history: &[f64], from_step: usize) -> f64 {
    let late = history.get(from_step..).unwrap_or(&[]);
    late.iter().sum::<f64>() / late.len() as f64
}

/// [`mean_from`] of each component.
#[must_use]
pub fn means_from<const N: usize>(history: &[[f64; N]], from_step: usize) -> [f64; N] {
    let late = history.get(from_step..).unwrap_or(&[]);
    let mut means = [0.0; N];
    for values in late {
        means.iter_mut().zip(values).for_each(|(mean, value)| *mean += value);
    }
    means.map(|sum| sum / late.len() as f64)
}

/// Geometric mean of the ratios `reference`/`of`, component by component: above 1, `of` is the smaller.
#[must_use]
pub fn geometric_ratio<const N: usize>(reference: &[f64; N], of: &[f64; N]) -> f64 {
    let logs = reference.iter().zip(of).map(|(a, b)| (a / b).ln());
    (logs.sum::<f64>() / N as f64).exp()
}

#[cfg(test)]
mod tests {
    use fsw_core::nav::estimators::EstimatorError;

    use super::*;

    const BOUND: Divergence = Divergence { from_step: 1, beyond_m: 3.5 };

    fn track(m: f64, steps: usize) -> Track<2> {
        Track { errors: vec![[m; 2]; steps], position_m: vec![m; steps], nees: vec![6.0; steps], ..Track::default() }
    }

    #[test]
    fn sums_become_root_mean_squares_and_means() {
        let mut tally = Tally::new(2);
        tally.add(&track(3.0, 2), BOUND);
        tally.add(&track(4.0, 2), BOUND);
        let root = 12.5f64.sqrt();
        assert_eq!(tally.history(), vec![[root; 2]; 2]);
        assert_eq!((tally.position_history_m(), tally.nees_history()), (vec![root; 2], vec![6.0; 2]));
        assert_eq!((tally.diverged, tally.failed, tally.runs), (1, 0, 2));
    }

    #[test]
    fn a_run_that_stops_counts_where_it_was_and_as_diverged() {
        let mut tally = Tally::new(2);
        let stopped = Track { failure: Some(EstimatorError::BadVariance(0.0)), indefinite: 1, ..track(1.0, 1) };
        tally.add(&stopped, BOUND);
        tally.add(&track(2.0, 2), BOUND);
        assert_eq!((tally.history()[1], tally.diverged, tally.failed), ([2.0; 2], 1, 1));
        assert!((tally.indefinite_share() - 1.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn an_error_that_is_no_number_is_a_divergence() {
        let mut tally = Tally::new(2);
        tally.add(&track(f64::NAN, 2), BOUND);
        assert_eq!(tally.diverged, 1);
    }

    #[test]
    fn the_ratio_is_the_geometric_mean_and_means_start_where_they_are_told() {
        assert!((geometric_ratio(&[2.0, 8.0], &[1.0, 1.0]) - 4.0).abs() < 1e-12);
        assert_eq!(means_from(&[[9.0, 9.0], [1.0, 2.0], [3.0, 4.0]], 1), [2.0, 3.0]);
        assert!((mean_from(&[9.0, 1.0, 3.0], 1) - 2.0).abs() < 1e-15 && mean_from(&[1.0], 1).is_nan());
    }
}
