//! [`Covariance`] of all error states, kept in place.
//!
//! A transition changes the first [`MOVING`] of them; the constants of the sensors stay. The prediction P⁺ = ΦPΦᵀ + Q is
//! one operator, [`Transition::apply`], first on every column, then on every row that it changes: two slices of work for two
//! frames.

use super::layout::{ALL, ATTITUDE, AXES, Full, LOG_DENSITY, MOVING, POSITION, VELOCITY};
use super::transition::Transition;

/// A pivot below this fraction of its variance counts as not positive.
const RELATIVE_PIVOT: f64 = 1e-12;
/// It is then raised to this many times the limit, so that rounding does not bring it back below.
const RAISE: f64 = 10.0;

/// Columns that the first frame of a prediction takes. The second, with the rest, the rows and the checks, costs a little less:
/// guidance, which begins its cycle in the frame before the first, has more to do in it.
const EARLY_COLUMNS: usize = 25;

/// Elements that one check eliminates at most: as many as the first pivot takes.
const ELEMENTS_PER_CHECK: usize = elements(0);
/// Checks until all pivots have had their turn, the one that takes the copy among them.
pub const CHECKS_PER_SWEEP: usize = checks_per_sweep();

/// Elements of the upper triangle beyond a pivot.
const fn elements(pivot: usize) -> usize {
    let beyond = ALL - 1 - pivot;
    beyond * (beyond + 1) / 2
}

/// The pivot with which the next check begins when one begins with `pivot`.
const fn pivot_after(pivot: usize) -> usize {
    let (mut next, mut room) = (pivot, ELEMENTS_PER_CHECK);
    while next < ALL && elements(next) <= room {
        room -= elements(next);
        next += 1;
    }
    next
}

const fn checks_per_sweep() -> usize {
    let (mut checks, mut pivot) = (1, 0);
    while pivot < ALL {
        pivot = pivot_after(pivot);
        checks += 1;
    }
    checks
}

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

/// Covariance of all error states.
#[derive(Clone, Debug)]
pub struct Covariance {
    /// Upper triangle; what stands below the diagonal means nothing.
    rows: [[f64; ALL]; ALL],
    /// Variances at the start, the scale of what is small.
    start: Full,
    /// Upper triangle of what is left to factorise of a copy.
    work: [[f64; ALL]; ALL],
    /// Where the factorisation goes on …
    next_pivot: usize,
    /// … unless it is done, and begins again with a new copy.
    is_sweeping: bool,
}

impl Default for Covariance {
    fn default() -> Self {
        Self::none()
    }
}

impl Covariance {
    /// Nothing known and nothing unknown, before the start.
    pub const fn none() -> Self {
        Self { rows: [[0.0; ALL]; ALL], start: [0.0; ALL], work: [[0.0; ALL]; ALL], next_pivot: 0, is_sweeping: false }
    }
}

#[allow(clippy::indexing_slicing, clippy::needless_range_loop)] // loops over the constant shapes of fixed arrays
impl Covariance {
    /// Starts from uncorrelated standard deviations of all states.
    pub fn start(&mut self, sigmas: &Full) {
        for i in 0..ALL {
            self.start[i] = sigmas[i] * sigmas[i];
        }
        self.restart();
    }

