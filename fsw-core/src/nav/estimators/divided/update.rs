//! Measurements: their differences about the prediction, the desensitized gain, the factor that any gain leaves.
#![allow(
    clippy::indexing_slicing,
    reason = "loop indices are below the const dimensions N, O and P of the arrays they index"
)]
#![allow(clippy::needless_range_loop, reason = "row and column indices are used together")]

use nalgebra::{SMatrix, SVector};

use super::super::linear::Innovation;
use super::super::models::{Measurement, Reading};
use super::super::{EstimatorError, Part, finite};
use super::nonlinearity::Spread;
use super::points::{Column, Middle, scaled_column};
use super::{Degree, Divided, Sensed, add_columns, sensitivity};
use crate::math::factor::add_column;
use crate::math::fun::sqrt;
use crate::math::gate::sigma_gate;
use crate::math::sqrt_tools::{solve_cholesky, tria};

/// What became of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected<const O: usize> {
    /// What it was taken to be.
    pub degree: Degree,
    innovations: [Innovation; O],
    count: usize,
}

impl<const O: usize> Corrected<O> {
    /// One for each reading, in order; each given those before it that were taken in, so that log densities add up.
    pub fn innovations(&self) -> impl Iterator<Item = &Innovation> {
        self.innovations.iter().take(self.count)
    }

    /// Natural logarithm of the probability density of the batch: of all that was used.
    #[must_use]
    pub fn log_density(&self) -> f64 {
        self.innovations().filter(|i| i.used).map(Innovation::log_density).sum()
    }
}

/// Innovations, and the factor of their covariance.
type Judged<const O: usize> = ([Innovation; O], SMatrix<f64, O, O>);

/// A batch about the prediction; rows beyond the last reading, and those beyond the gate, are zero with a noise of 1.
pub(super) struct Seen<const N: usize, const P: usize, const O: usize> {
    pub innovation: [f64; O],
    /// Standard deviations of the noise.
    pub noise: [f64; O],
    /// T1, T2: differences along the columns of the factor.
    pub first: SMatrix<f64, O, N>,
    pub second: SMatrix<f64, O, N>,
    /// γ: derivatives of what is expected by the parameters; those of T1 and T2.
    pub by: [[f64; O]; P],
    pub first_by: [SMatrix<f64, O, N>; P],
    pub second_by: [SMatrix<f64, O, N>; P],
}

impl<const N: usize, const P: usize, const O: usize> Seen<N, P, O> {
    pub(super) const fn nothing() -> Self {
        Self {
            innovation: [0.0; O],
            noise: [1.0; O],
            first: zeros(),
            second: zeros(),
            by: [[0.0; O]; P],
            first_by: [zeros(); P],
            second_by: [zeros(); P],
        }
    }

    /// As if the scalar had not been measured.
    fn forget(&mut self, row: usize) {
        self.innovation[row] = 0.0;
        self.noise[row] = 1.0;
        for p in 0..N {
            self.first[(row, p)] = 0.0;
            self.second[(row, p)] = 0.0;
        }
        for j in 0..P {
            self.by[j][row] = 0.0;
            for p in 0..N {
                self.first_by[j][(row, p)] = 0.0;
                self.second_by[j][(row, p)] = 0.0;
            }
        }
    }

    /// Lower triangular C with C Cᵀ = T1 T1ᵀ + T2 T2ᵀ + γ W γᵀ + R, never formed by a subtraction.
    fn innovation_factor(&self, weights: &[f64; P]) -> SMatrix<f64, O, O> {
        let mut factor = SMatrix::zeros();
        for i in 0..O {
            factor[(i, i)] = self.noise[i];
        }
        add_columns(&mut factor, &self.first);
        add_columns(&mut factor, &self.second);
        for (by, weight) in self.by.iter().zip(weights) {
            add_column(&mut factor, &by.map(|by| sqrt(*weight) * by));
        }
        factor
    }
}

/// Standard deviations of the noise where this is expected; 1 beyond the last reading.
fn deviations<Z: Measurement<N, P>, const N: usize, const P: usize, const O: usize>(
    readings: &[Reading<Z>],
    expected: &[f64; O],
) -> Result<[f64; O], EstimatorError> {
    let mut deviations = [1.0; O];
    for (deviation, (reading, expected)) in deviations.iter_mut().zip(readings.iter().zip(expected)) {
        let variance = reading.sensor.variance(*expected);
        if !(variance > 0.0 && variance.is_finite()) {
            return Err(EstimatorError::BadVariance(variance));
        }
        *deviation = sqrt(variance);
    }
    Ok(deviations)
}

