//! The points about the estimate, x̂ and x̂ ± h s_p, and the differences of a map between them (NPR00; P2 eqs. 24–27, 44–47).

use nalgebra::SMatrix;

use super::super::models::{Measurement, Process, Reading};
use super::super::{EstimatorError, Part, finite};
use super::Divided;
use crate::math::{Dual, Scalar};

/// h² = 3, the kurtosis of a Gaussian: the choice that matches its fourth moments.
const INTERVAL_SQUARE: f64 = 3.0;
/// h.
const INTERVAL: f64 = 1.732_050_807_568_877_2;
/// √(h² − 1)/(2 h²), the weight of a second difference.
const SECOND: f64 = core::f64::consts::SQRT_2 / (2.0 * INTERVAL_SQUARE);

/// A function of state and parameters with `O` results, written once for all scalars.
pub trait Map<const N: usize, const P: usize, const O: usize> {
    /// Its value.
    fn at<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> [S; O];
}

/// A step of a process: F(x, α).
#[derive(Clone, Copy, Debug)]
pub struct Stepped<'a, M> {
    /// The process.
    pub process: &'a M,
    /// Its duration, s.
    pub step_s: f64,
}

impl<M: Process<N, P>, const N: usize, const P: usize> Map<N, P, N> for Stepped<'_, M> {
    fn at<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> [S; N] {
        self.process.step(state, parameters, self.step_s)
    }
}

/// What sensors should read: h(x, α); zero beyond the last one.
#[derive(Clone, Copy, Debug)]
pub struct Sensed<'a, Z>(pub &'a [Reading<Z>]);

impl<Z: Measurement<N, P>, const N: usize, const P: usize, const O: usize> Map<N, P, O> for Sensed<'_, Z> {
    fn at<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> [S; O] {
        let mut expected = [S::from_f64(0.0); O];
        for (expected, reading) in expected.iter_mut().zip(self.0) {
            *expected = reading.sensor.expected(state, parameters);
        }
        expected
    }
}

/// P2's eq. 13, φ(x) = [F(x); h(F(x))], each result over its unit: what the rank-sampled degree of nonlinearity is of.
#[derive(Clone, Copy, Debug)]
pub struct Chained<'a, M, Z, const O: usize> {
    /// F.
    pub step: Stepped<'a, M>,
    /// h.
    pub sensed: Sensed<'a, Z>,
    /// One unit of each result.
    pub units: [f64; O],
}

impl<M, Z, const N: usize, const P: usize, const O: usize> Map<N, P, O> for Chained<'_, M, Z, O>
where
    M: Process<N, P>,
    Z: Measurement<N, P>,
{
    fn at<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> [S; O] {
        let next = self.step.at(state, parameters);
        let mut all = [S::from_f64(0.0); O];
        all.iter_mut().zip(&next).for_each(|(to, from)| *to = *from);
        let seen: [S; O] = self.sensed.at(&next, parameters);
        all.iter_mut().skip(N).zip(&seen).for_each(|(to, from)| *to = *from);
        all.iter_mut().zip(&self.units).for_each(|(value, unit)| *value = *value * (1.0 / unit));
        all
    }
}

/// Where derivatives by the parameters are wanted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detail {
    /// Nowhere.
    Values,
    /// At the middle point.
    Middle,
    /// At all points, which move with the estimate and its factor.
    Everywhere,
}

/// A map's value, and its derivatives by the parameters.
pub(super) struct Values<const O: usize, const P: usize> {
    pub value: [f64; O],
    pub by: [[f64; O]; P],
}

/// Differences along one column of the factor.
pub(super) struct Column<const O: usize, const P: usize> {
    /// (f₊ − f₋)/(2h).
    pub first: [f64; O],
    /// √(h² − 1)/(2h²) (f₊ + f₋ − 2 f₀).
    pub second: [f64; O],
    /// Whether derivatives are known: [`Detail::Everywhere`].
    pub is_moving: bool,
    /// Their derivatives; else zero.
    pub first_by: [[f64; O]; P],
    pub second_by: [[f64; O]; P],
}

/// What all points together tell.
pub(super) struct Middle<const O: usize, const P: usize> {
    /// f₀, and its derivatives.
    pub centre: [f64; O],
    pub by: [[f64; O]; P],
    /// The mean to second order, and its derivatives (those of f₀ unless [`Detail::Everywhere`]).
    pub mean: [f64; O],
    pub mean_by: [[f64; O]; P],
    /// Sums of the squares of all first and all second differences.
    pub first_square: [f64; O],
    pub second_square: [f64; O],
}

impl<const N: usize, const P: usize> Divided<N, P> {
    /// Evaluates a map at the estimate plus `offset`; with `seeds`, the point's own derivatives by the parameters, the
    /// derivatives come along: no Jacobian matrix is formed.
    #[inline(never)]
    pub(super) fn evaluate<F: Map<N, P, O>, const O: usize>(
        &self,
        map: &F,
        offset: &[f64; N],
        seeds: Option<&[[f64; N]; P]>,
    ) -> Values<O, P> {
        let mut point = self.state;
        point.iter_mut().zip(offset).for_each(|(x, by)| *x += by);
        let mut values = Values { value: [0.0; O], by: [[0.0; O]; P] };
        let Some(seeds) = seeds else {
            values.value = map.at(&point, &self.settings.parameters);
            return values;
        };
        let mut moving = point.map(Dual::<P>::constant);
        for (j, seed) in seeds.iter().enumerate() {
            for (x, slope) in moving.iter_mut().zip(seed) {
                x.partials.iter_mut().skip(j).take(1).for_each(|partial| *partial = *slope);
            }
        }
        let found = map.at(&moving, &Dual::variables(&self.settings.parameters));
        for (i, dual) in found.iter().enumerate() {
            values.value.iter_mut().skip(i).take(1).for_each(|value| *value = dual.value);
            for (by, partial) in values.by.iter_mut().zip(&dual.partials) {
                by.iter_mut().skip(i).take(1).for_each(|by| *by = *partial);
            }
        }
        values
    }