    /// An element.
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        let (i, j) = if i <= j { (i, j) } else { (j, i) };
        self.rows.get(i).and_then(|row| row.get(j)).copied().unwrap_or(0.0)
    }

    /// First half of the prediction: Φ on most of the columns.
    pub fn begin_prediction(&mut self, transition: &Transition) {
        self.predict_columns(0, EARLY_COLUMNS, transition);
    }

    /// Φ on columns, which have to come in ascending order. Below the diagonal a column is the row of the same number, which
    /// there still is that of the start, because those columns come later.
    #[inline(never)]
    fn predict_columns(&mut self, first: usize, end: usize, transition: &Transition) {
        for j in first..end {
            let mut column: Full = self.rows[j];
            for i in 0..j {
                column[i] = self.rows[i][j];
            }
            let predicted = transition.apply(&column);
            for i in 0..MOVING {
                self.rows[i][j] = predicted[i];
            }
        }
    }

    /// Second half: Φ on the other columns and on the rows that it changes, and the process noise.
    pub fn end_prediction(&mut self, transition: &Transition, noise: &ProcessNoise) {
        self.predict_columns(EARLY_COLUMNS, ALL, transition);
        for i in 0..MOVING {
            let predicted = transition.apply(&self.rows[i]);
            self.rows[i][..MOVING].copy_from_slice(&predicted);
        }
        self.add(noise, transition.elapsed_s);
    }

    /// White noise integrated over the window: velocity q, position q·T²/3, between them q·T/2.
    fn add(&mut self, noise: &ProcessNoise, t: f64) {
        for k in 0..AXES {
            let (r, v, a) = (POSITION + k, VELOCITY + k, ATTITUDE + k);
            self.rows[v][v] += noise.velocity;
            self.rows[r][v] += noise.velocity * (0.5 * t);
            self.rows[r][r] += noise.velocity * (t * t / 3.0);
            self.rows[a][a] += noise.attitude;
        }
        self.rows[LOG_DENSITY][LOG_DENSITY] += noise.log_density;
    }

    /// Covariance of all states with the scalar h·x, for an `h` that touches only the listed `columns`.
    pub(super) fn times(&self, columns: &[(usize, f64)], out: &mut Full) {
        *out = [0.0; ALL];
        for &(j, h) in columns {
            let Some((above, [row, ..])) = self.rows.split_at_checked(j) else { continue };
            let (Some(row), Some(right)) = (row.get(j..), out.get_mut(j..)) else { continue };
            if h == 0.0 {
                continue;
            }
            for (u, p) in right.iter_mut().zip(row) {
                *u += p * h;
            }
            for (u, row) in out.iter_mut().zip(above) {
                *u += row.get(j).copied().unwrap_or(0.0) * h;
            }
        }
    }

    /// Subtracts u·uᵀ/s (u from [`Covariance::times`]).
    pub(super) fn reduce(&mut self, u: &Full, s: f64) {
        let inverse = 1.0 / s;
        for (i, row) in self.rows.iter_mut().enumerate() {
            let (Some(row), Some(right)) = (row.get_mut(i..), u.get(i..)) else { continue };
            let Some(gain) = right.first().map(|u| u * inverse) else { continue };
            for (p, u) in row.iter_mut().zip(right) {
                *p -= gain * u;
            }
        }
    }

    /// Restores the covariance of an epoch where it is plainly unsound; true when it did. Numbers that are not finite, or so
    /// large that a row's sum is not, restart it; a variance that is not positive begins again at that of the start. Only the
    /// rows of what moves are summed: what is not finite elsewhere comes into them with the next reading.
    pub fn check(&mut self) -> bool {
        let upper = |(i, row): (usize, &Full)| sum(row.get(i..).unwrap_or_default()).is_finite();
        let mut mended = !self.rows.iter().take(MOVING).enumerate().all(upper);
        if mended {
            self.restart();
        }
        for k in 0..ALL {
            let lost = self.rows[k][k] < RELATIVE_PIVOT * self.start[k];
            if lost {
                self.rows[k][k] = self.start[k];
            }
            mended |= lost;
        }
        self.is_sweeping &= !mended;
        mended
    }

    /// Looks for a covariance that is not positive, over [`CHECKS_PER_SWEEP`] epochs, so that no frame bears it all: a copy is
    /// taken and factorised, some pivots in each, P = L D Lᵀ. By how much a pivot must be raised above [`RELATIVE_PIVOT`] of
    /// its variance, the present variance is raised too (Gill and Murray 1974), so that what is restored is no smaller; the next
    /// sweep looks again. True when one was.
    pub fn sweep(&mut self) -> bool {
        if !self.is_sweeping {
            self.begin_sweep();
            return false;
        }
        let next = pivot_after(self.next_pivot);
        let mut mended = false;
        for pivot in self.next_pivot..next {
            mended |= self.eliminate(pivot);
        }
        self.next_pivot = next;
        self.is_sweeping = next < ALL;
        mended
    }

    /// Takes the copy that is factorised.
    fn begin_sweep(&mut self) {
        for (i, (to, from)) in self.work.iter_mut().zip(&self.rows).enumerate() {
            let (Some(to), Some(from)) = (to.get_mut(i..), from.get(i..)) else { continue };
            to.copy_from_slice(from);
        }
        self.next_pivot = 0;
        self.is_sweeping = true;
    }

    /// One pivot of the factorisation; true when it had to be raised.
    fn eliminate(&mut self, k: usize) -> bool {
        let (Some((above, below)), Some(present)) = (self.work.split_at_mut_checked(k + 1), self.rows.get_mut(k))
        else {
            return false;
        };
        let (Some(pivotal), Some(variance)) = (above.last(), present.get_mut(k)) else { return false };
        let Some(&(mut pivot)) = pivotal.get(k) else { return false };
        let floor = RELATIVE_PIVOT * *variance;
        let raised = pivot < floor;
        if raised {
            *variance += RAISE * floor - pivot;
            pivot = RAISE * floor;
        }
        if pivot <= 0.0 {
            return raised; // a state without any uncertainty: its row is zero
        }
        let inverse = 1.0 / pivot;
        for (row, (beyond, correlated)) in below.iter_mut().zip(pivotal.iter().enumerate().skip(k + 1)) {
            let factor = correlated * inverse;
            let (Some(left), Some(taken)) = (row.get_mut(beyond..), pivotal.get(beyond..)) else { continue };
            for (left, taken) in left.iter_mut().zip(taken) {
                *left -= factor * taken;
            }
        }
        raised
    }

    /// Back to the uncorrelated covariance of the start.
    fn restart(&mut self) {
        for i in 0..ALL {
            self.rows[i] = [0.0; ALL];
            self.rows[i][i] = self.start[i];
        }
        self.is_sweeping = false;
    }
}