const fn zeros<const R: usize, const C: usize>() -> SMatrix<f64, R, C> {
    SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; R]; C]))
}

impl<const N: usize, const P: usize> Divided<N, P> {
    /// Takes in up to `O` readings of the predicted instant as one batch; one that lies beyond `gate_sigma` deviations
    /// (infinite: no gate), given those before it, corrects nothing.
    ///
    /// # Errors
    /// More than `O` readings; a measurement has no finite value at a point; a variance is not positive; the corrected
    /// estimate leaves the range of numbers. Nothing has changed then.
    pub fn correct<Z: Measurement<N, P>, const O: usize>(
        &mut self,
        readings: &[Reading<Z>],
        gate_sigma: f64,
    ) -> Result<Corrected<O>, EstimatorError> {
        let count = readings.len();
        if count > O {
            return Err(EstimatorError::TooMany { given: count, room: O });
        }
        let mut seen = Seen::nothing();
        let (degree, spread) = self.look(readings, &mut seen)?;
        let (innovations, factor) = self.judge(&mut seen, gate_sigma)?;
        let gain = self.gain(&seen, &factor);
        self.apply(&seen, &gain, degree)?;
        self.seen = self.seen.with(&spread);
        Ok(Corrected { degree, innovations, count })
    }

    /// Differences of what is expected about the prediction.
    #[inline(never)]
    pub(super) fn look<Z: Measurement<N, P>, const O: usize>(
        &self,
        readings: &[Reading<Z>],
        seen: &mut Seen<N, P, O>,
    ) -> Result<(Degree, Spread), EstimatorError> {
        let map = Sensed(readings);
        let mut middle = Middle::nothing();
        let units = |expected: &[f64; O]| deviations(readings, expected);
        let others = self.stepped.with(&self.seen);
        let visit = |p: usize, column: &Column<O, P>| {
            for o in 0..O {
                seen.first[(o, p)] = column.first[o];
                seen.second[(o, p)] = column.second[o];
                for j in 0..if column.is_moving { P } else { 0 } {
                    seen.first_by[j][(o, p)] = column.first_by[j][o];
                    seen.second_by[j][(o, p)] = column.second_by[j][o];
                }
            }
        };
        let (degree, spread) = self.differences(&map, units, &others, Part::Measurement, &mut middle, visit)?;
        if !degree.is_second {
            seen.second.fill(0.0);
        }
        seen.by = if self.is_full(degree) { middle.mean_by } else { middle.by };
        let expected = if degree.is_second { middle.mean } else { middle.centre };
        seen.noise = deviations(readings, &expected)?;
        for (innovation, (reading, expected)) in seen.innovation.iter_mut().zip(readings.iter().zip(&expected)) {
            *innovation = reading.sensor.innovation(reading.value, *expected);
        }
        finite(Part::Measurement, &seen.innovation)?;
        Ok((degree, spread))
    }

    /// Forgets what lies beyond the gate. Scalar by scalar, each given those before it that were not forgotten.
    #[inline(never)]
    pub(super) fn judge<const O: usize>(
        &self,
        seen: &mut Seen<N, P, O>,
        gate_sigma: f64,
    ) -> Result<Judged<O>, EstimatorError> {
        let mut told = [Innovation { value: 0.0, variance: 1.0, used: false }; O];
        let mut factor = seen.innovation_factor(&self.settings.weights);
        let mut white = [0.0; O];
        for i in 0..O {
            let mut value = seen.innovation[i];
            for k in (0..O).take(i) {
                value -= factor[(i, k)] * white[k];
            }
            let variance = factor[(i, i)] * factor[(i, i)];
            if !(variance > 0.0 && variance.is_finite()) {
                return Err(EstimatorError::BadVariance(variance));
            }
            told[i] = Innovation { value, variance, used: sigma_gate(value, variance, gate_sigma).accepted };
            if told[i].used {
                white[i] = value / factor[(i, i)];
            } else {
                // What comes before it does not depend on it.
                seen.forget(i);
                factor = seen.innovation_factor(&self.settings.weights);
                white[i] = 0.0;
            }
        }
        Ok((told, factor))
    }