    /// The map at x̂ + `along` s_p.
    fn at_point<F: Map<N, P, O>, const O: usize>(
        &self,
        map: &F,
        p: usize,
        along: f64,
        with_derivatives: bool,
    ) -> Values<O, P> {
        let offset = scaled_column(&self.factor, p, along);
        if !with_derivatives {
            return self.evaluate(map, &offset, None);
        }
        let mut seeds = self.sensitivity;
        for (seed, factor_by) in seeds.iter_mut().zip(&self.factor_sensitivity) {
            let moved = scaled_column(factor_by, p, along);
            seed.iter_mut().zip(&moved).for_each(|(seed, by)| *seed += by);
        }
        self.evaluate(map, &offset, Some(&seeds))
    }

    /// All differences, column by column; `middle` takes their sums.
    ///
    /// # Errors
    /// A point where the map has no finite value or derivative.
    pub(super) fn scan<F: Map<N, P, O>, const O: usize>(
        &self,
        map: &F,
        detail: Detail,
        part: Part,
        middle: &mut Middle<O, P>,
        visit: &mut impl FnMut(usize, &Column<O, P>),
    ) -> Result<(), EstimatorError> {
        let seeds = (detail != Detail::Values).then_some(&self.sensitivity);
        let centre = self.evaluate(map, &[0.0; N], seeds);
        middle.begin(&centre);
        for p in 0..N {
            let ahead = self.at_point(map, p, INTERVAL, detail == Detail::Everywhere);
            let behind = self.at_point(map, p, -INTERVAL, detail == Detail::Everywhere);
            let mut column = Column {
                first: half_difference(&ahead.value, &behind.value),
                second: curvature(&ahead.value, &behind.value, &centre.value),
                is_moving: detail == Detail::Everywhere,
                first_by: [[0.0; O]; P],
                second_by: [[0.0; O]; P],
            };
            if column.is_moving {
                for (j, by) in centre.by.iter().enumerate() {
                    let Some((ahead, behind)) = ahead.by.get(j).zip(behind.by.get(j)) else { continue };
                    let (first, second) = (half_difference(ahead, behind), curvature(ahead, behind, by));
                    column.first_by.iter_mut().skip(j).take(1).for_each(|to| *to = first);
                    column.second_by.iter_mut().skip(j).take(1).for_each(|to| *to = second);
                }
            }
            middle.add(&column);
            visit(p, &column);
        }
        middle.check(part)
    }
}

impl<const O: usize, const P: usize> Middle<O, P> {
    pub const fn nothing() -> Self {
        Self {
            centre: [0.0; O],
            by: [[0.0; O]; P],
            mean: [0.0; O],
            mean_by: [[0.0; O]; P],
            first_square: [0.0; O],
            second_square: [0.0; O],
        }
    }

    fn begin(&mut self, centre: &Values<O, P>) {
        (self.centre, self.mean) = (centre.value, centre.value);
        (self.by, self.mean_by) = (centre.by, centre.by);
        (self.first_square, self.second_square) = ([0.0; O], [0.0; O]);
    }

    fn add(&mut self, column: &Column<O, P>) {
        accumulate(&mut self.mean, &column.second);
        for (mean, second) in self.mean_by.iter_mut().zip(&column.second_by) {
            accumulate(mean, second);
        }
        for (sum, x) in self.first_square.iter_mut().zip(&column.first) {
            *sum += x * x;
        }
        for (sum, x) in self.second_square.iter_mut().zip(&column.second) {
            *sum += x * x;
        }
    }

    /// What is not finite at any point is not finite here.
    fn check(&self, part: Part) -> Result<(), EstimatorError> {
        finite(part, &self.mean)?;
        finite(part, &self.first_square)?;
        finite(part, &self.second_square)?;
        self.by.iter().chain(&self.mean_by).try_for_each(|by| finite(Part::Transition, by))
    }
}

/// mean = (h² − n)/h² f₀ + Σ (f₊ + f₋)/(2h²) = f₀ + Σ (f₊ + f₋ − 2 f₀)/(2h²): without a difference of large numbers.
fn accumulate<const O: usize>(mean: &mut [f64; O], second: &[f64; O]) {
    mean.iter_mut().zip(second).for_each(|(mean, second)| *mean += second * (1.0 / (2.0 * INTERVAL_SQUARE * SECOND)));
}

fn half_difference<const O: usize>(ahead: &[f64; O], behind: &[f64; O]) -> [f64; O] {
    let mut out = *ahead;
    out.iter_mut().zip(behind).for_each(|(out, behind)| *out = (*out - behind) * (0.5 / INTERVAL));
    out
}

fn curvature<const O: usize>(ahead: &[f64; O], behind: &[f64; O], centre: &[f64; O]) -> [f64; O] {
    let mut out = *ahead;
    for (out, (behind, centre)) in out.iter_mut().zip(behind.iter().zip(centre)) {
        *out = SECOND * ((*out - centre) + (behind - centre));
    }
    out
}

/// A column of a factor times a number.
pub(super) fn scaled_column<const N: usize, const C: usize>(
    factor: &SMatrix<f64, N, C>,
    p: usize,
    by: f64,
) -> [f64; N] {
    let mut column = [0.0; N];
    for (i, out) in column.iter_mut().enumerate() {
        *out = by * factor.get((i, p)).copied().unwrap_or(0.0);
    }
    column
}