/// Out of line, because unrolled for every row of the triangle it would be kilobytes.
#[inline(never)]
fn sum(row: &[f64]) -> f64 {
    row.iter().sum()
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

    /// The full matrix of the transition; the constants stay.
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
        Dense::from_fn(|i, j| p.at(i, j))
    }

    fn looked_at(p: &mut Covariance) -> bool {
        let mended = p.check();
        p.sweep() | mended
    }

    /// Standard deviations of an entry.
    pub fn started() -> Box<Covariance> {
        let mut sigmas: Full = [0.0; ALL];
        let blocks: [(usize, f64, usize); 11] = [
            (0, 500.0, 3),
            (3, 0.3, 3),
            (6, 5e-4, 3),
            (9, 0.08, 1),
            (10, 1e-3, 3),
            (13, 5e-6, 3),
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
            expected[(9, 9)] += NOISE.log_density;
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
            assert!(!looked_at(&mut p));
        }
    }

    #[test]
    fn an_indefinite_covariance_is_raised_until_it_is_positive_and_the_event_is_told() {
        let spoil: Vec<(usize, usize, f64)> = std::vec![(0, 1, 1.1 * 500.0 * 500.0), (3, 3, -0.1), (9, 9, -1e-3)];
        for (i, j, value) in spoil {
            let mut p = started();
            p.rows[i][j] = value;
            let before = dense(&p);
            assert!((0..CHECKS_PER_SWEEP).any(|_| looked_at(&mut p)), "{i} {j}: not found within a sweep");
            for _ in 0..CHECKS_PER_SWEEP {
                looked_at(&mut p);
            }
            assert!((0..CHECKS_PER_SWEEP).all(|_| !looked_at(&mut p)), "{i} {j}: still not positive");
            assert!(nalgebra::Cholesky::new(dense(&p)).is_some());
            assert!((0..ALL).all(|k| p.at(k, k) >= before[(k, k)]));
        }
    }

    #[test]
    fn a_covariance_that_is_not_finite_starts_again() {
        let mut p = started();
        p.rows[4][20] = f64::NAN;
        assert!(looked_at(&mut p));
        assert_eq!(dense(&p), dense(&started()));
    }
}
