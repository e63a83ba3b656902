//! The corrector: a bounded secant on the cosine of the bank that brings the predicted downrange error to zero.
//!
//! Source: P4 eq. 4, started from the bank in force and from that bank plus an increment (P4: 30–50°). The downrange
//! error grows with cos σ (more lift up flies further). Deviations from the paper: iterates stay within the bank limits
//! and, once two of them bracket the target, within the bracket; the secant goes
//! through the two nearest iterates instead of the last two; at the bound of calls the best iterate is used.

use crate::link::packet::CycleOutcome;
use crate::math::fun::{acos, cos};
use crate::math::num::{abs, clamp};

/// Predictor calls in one guidance cycle, at most, whatever the parameters say.
pub const MAX_PREDICTIONS: usize = 4;
/// Predictions that start the secant; every further one is an iteration.
const STARTING_POINTS: usize = 2;

/// One predicted flight: the cosine of its bank and the downrange error it ends with, m, positive beyond the target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Cosine of the bank.
    pub cos_bank: f64,
    /// Downrange error, m.
    pub error_m: f64,
}

/// Limits and first guess of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Smallest bank magnitude, rad.
    pub min_bank_rad: f64,
    /// Largest bank magnitude, rad.
    pub max_bank_rad: f64,
    /// Bank magnitude to start from, rad.
    pub first_bank_rad: f64,
    /// Second point: added to the first, or subtracted where the sum is beyond the largest, rad.
    pub increment_rad: f64,
    /// Downrange error that is good enough, m.
    pub tolerance_m: f64,
    /// Secant iterations, at most.
    pub max_iterations: u8,
    /// Slope of the downrange error with the cosine of the bank, m, as an earlier search found it.
    pub slope_m: Option<f64>,
}

/// The search under way: [`Corrector::next`] says which bank to predict, [`Corrector::take`] is told the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Corrector {
    /// Cosine of the largest and of the smallest bank.
    low: f64,
    high: f64,
    second: f64,
    first: f64,
    tolerance_m: f64,
    max_samples: usize,
    slope_m: Option<f64>,
    samples: heapless::Vec<Sample, MAX_PREDICTIONS>,
}

impl Corrector {
    /// A search within limits; they are ordered and the first guess is brought inside them.
    #[must_use]
    pub fn new(search: &Search) -> Self {
        let pi = core::f64::consts::PI;
        let min_bank = clamp(search.min_bank_rad, 0.0, pi);
        let max_bank = clamp(search.max_bank_rad, min_bank, pi);
        let first = clamp(abs(search.first_bank_rad), min_bank, max_bank);
        let increment = clamp(search.increment_rad, 0.0, pi);
        let up = first + increment;
        let second = if up <= max_bank { up } else { clamp(first - increment, min_bank, max_bank) };
        let iterations = usize::from(search.max_iterations);
        Self {
            low: cos(max_bank),
            high: cos(min_bank),
            first: cos(first),
            second: cos(second),
            tolerance_m: search.tolerance_m,
            max_samples: (STARTING_POINTS + iterations).min(MAX_PREDICTIONS),
            slope_m: search.slope_m,
            samples: heapless::Vec::new(),
        }
    }

    /// Predictions that a cycle may make: those of the search and one to relieve a limit.
    #[must_use]
    pub fn max_predictions(&self) -> usize {
        (self.max_samples + 1).min(MAX_PREDICTIONS)
    }

    /// Tells the search what the prediction at `sample.cos_bank` found. More than [`MAX_PREDICTIONS`] are ignored.
    pub fn take(&mut self, sample: Sample) {
        let _ = self.samples.push(sample);
    }

    /// The cosine of the bank to predict next, or `None` when the search is over.
    #[must_use]
    pub fn next(&self) -> Option<f64> {
        if self.samples.len() >= self.max_samples {
            return None;
        }
        let wanted = match self.samples.as_slice() {
            [] => self.first,
            [.., last] if self.is_good(last) || self.is_stuck_at_a_limit(last) => return None,
            [first] => match self.slope_m {
                Some(slope_m) => clamp(first.cos_bank - first.error_m / slope_m, self.low, self.high),
                None => self.second,
            },
            [..] => self.improved()?,
        };
        // A point tried before would only repeat itself.
        let is_new = self.samples.iter().all(|s| abs(s.cos_bank - wanted) > 1e-12);
        is_new.then_some(wanted)
    }

