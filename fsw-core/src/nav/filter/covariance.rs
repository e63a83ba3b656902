//! [`Covariance`] of the estimated states and their correlation with the considered ones, kept in place.
//!
//! The considered states are constants that are never corrected, so their own covariance stays the diagonal it began as.
//! With P the stored rows (16 × 27: estimated × all), the prediction P⁺ = ΦPΦᵀ + Q is one operator, [`Transition::apply`],
//! first on every column, then on every row: two slices of work for two frames.

use super::layout::{ALL, ATTITUDE, AXES, CONSIDERED, ESTIMATED, Estimated, Full, LOG_DENSITY, POSITION, VELOCITY};
use super::transition::Transition;

/// A pivot below this fraction of its variance counts as not positive.
const RELATIVE_PIVOT: f64 = 1e-12;
/// It is then raised to this many times the limit, so that rounding does not bring it back below.
const RAISE: f64 = 10.0;

/// Columns that a frame predicts before the next one predicts the rest and the rows: about the same cost.
const MOST: usize = 24;

/// Rows of the lower triangle that hold about half of its work: 11 · 12 of 16 · 17.
const HALF: usize = 11;

/// Process noise of a window, as variances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProcessNoise {
    /// Velocity per axis, (m/s)².
    pub velocity: f64,
    /// Attitude per axis, rad².
    pub attitude: f64,
    /// Log-density.
    pub log_density: f64,
}

impl ProcessNoise {
    /// No noise.
    pub const NONE: Self = Self { velocity: 0.0, attitude: 0.0, log_density: 0.0 };
}

/// Joint covariance of estimated and considered states.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Estimated × all; the estimated part is symmetric bit by bit.
    rows: [[f64; ALL]; ESTIMATED],
    /// Variances of the considered states.
    considered: [f64; CONSIDERED],
    /// Variances at the start, the scale of what is small.
    start: Estimated,
    /// Room for the factorisation of [`Covariance::check`].
    work: [[f64; ESTIMATED]; ESTIMATED],
}

impl Default for Covariance {
    fn default() -> Self {
        Self::none()
    }
}

impl Covariance {
    /// Nothing known and nothing unknown, before the start.
    pub const fn none() -> Self {
        Self {
            rows: [[0.0; ALL]; ESTIMATED],
            considered: [0.0; CONSIDERED],
            start: [0.0; ESTIMATED],
            work: [[0.0; ESTIMATED]; ESTIMATED],
        }
    }
}

#[allow(clippy::indexing_slicing, clippy::needless_range_loop)] // loops over the constant shapes of fixed arrays
impl Covariance {
    /// Starts from uncorrelated standard deviations of all states.
    pub fn start(&mut self, sigmas: &Full) {
        for i in 0..ESTIMATED {
            self.start[i] = sigmas[i] * sigmas[i];
        }
        for c in 0..CONSIDERED {
            self.considered[c] = sigmas[ESTIMATED + c] * sigmas[ESTIMATED + c];
        }
        self.restart();
    }

