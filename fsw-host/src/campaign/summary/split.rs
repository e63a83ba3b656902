//! The miss and what is left of it when the same runs are flown with less to contend with.

use std::io;

use serde::{Deserialize, Serialize};

use hil_sim::noise::Stream;

use crate::campaign::columns::SPLIT;
use crate::campaign::runs::Runs;
use crate::campaign::statistics::quantile;

/// Samples drawn from the runs for the bounds of the shares.
const RESAMPLES: usize = 1_000;
/// Runs that it takes for bounds: from fewer, drawing again shows too little of what others would be like.
const LEAST_RUNS: usize = 10;

/// The miss and what is left of it: root mean squares over the runs that were flown again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// Runs that were flown again.
    pub runs: u64,
    /// Miss as flown, m.
    pub flown_m: f64,
    /// With the density known on board, m.
    pub known_density_m: f64,
    /// With known density and ideal navigation, m.
    pub ideal_navigation_m: f64,
    /// Share of the mean squared miss that goes when the density is known, percent; below zero when the miss grew.
    pub atmosphere_pct: f64,
    /// Share that goes with ideal navigation too, percent.
    pub navigation_pct: f64,
    /// Share that is left, percent.
    pub guidance_pct: f64,
    /// 95 % bounds of the shares above; none from a handful of runs.
    pub bounds: Option<SplitBounds>,
}

/// 95 % bounds of the shares of a [`Split`], percent: [lower, upper], by drawing from the runs again (percentile
/// bootstrap; Efron and Tibshirani, An Introduction to the Bootstrap, chapter 13).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SplitBounds {
    /// Atmosphere.
    pub atmosphere_pct: [f64; 2],
    /// Navigation.
    pub navigation_pct: [f64; 2],
    /// Guidance.
    pub guidance_pct: [f64; 2],
}

/// Squared misses of a run: as flown, with known density, with ideal navigation too.
type Squares = [f64; 3];

impl Split {
    /// Of a table and its misses; none when no run was flown again.
    pub(super) fn of(runs: &Runs, misses: &[f64]) -> io::Result<Option<Self>> {
        let (known, ideal) = (runs.numbers(SPLIT[0])?, runs.numbers(SPLIT[1])?);
        let all: Vec<Squares> = misses
            .iter()
            .zip(known.iter().zip(&ideal))
            .map(|(flown, (known, ideal))| [flown * flown, known * known, ideal * ideal])
            .filter(|squares| squares.iter().all(|m| m.is_finite()))
            .collect();
        if all.is_empty() {
            return Ok(None);
        }
        let sums = sums(all.iter());
        let [flown_m, known_density_m, ideal_navigation_m] = sums.map(|sum| (sum / all.len() as f64).sqrt());
        let [atmosphere_pct, navigation_pct, guidance_pct] = shares(&sums);
        Ok(Some(Self {
            runs: all.len() as u64,
            flown_m,
            known_density_m,
            ideal_navigation_m,
            atmosphere_pct,
            navigation_pct,
            guidance_pct,
            bounds: (all.len() >= LEAST_RUNS).then(|| bounds(&all)),
        }))
    }
}

fn sums<'a>(squares: impl Iterator<Item = &'a Squares>) -> Squares {
    squares.fold([0.0; 3], |sums, squares| std::array::from_fn(|k| sums[k] + squares[k]))
}

/// What goes when the density is known, what goes with ideal navigation too, what is left; percent of the whole.
fn shares([flown, known, ideal]: &Squares) -> [f64; 3] {
    [flown - known, known - ideal, *ideal].map(|part| if *flown > 0.0 { 100.0 * part / flown } else { 0.0 })
}

fn bounds(all: &[Squares]) -> SplitBounds {
    // A stream of its own: the bounds depend on nothing but the runs.
    let mut stream = Stream::new(0, 0, "bounds of the split of the miss");
    let mut drawn = || &all[((stream.uniform() * all.len() as f64) as usize).min(all.len() - 1)];
    let samples: Vec<[f64; 3]> = (0..RESAMPLES).map(|_| shares(&sums((0..all.len()).map(|_| drawn())))).collect();
    let range = |part: usize| {
        let mut values: Vec<f64> = samples.iter().map(|shares| shares[part]).collect();
        values.sort_by(f64::total_cmp);
        [0.025, 0.975].map(|q| quantile(&values, q).unwrap_or(f64::NAN))
    };
    SplitBounds { atmosphere_pct: range(0), navigation_pct: range(1), guidance_pct: range(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shares_make_up_the_whole_and_their_bounds_hold_the_truth_as_often_as_they_say() {
        assert_eq!(shares(&[200.0, 150.0, 50.0]), [25.0, 50.0, 25.0]);
        let mut stream = Stream::new(1, 0, "split bounds");
        let mut hits = 0;
        for _ in 0..60 {
            // Normal misses of 1, 2 and 1 in each part: shares of 1/6, 4/6 and 1/6.
            let all: Vec<Squares> = (0..200)
                .map(|_| {
                    let [a, b, c] = [1.0, 2.0, 1.0].map(|sigma: f64| (sigma * stream.normal()).powi(2));
                    [a + b + c, b + c, c]
                })
                .collect();
            let [low, high] = bounds(&all).navigation_pct;
            hits += usize::from(low <= 400.0 / 6.0 && 400.0 / 6.0 <= high);
        }
        // 95 % of 60 less three standard deviations.
        assert!(hits >= 52, "{hits}");
    }
}