    /// The secant through the two samples nearest to the target, kept inside limits and bracket.
    ///
    /// P4 takes the last two; the error bends with cos σ, so that from far off the nearest two do better.
    fn improved(&self) -> Option<f64> {
        let best = self.samples.iter().reduce(nearer)?;
        let slope = self.found_slope_m()?;
        // The slope is positive by physics; where it is not, head for the end of the range that helps.
        let end = if best.error_m > 0.0 { self.low } else { self.high };
        let secant = if slope > 0.0 { clamp(best.cos_bank - best.error_m / slope, self.low, self.high) } else { end };
        Some(match self.bracket() {
            Some((short, long)) if !(secant > short.cos_bank && secant < long.cos_bank) => {
                0.5 * (short.cos_bank + long.cos_bank)
            }
            _ => secant,
        })
    }

    /// Slope of the error through the two samples nearest to the target, m; `None` before there are two.
    #[must_use]
    #[inline(never)]
    pub fn found_slope_m(&self) -> Option<f64> {
        let best = self.samples.iter().reduce(nearer)?;
        let other = self.samples.iter().filter(|s| s.cos_bank != best.cos_bank).reduce(nearer)?;
        Some((best.error_m - other.error_m) / (best.cos_bank - other.cos_bank))
    }

    /// The cosine of the bank at which the straight line through the best sample, of slope `slope_m`, meets the target.
    #[must_use]
    pub fn refined(&self, best: &Sample, slope_m: f64) -> f64 {
        let line = clamp(best.cos_bank - best.error_m / slope_m, self.low, self.high);
        match self.bracket() {
            Some((short, long)) => clamp(line, short.cos_bank, long.cos_bank),
            None => line,
        }
    }

    #[inline(never)]
    /// The tightest pair of a short sample and a long one with more lift up.
    fn bracket(&self) -> Option<(Sample, Sample)> {
        let shorts = self.samples.iter().filter(|s| s.error_m < 0.0);
        let short = shorts.reduce(|a, b| if b.cos_bank > a.cos_bank { b } else { a })?;
        let longs = self.samples.iter().filter(|s| s.error_m >= 0.0 && s.cos_bank > short.cos_bank);
        let long = longs.reduce(|a, b| if b.cos_bank < a.cos_bank { b } else { a })?;
        Some((*short, *long))
    }

    fn is_good(&self, sample: &Sample) -> bool {
        abs(sample.error_m) <= self.tolerance_m
    }

    fn is_stuck_at_a_limit(&self, sample: &Sample) -> bool {
        self.is_short_at_most_lift(sample) || self.is_long_at_least_lift(sample)
    }

    fn is_short_at_most_lift(&self, sample: &Sample) -> bool {
        sample.cos_bank >= self.high && sample.error_m < 0.0
    }

    fn is_long_at_least_lift(&self, sample: &Sample) -> bool {
        sample.cos_bank <= self.low && sample.error_m > 0.0
    }

    /// The sample with the smallest error and what it means; `None` when nothing has been predicted.
    #[must_use]
    #[inline(never)]
    pub fn best(&self) -> Option<(Sample, CycleOutcome)> {
        let best = self.samples.iter().reduce(nearer)?;
        let outcome = if self.is_good(best) {
            CycleOutcome::Converged
        } else if self.is_short_at_most_lift(best) {
            CycleOutcome::Short
        } else if self.is_long_at_least_lift(best) {
            CycleOutcome::Long
        } else {
            CycleOutcome::BestSoFar
        };
        Some((*best, outcome))
    }

    /// Predictions made.
    #[must_use]
    pub fn predictions(&self) -> usize {
        self.samples.len()
    }

    /// Secant iterations made.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.samples.len().saturating_sub(STARTING_POINTS)
    }

    /// Cosine of the smallest bank allowed.
    #[must_use]
    pub fn most_lift(&self) -> f64 {
        self.high
    }
}