    /// Element of the estimated part, or of its correlation with a considered state (`j` ≥ 16).
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0)
    }

    /// First part of the prediction: Φ on most columns.
    pub fn begin_prediction(&mut self, transition: &Transition) {
        self.predict_columns::<0, MOST>(transition);
    }

    /// The rest of the prediction: Φ on the columns left, then on every row, and the process noise.
    pub fn end_prediction(&mut self, transition: &Transition, noise: &ProcessNoise) {
        self.predict_columns::<MOST, ALL>(transition);
        self.predict_rows(transition, noise);
    }

    /// Φ on columns `FROM` to `TO`, in ascending order: those of the considered states come last, because the others need
    /// them as they were. Constants, so that no index needs a check at run time.
    fn predict_columns<const FROM: usize, const TO: usize>(&mut self, transition: &Transition) {
        const { assert!(FROM <= TO && TO <= ALL) };
        for j in FROM..TO {
            let mut column: Full = [0.0; ALL];
            for i in 0..ESTIMATED {
                column[i] = self.rows[i][j];
            }
            if j < ESTIMATED {
                // Considered × estimated, still that of the start: those columns come later.
                column[ESTIMATED..].copy_from_slice(&self.rows[j][ESTIMATED..]);
            } else {
                column[j] = self.considered[j - ESTIMATED];
            }
            let predicted = transition.apply(&column);
            for i in 0..ESTIMATED {
                self.rows[i][j] = predicted[i];
            }
        }
    }

    /// Φ on every row, and the process noise.
    fn predict_rows(&mut self, transition: &Transition, noise: &ProcessNoise) {
        for i in 0..ESTIMATED {
            let predicted = transition.apply(&self.rows[i]);
            self.rows[i][..ESTIMATED].copy_from_slice(&predicted);
        }
        for i in 0..ESTIMATED {
            for j in 0..i {
                self.rows[i][j] = self.rows[j][i];
            }
        }
        self.add(noise, transition.elapsed_s);
    }

    /// White noise integrated over the window: velocity q, position q·T²/3, between them q·T/2.
    fn add(&mut self, noise: &ProcessNoise, t: f64) {
        for k in 0..AXES {
            let (r, v, a) = (POSITION + k, VELOCITY + k, ATTITUDE + k);
            self.rows[v][v] += noise.velocity;
            self.rows[r][v] += noise.velocity * (0.5 * t);
            self.rows[v][r] += noise.velocity * (0.5 * t);
            self.rows[r][r] += noise.velocity * (t * t / 3.0);
            self.rows[a][a] += noise.attitude;
        }
        self.rows[LOG_DENSITY][LOG_DENSITY] += noise.log_density;
    }

    /// Covariance of all states with the scalar h·x, for an `h` that touches only the listed `columns`.
    pub(super) fn times(&self, columns: &[(usize, f64)], out: &mut Full) {
        for i in 0..ESTIMATED {
            let mut sum = 0.0;
            for &(j, h) in columns {
                sum += self.rows[i][j.min(ALL - 1)] * h;
            }
            out[i] = sum;
        }
        for c in 0..CONSIDERED {
            let mut sum = 0.0;
            for &(j, h) in columns {
                if j < ESTIMATED {
                    sum += self.rows[j][ESTIMATED + c] * h;
                } else if j == ESTIMATED + c {
                    sum += self.considered[c] * h;
                }
            }
            out[ESTIMATED + c] = sum;
        }
    }

    /// Subtracts u·uᵀ/s from the estimated rows (u from [`Covariance::times`]).
    pub(super) fn reduce(&mut self, u: &Full, s: f64) {
        let inverse = 1.0 / s;
        for i in 0..ESTIMATED {
            let gain = u[i] * inverse;
            for j in i..ESTIMATED {
                let value = self.rows[i][j] - gain * u[j];
                self.rows[i][j] = value;
                self.rows[j][i] = value;
            }
            for j in ESTIMATED..ALL {
                self.rows[i][j] -= gain * u[j];
            }
        }
    }

    /// Prepares the first half of [`Covariance::check`], so that its cost spreads over two frames. The covariance must not
    /// change in between.
    pub fn begin_check(&mut self) {
        self.schur_complement::<0, HALF>();
    }

    /// Checks that the joint covariance is positive definite and restores it if it is not; true when it was restored.
    /// Goes on from [`Covariance::begin_check`].
    ///
    /// Factorises the Schur complement of the considered part (P_xx − P_xc P_cc⁻¹ P_cx = L D Lᵀ). A pivot that is not positive
    /// is raised above [`RELATIVE_PIVOT`] of its variance and the same amount added to the stored variance (Gill and Murray
    /// 1974), so that the restored matrix is positive definite and no smaller. Numbers that are not finite restart it.
    pub fn check(&mut self) -> bool {
        if !self.rows.iter().all(|row| crate::math::num::all_finite(row)) {
            self.restart();
            return true;
        }
        self.schur_complement::<HALF, ESTIMATED>();
        let mut restored = false;
        for k in 0..ESTIMATED {
            let smallest = RELATIVE_PIVOT * self.start[k];
            let lost = self.rows[k][k] < smallest;
            let floor = RELATIVE_PIVOT * if lost { self.start[k] } else { self.rows[k][k] };
            let mut pivot = self.work[k][k];
            if pivot < floor {
                // A variance that is itself not positive says nothing: it begins again at that of the start.
                let raised = if lost { self.start[k] } else { RAISE * floor };
                self.rows[k][k] += raised - pivot;
                pivot = raised;
                restored = true;
            }
            if pivot <= 0.0 {
                continue; // a state without any uncertainty: its row is zero
            }
            for i in k + 1..ESTIMATED {
                let factor = self.work[i][k] / pivot;
                for j in k + 1..=i {
                    self.work[i][j] -= factor * self.work[j][k];
                }
            }
        }
        restored
    }

    /// Rows `FROM` to `TO` of the Schur complement; constants, so that no index needs a check at run time.
    fn schur_complement<const FROM: usize, const TO: usize>(&mut self) {
        const { assert!(FROM <= TO && TO <= ESTIMATED) };
        let mut inverse = [0.0; CONSIDERED];
        for c in 0..CONSIDERED {
            inverse[c] = if self.considered[c] > 0.0 { 1.0 / self.considered[c] } else { 0.0 };
        }
        for i in FROM..TO {
            let mut scaled = [0.0; CONSIDERED];
            for c in 0..CONSIDERED {
                scaled[c] = self.rows[i][ESTIMATED + c] * inverse[c];
            }
            for j in 0..=i {
                let mut value = self.rows[i][j];
                for c in 0..CONSIDERED {
                    value -= scaled[c] * self.rows[j][ESTIMATED + c];
                }
                self.work[i][j] = value;
            }
        }
    }

    /// Back to the uncorrelated covariance of the start.
    fn restart(&mut self) {
        for i in 0..ESTIMATED {
            self.rows[i] = [0.0; ALL];
            self.rows[i][i] = self.start[i];
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::frames::{Rot, Vec3};
    use crate::nav::filter::transition::FrameStep;
    use crate::nav::strapdown::{Increments, Nominal, Strapdown};
    use crate::planet::MARS;
    use std::boxed::Box;
    use std::vec::Vec;

    pub type Dense = nalgebra::SMatrix<f64, ALL, ALL>;

    /// A transition of five frames at 9 g and 20°/s.
    pub fn transition() -> Transition {
        let (mut state, mut strapdown, mut transition) = (
            Nominal {
                r_i: Vec3::new(2.0e6, -1.5e6, 2.3e6),
                v_i: Vec3::new(3000.0, 1000.0, -2000.0),
                attitude_bi: Rot::from_quaternion([0.5, -0.3, 0.7, 0.2]).unwrap(),
            },
            Strapdown::new(),
            Transition::default(),
        );
        let increments =
            Increments { delta_v_b: Vec3::new(-1.7, 0.1, 0.3), delta_theta_b: Vec3::new(7e-3, -1e-3, 2e-3) };
        for _ in 0..5 {
            let before = state;
            let record = strapdown.advance(&mut state, &increments, 0.02, &MARS);
            let frame = FrameStep {
                before: &before,
                after: &state,
                increments: &increments,
                record: &record,
                density_decay: 0.999,
                dt_s: 0.02,
            };
            transition.accumulate(&frame, &MARS);
        }
        transition
    }

    /// The full matrix of the transition; considered states stay.
    fn dense_transition(t: &Transition) -> Dense {
        let mut phi = Dense::identity();
        for j in 0..ALL {
            let mut x: Full = [0.0; ALL];
            x[j] = 1.0;
            for (i, value) in t.apply(&x).iter().enumerate() {
                phi[(i, j)] = *value;
            }
        }
        phi
    }

    pub fn dense(p: &Covariance) -> Dense {
        Dense::from_fn(|i, j| match (i < ESTIMATED, j < ESTIMATED) {
            (true, _) => p.rows[i][j],
            (false, true) => p.rows[j][i],
            (false, false) if i == j => p.considered[i - ESTIMATED],
            _ => 0.0,
        })
    }

    /// Standard deviations of an entry.
    pub fn started() -> Box<Covariance> {
        let mut sigmas: Full = [0.0; ALL];
        let blocks: [(usize, f64, usize); 11] = [
            (0, 500.0, 3),
            (3, 0.3, 3),
            (6, 5e-4, 3),
            (9, 1e-3, 3),
            (12, 5e-6, 3),
            (15, 0.08, 1),
            (16, 1.5e-4, 3),
            (19, 2e-4, 3),
            (22, 1e-4, 3),
            (25, 0.02, 1),
            (26, 15.0, 1),
        ];
        for (at, sigma, n) in blocks {
            sigmas[at..at + n].fill(sigma);
        }
        let mut p = Box::<Covariance>::default();
        p.start(&sigmas);
        p
    }

    const NOISE: ProcessNoise = ProcessNoise { velocity: 2e-8, attitude: 4e-11, log_density: 1e-5 };

    #[test]
    fn the_sliced_prediction_is_the_dense_one() {
        let (t, mut p) = (transition(), started());
        for _ in 0..20 {
            let phi = dense_transition(&t);
            let mut expected = phi * dense(&p) * phi.transpose();
            for k in 0..3 {
                let (q, dt) = (NOISE.velocity, t.elapsed_s);
                expected[(3 + k, 3 + k)] += q;
                expected[(k, 3 + k)] += q * dt / 2.0;
                expected[(3 + k, k)] += q * dt / 2.0;
                expected[(k, k)] += q * dt * dt / 3.0;
                expected[(6 + k, 6 + k)] += NOISE.attitude;
            }
            expected[(15, 15)] += NOISE.log_density;
            p.begin_prediction(&t);
            p.end_prediction(&t, &NOISE);
            let found = dense(&p);
            for i in 0..ALL {
                for j in 0..ALL {
                    let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    assert!((found[(i, j)] - expected[(i, j)]).abs() <= 1e-12 * scale, "{i} {j}");
                }
            }
        }
    }

    #[test]
    fn a_sound_covariance_is_left_alone() {
        let (t, mut p) = (transition(), started());
        for _ in 0..3000 {
            p.begin_prediction(&t);
            p.end_prediction(&t, &NOISE);
            p.begin_check();
            assert!(!p.check());
        }
    }

    #[test]
    fn an_indefinite_covariance_is_raised_until_it_is_positive_and_the_event_is_told() {
        let spoil: Vec<(usize, usize, f64)> = std::vec![(0, 1, 1.1 * 500.0 * 500.0), (3, 3, -0.1), (15, 15, -1e-3)];
        for (i, j, value) in spoil {
            let mut p = started();
            p.rows[i][j] = value;
            p.rows[j][i] = value;
            let before = dense(&p);
            p.begin_check();
            assert!(p.check());
            p.begin_check();
            assert!(!p.check(), "{i} {j}: still not positive");
            assert!((0..ESTIMATED).all(|k| p.at(k, k) >= before[(k, k)]));
        }
    }

    #[test]
    fn a_covariance_that_is_not_finite_starts_again() {
        let mut p = started();
        p.rows[4][20] = f64::NAN;
        assert!(p.check());
        assert_eq!(dense(&p), dense(&started()));
    }
}