    /// K = (Pxy + S W γᵀ)(Pyy + γ W γᵀ)⁻¹, P2 eq. 43: the minimum of tr(P + S W Sᵀ).
    #[inline(never)]
    pub(super) fn gain<const O: usize>(&self, seen: &Seen<N, P, O>, factor: &SMatrix<f64, O, O>) -> SMatrix<f64, N, O> {
        let mut gain = SMatrix::zeros();
        for i in 0..N {
            let mut row = SVector::<f64, O>::zeros();
            for o in 0..O {
                // The factor is lower triangular: its row ends at the diagonal.
                for p in (0..N).take(i + 1) {
                    row[o] += self.factor[(i, p)] * seen.first[(o, p)];
                }
                for j in 0..P {
                    row[o] += self.sensitivity[j][i] * self.settings.weights[j] * seen.by[j][o];
                }
            }
            solve_cholesky(factor, &mut row);
            for o in 0..O {
                gain[(i, o)] = row[o];
            }
        }
        gain
    }

    /// Corrects estimate, factor and sensitivities by any gain.
    #[inline(never)]
    pub(super) fn apply<const O: usize>(
        &mut self,
        seen: &Seen<N, P, O>,
        gain: &SMatrix<f64, N, O>,
        degree: Degree,
    ) -> Result<(), EstimatorError> {
        let (mut state, mut by) = (self.state, self.sensitivity);
        for i in 0..N {
            for o in 0..O {
                state[i] += gain[(i, o)] * seen.innovation[o];
                for j in 0..P {
                    by[j][i] -= gain[(i, o)] * seen.by[j][o];
                }
            }
        }
        finite(Part::Estimate, &state)?;
        by.iter().try_for_each(|by| finite(Part::Transition, by))?;
        let (mut factor, mut half) = (SMatrix::<f64, N, N>::zeros(), [SMatrix::zeros(); P]);
        for p in 0..N {
            let column = self.corrected(seen, gain, p, self.is_full(degree));
            factor.set_column(p, &column.first.into());
            sensitivity::gather(&mut half, &column);
        }
        tria(&mut factor);
        for o in 0..O {
            add_column(&mut factor, &scaled_column(gain, o, seen.noise[o]));
        }
        for p in (0..N).take(if degree.is_second { N } else { 0 }) {
            add_column(&mut factor, &along(gain, &seen.second, p));
        }
        self.accept(&factor, &mut half, self.is_full(degree))?;
        self.state = state;
        self.sensitivity = by;
        Ok(())
    }

    /// Columns `p` of Sb − K T1 and of K T2, which with K Sv make the factor after the update, and their derivatives.
    fn corrected<const O: usize>(
        &self,
        seen: &Seen<N, P, O>,
        gain: &SMatrix<f64, N, O>,
        p: usize,
        is_moving: bool,
    ) -> Column<N, P> {
        let mut column = Column {
            first: less(scaled_column(&self.factor, p, 1.0), &along(gain, &seen.first, p)),
            second: along(gain, &seen.second, p),
            is_moving,
            first_by: [[0.0; N]; P],
            second_by: [[0.0; N]; P],
        };
        for j in 0..if is_moving { P } else { 0 } {
            let moved = scaled_column(&self.factor_sensitivity[j], p, 1.0);
            column.first_by[j] = less(moved, &along(gain, &seen.first_by[j], p));
            column.second_by[j] = along(gain, &seen.second_by[j], p);
        }
        column
    }
}

/// K times a column of differences.
fn along<const N: usize, const O: usize>(
    gain: &SMatrix<f64, N, O>,
    differences: &SMatrix<f64, O, N>,
    p: usize,
) -> [f64; N] {
    let mut product = [0.0; N];
    for i in 0..N {
        for o in 0..O {
            product[i] += gain[(i, o)] * differences.get((o, p)).copied().unwrap_or(0.0);
        }
    }
    product
}

fn less<const N: usize>(mut a: [f64; N], b: &[f64; N]) -> [f64; N] {
    a.iter_mut().zip(b).for_each(|(a, b)| *a -= b);
    a
}