/// The sample that ends nearer to the target; the first of two equals.
#[inline(never)]
fn nearer<'a>(a: &'a Sample, b: &'a Sample) -> &'a Sample {
    if abs(b.error_m) < abs(a.error_m) { b } else { a }
}

/// Bank magnitude of a cosine, rad.
#[must_use]
pub fn bank_of(cos_bank: f64) -> f64 {
    acos(clamp(cos_bank, -1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::rad;
    use proptest::prelude::*;

    fn search() -> Search {
        Search {
            min_bank_rad: rad(10.0),
            max_bank_rad: rad(110.0),
            first_bank_rad: rad(60.0),
            increment_rad: rad(40.0),
            tolerance_m: 100.0,
            max_iterations: 2,
            slope_m: None,
        }
    }

    /// Runs a search against a made-up predictor; at most `MAX_PREDICTIONS` rounds by construction.
    fn run(search: &Search, error_m: impl Fn(f64) -> f64) -> Corrector {
        let mut corrector = Corrector::new(search);
        while let Some(cos_bank) = corrector.next() {
            corrector.take(Sample { cos_bank, error_m: error_m(cos_bank) });
        }
        corrector
    }

    #[test]
    fn a_smooth_error_is_solved_in_one_or_two_iterations() {
        // 300 km of authority over cos σ with a mild bend, as the entry has.
        for target in [-0.2, 0.1, 0.5, 0.9] {
            let c = run(&search(), |x| 3e5 * (x - target) + 5e3 * (x * x - target * target));
            let (best, outcome) = c.best().unwrap();
            assert_eq!(outcome, CycleOutcome::Converged);
            assert!(best.error_m.abs() <= 100.0 && (best.cos_bank - target).abs() < 1e-3);
            assert!(c.iterations() <= 2);
        }
    }

    #[test]
    fn a_good_first_guess_costs_one_prediction() {
        assert_eq!(run(&search(), |_| 50.0).predictions(), 1);
    }

    #[test]
    fn a_target_out_of_reach_is_named_short_or_long_at_the_limit() {
        let (best, outcome) = run(&search(), |x| 3e5 * (x - 1.5)).best().unwrap();
        assert_eq!((outcome, best.cos_bank), (CycleOutcome::Short, rad(10.0).cos()));
        let (best, outcome) = run(&search(), |x| 3e5 * (x + 1.5)).best().unwrap();
        assert_eq!((outcome, best.cos_bank), (CycleOutcome::Long, rad(110.0).cos()));
    }

    #[test]
    fn a_jump_in_the_error_keeps_the_best_iterate() {
        let c = run(&search(), |x| if x > 0.3 { 9e3 } else { -7e3 });
        let (best, outcome) = c.best().unwrap();
        assert_eq!((best.error_m, outcome), (-7e3, CycleOutcome::BestSoFar));
        assert_eq!(c.predictions(), MAX_PREDICTIONS);
    }

    proptest! {
        #[test]
        fn the_bound_of_calls_and_the_bank_limits_hold_for_any_error(
            errors in prop::array::uniform8(prop::num::f64::ANY), first in prop::num::f64::ANY,
            increment in prop::num::f64::ANY, min in prop::num::f64::ANY, max in prop::num::f64::ANY, iterations in 0u8..=255,
            slope in prop::option::of(prop::num::f64::ANY),
        ) {
            let search = Search {
                min_bank_rad: min, max_bank_rad: max, first_bank_rad: first, increment_rad: increment,
                tolerance_m: 100.0, max_iterations: iterations, slope_m: slope,
            };
            let mut corrector = Corrector::new(&search);
            let mut calls = 0;
            while let Some(cos_bank) = corrector.next() {
                prop_assert!((-1.0..=1.0).contains(&cos_bank));
                corrector.take(Sample { cos_bank, error_m: errors[calls % 8] });
                calls += 1;
                prop_assert!(calls <= MAX_PREDICTIONS);
            }
            prop_assert!(corrector.best().is_some());
        }
    }
}
