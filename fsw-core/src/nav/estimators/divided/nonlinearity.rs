//! Degree of nonlinearity: which part of a map's spread no affine map can give (Liu and Li 2015; P2 eqs. 13–17).
//!
//! Two ways to sample it. From the difference points themselves it is free, |S2|/√(|S1|² + |S2|²), and exact for ξ + c ξ².
//! By P2's rank sampling it takes 4n + 1 evaluations, is exact (zero) for linear maps, and reads ξ + c ξ² half as nonlinear as
//! it is. Both see the axes of the factor only. The sum over components mixes their units: a threshold has a meaning only
//! together with these.

use super::super::{EstimatorError, Part, finite};
use super::points::{Middle, scaled_column};
use super::{Divided, Map};
use crate::math::fun::sqrt;
use crate::math::num;

/// Standard-normal deviates of the median ranks (i − 0.3)/5.4 of five: Φ⁻¹(4.7/5.4) and Φ⁻¹(3.7/5.4).
const RANKS: [f64; 2] = [1.128_143_65, 0.482_248_21];
/// 2 (u₁² + u₂²): makes the spread of the samples that of the state.
const OMEGA: f64 = 2.0 * (RANKS[0] * RANKS[0] + RANKS[1] * RANKS[1]);

/// Sums of squares of first and of second differences, each over its unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Spread {
    first: f64,
    second: f64,
}

impl Spread {
    /// Of both maps, one above the other.
    pub(super) fn with(&self, other: &Self) -> Self {
        Self { first: self.first + other.first, second: self.second + other.second }
    }

    pub(super) fn nonlinearity(&self) -> f64 {
        ratio(self.second, self.first + self.second)
    }
}

impl<const O: usize, const P: usize> Middle<O, P> {
    /// All differences, each result over its unit.
    pub(super) fn spread(&self, units: &[f64; O]) -> Spread {
        let mut spread = Spread::default();
        for (unit, (first, second)) in units.iter().zip(self.first_square.iter().zip(&self.second_square)) {
            let inverse = 1.0 / (unit * unit);
            spread.first += first * inverse;
            spread.second += second * inverse;
        }
        spread
    }
}

/// √(part/whole), 0 where there is nothing.
fn ratio(part: f64, whole: f64) -> f64 {
    if whole > 0.0 { sqrt(num::clamp(part / whole, 0.0, 1.0)) } else { 0.0 }
}

impl<const N: usize, const P: usize> Divided<N, P> {
    /// By P2's rank sampling about the estimate, 4n + 1 evaluations of `map`. P2's own map is [`Chained`](super::Chained).
    ///
    /// # Errors
    /// A point where the map has no finite value.
    #[inline(never)]
    pub fn nonlinearity_by_ranks<F: Map<N, P, O>, const O: usize>(&self, map: &F) -> Result<f64, EstimatorError> {
        let centre = self.evaluate(map, &[0.0; N], None).value;
        // Of all samples, less the middle one: sum; squares of what is left beside the best line of each axis.
        let (mut sum, mut spread, mut left) = ([0.0; O], 0.0, 0.0);
        for p in 0..N {
            let mut sides = [([0.0; O], 0.0); 2 * RANKS.len()];
            let deviates = RANKS.iter().flat_map(|u| [*u, -*u]);
            for (side, u) in sides.iter_mut().zip(deviates) {
                let offset = scaled_column(&self.factor, p, u);
                *side = (self.evaluate(map, &offset, None).value, u);
                side.0.iter_mut().zip(&centre).for_each(|(value, centre)| *value -= centre);
            }
            let mut slope = [0.0; O];
            for (value, u) in &sides {
                slope.iter_mut().zip(value).for_each(|(slope, value)| *slope += u * value / OMEGA);
            }
            for (value, u) in &sides {
                for ((sum, slope), value) in sum.iter_mut().zip(&slope).zip(value) {
                    *sum += value;
                    spread += value * value;
                    left += (value - u * slope) * (value - u * slope);
                }
            }
        }
        finite(Part::Prediction, &[spread, left])?;
        // Both about the mean; slopes cancel in the sum, so that it is that of the residuals too.
        let samples = 1.0 + N as f64 * sides_of_an_axis();
        let mean_square = sum.iter().map(|sum| sum * sum).sum::<f64>() / samples;
        Ok(ratio(left - mean_square, spread - mean_square))
    }
}

const fn sides_of_an_axis() -> f64 {
    (2 * RANKS.len()) as f64
}
