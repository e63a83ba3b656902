//! [`Covariance`] of all error states, kept in place as its factors, P = U·D·Uᵀ with U unit upper triangular (Bierman 1977).
//! What is kept this way cannot become indefinite, whatever is rounded: D is a sum of squares after a prediction, and what
//! was there times a fraction after a measurement. No roots are taken.
//!
//! A transition changes the first [`MOVING`] states; the constants of the sensors stay, and stand last, so that their block of
//! the factors is not touched by it. The prediction P⁺ = ΦPΦᵀ + Q is Φ on the columns of U, then the square block of the
//! moving states and the process noise beside it made triangular again (weighted Gram–Schmidt: Thornton 1976; Bierman 1977,
//! §VI.4).

use super::layout::{ALL, ATTITUDE, AXES, Full, LOG_DENSITY, MOVING, Moving, VELOCITY};
use super::measurement::Sensitivity;
use super::transition::Transition;

/// Position and velocity, whose covariance is told to others.
const TOLD: usize = 2 * AXES;
/// Its elements, lower triangle row by row.
const TOLD_ELEMENTS: usize = TOLD * (TOLD + 1) / 2;

/// Columns of the moving states and of the process noise beside them. Attitude and log-density come first, because a
/// transition leaves their part of U triangular: each row then is zero beyond the columns of the rows below it and its own.
///
/// ```text
/// log-density, its noise, φz, its noise, φy, its noise, φx, its noise │ r, v │ noises of vz … vx, rz … rx
/// ```
const WIDE: usize = 2 * MOVING;
/// Columns of attitude and log-density with their noises.
const STILL: usize = 2 * (MOVING - TOLD);

/// Where moving state `i` stands in the wide matrix.
const fn wide_column(i: usize) -> usize {
    if i < TOLD { STILL + i } else { 2 * (MOVING - 1 - i) }
}

/// Where the noise of moving state `i` stands, the last column in which row `i` is not zero before the rows above it are taken.
const fn noise_column(i: usize) -> usize {
    if i < TOLD { WIDE - 1 - i } else { wide_column(i) + 1 }
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
    /// U, column by column; the unit diagonal and the zeros below it are there.
    columns: [Full; ALL],
    /// D.
    weights: Full,
    /// Variances at the start.
    start: Full,
    /// Between the slices of a prediction: Φ·U of the moving states, row by row, and room for the process noise.
    wide: [[f64; WIDE]; MOVING],
}

impl Default for Covariance {
    fn default() -> Self {
        Self::none()
    }
}

impl Covariance {
    /// Nothing known and nothing unknown, before the start.
    pub const fn none() -> Self {
        Self { columns: [[0.0; ALL]; ALL], weights: [0.0; ALL], start: [0.0; ALL], wide: [[0.0; WIDE]; MOVING] }
    }

    /// Starts from uncorrelated standard deviations of all states.
    pub fn start(&mut self, sigmas: &Full) {
        for (variance, sigma) in self.start.iter_mut().zip(sigmas) {
            *variance = sigma * sigma;
        }
        self.restart();
    }

    /// Back to the uncorrelated covariance of the start.
    fn restart(&mut self) {
        self.weights = self.start;
        for (j, column) in self.columns.iter_mut().enumerate() {
            for (i, element) in column.iter_mut().enumerate() {
                *element = if i == j { 1.0 } else { 0.0 };
            }
        }
    }

    /// First half of the prediction P⁺ = ΦPΦᵀ + Q: Φ on the columns of U, those of the sensors in place, those of the moving
    /// states into the wide matrix. Until the second half, the covariance is neither that before nor that after.
    #[inline(never)]
    pub fn begin_prediction(&mut self, transition: &Transition) {
        let (moving, constant) = self.columns.split_at_mut(MOVING);
        for (j, column) in moving.iter().enumerate() {
            let predicted = transition.apply_moving(column);
            for (row, element) in self.wide.iter_mut().zip(predicted) {
                row.get_mut(wide_column(j)).into_iter().for_each(|place| *place = element);
            }
        }
        for column in constant {
            let predicted = transition.apply(column);
            for (place, element) in column.iter_mut().zip(predicted) {
                *place = element;
            }
        }
    }

    /// Second half. False when the result is not finite, and was restarted.
    pub fn end_prediction(&mut self, transition: &Transition, noise: &ProcessNoise) -> bool {
        self.triangularize(noise, transition.elapsed_s);
        self.is_finite() || {
            self.restart();
            false
        }
    }

    /// Replaces the factors of the moving states by those of W·D·Wᵀ, W = [Φ·U, G], from the last row to the first. A row has an
    /// even number of columns taken, the one too many being zero.
    #[inline(never)]
    fn triangularize(&mut self, noise: &ProcessNoise, t: f64) {
        let weights = self.lay_out(noise, t);
        let mut weighted = [0.0; WIDE];
        for j in (0..MOVING).rev() {
            let Some((above, [row, ..])) = self.wide.split_at_mut_checked(j) else { continue };
            let (Some(column), Some(kept)) = (self.columns.get_mut(j), self.weights.get_mut(j)) else { continue };
            let pairs = noise_column(j) / 2 + 1;
            let mut square = 0.0;
            for ((v, w), d) in weighted.iter_mut().zip(&*row).zip(&weights).take(2 * pairs) {
                *v = d * w;
                square += *v * w;
            }
            let is_known = square < f64::MIN_POSITIVE;
            *kept = if is_known { 0.0 } else { square };
            let inverse = if is_known { 0.0 } else { 1.0 / square };
            for (element, other) in column.iter_mut().zip(above) {
                *element = dot(other, &weighted, pairs) * inverse;
                subtract(other, *element, row, pairs);
            }
        }
    }

    /// Lays the process noise beside the rows and gives the weights of all columns. White noise integrated over the window of
    /// `t` seconds is velocity q, position q·t²/3, between them q·t/2: a column (t/2, 1) of weight q, and q·t²/12 for the
    /// position alone.
    fn lay_out(&mut self, noise: &ProcessNoise, t: f64) -> [f64; WIDE] {
        let mut weights = [0.0; WIDE];
        for (i, (row, d)) in self.wide.iter_mut().zip(&self.weights).enumerate() {
            let own = noise_column(i);
            let variance = match i {
                LOG_DENSITY => noise.log_density,
                ATTITUDE.. => noise.attitude,
                VELOCITY.. => noise.velocity,
                _ => noise.velocity * (t * t / 12.0),
            };
            let mut put = |column: usize, element| row.get_mut(column).into_iter().for_each(|place| *place = element);
            for k in 0..MOVING {
                put(noise_column(k), if k == i { 1.0 } else { 0.0 });
            }
            if i < VELOCITY {
                put(noise_column(VELOCITY + i), 0.5 * t);
            }
            for (column, weight) in [(wide_column(i), *d), (own, variance)] {
                weights.get_mut(column).into_iter().for_each(|place| *place = weight);
            }
        }
        weights
    }

    /// Whether D is, and what of U a prediction changes and D does not show. What is not finite elsewhere comes into it with
    /// the next.
    fn is_finite(&self) -> bool {
        let constant = self.columns.iter().skip(MOVING);
        sum(&self.weights).is_finite()
            && constant.fold(0.0, |total, column| total + sum(column.get(..MOVING).unwrap_or_default())).is_finite()
    }

    /// f = Uᵀ·h, and the variance fᵀ·D·f of h·x.
    #[inline(never)]
    pub(super) fn whiten(&self, h: &Sensitivity, f: &mut Full) -> f64 {
        let mut variance = 0.0;
        for ((element, column), d) in f.iter_mut().zip(&self.columns).zip(&self.weights) {
            let moved = h.along(column);
            *element = moved;
            variance += moved * (d * moved);
        }
        if !h.depends_on_air() {
            return variance;
        }
        variance = 0.0;
        for ((element, column), d) in f.iter_mut().zip(&self.columns).zip(&self.weights) {
            *element += h.in_air(column);
            variance += *element * (d * *element);
        }
        variance
    }

    /// Takes in a measurement with white noise of variance `r` by the gain of least variance, and adds u = P·h, as P was, to
    /// `u`, which is zero, so that the gain is u/s. Bierman's update (Bierman 1977, §V.3), three columns at a time: what has
    /// been found of u is then loaded and stored a third as often.
    #[inline(never)]
    pub(super) fn reduce(&mut self, f: &Full, r: f64, u: &mut Full) {
        const { assert!(ALL.is_multiple_of(3)) };
        let mut sum = r;
        let (columns, _) = self.columns.as_chunks_mut::<3>();
        let (weights, _) = self.weights.as_chunks_mut::<3>();
        let (f, _) = f.as_chunks::<3>();
        for (k, (([a, b, c], [da, db, dc]), [fa, fb, fc])) in columns.iter_mut().zip(weights).zip(f).enumerate() {
            let (va, ta) = share(da, *fa, &mut sum);
            let (vb, tb) = share(db, *fb, &mut sum);
            let (vc, tc) = share(dc, *fc, &mut sum);
            for (((a, b), c), u) in a.iter_mut().zip(b).zip(c).zip(&mut *u).take(3 * (k + 1)) {
                let (old_a, old_b, old_c, u0) = (*a, *b, *c, *u);
                let u1 = u0 + va * old_a;
                let u2 = u1 + vb * old_b;
                *a = old_a + ta * u0;
                *b = old_b + tb * u1;
                *c = old_c + tc * u2;
                *u = u2 + vc * old_c;
            }
        }
    }

    /// Covariance of position and velocity, lower triangle row by row, and the variances of all moving states.
    #[inline(never)]
    pub fn told(&self) -> ([f64; TOLD_ELEMENTS], Moving) {
        // In three passes, so that the sums of each stay in registers.
        let [mut rr, mut vv] = [[0.0; AXES * (AXES + 1) / 2]; 2];
        let (mut vr, mut attitude, mut log_density) = ([[0.0; AXES]; AXES], [0.0; AXES], 0.0);
        for ([x, y, z, _, _, _, p, q, r, ..], d) in self.columns.iter().zip(&self.weights) {
            add_squares(&mut rr, [*x, *y, *z], *d);
            for (sum, part) in attitude.iter_mut().zip([p, q, r]) {
                *sum += d * (part * part);
            }
        }
        for ([x, y, z, u, v, w, ..], d) in self.columns.iter().zip(&self.weights) {
            for (row, velocity) in vr.iter_mut().zip([u, v, w]) {
                let scaled = d * velocity;
                for (sum, position) in row.iter_mut().zip([x, y, z]) {
                    *sum += scaled * position;
                }
            }
        }
        for ([_, _, _, u, v, w, _, _, _, density, ..], d) in self.columns.iter().zip(&self.weights) {
            add_squares(&mut vv, [*u, *v, *w], *d);
            log_density += d * (density * density);
        }
        let ([xx, yx, yy, zx, zy, zz], [uu, vu, v2, wu, wv, ww]) = (rr, vv);
        let ([[ux, uy, uz], [vx, vy, vz], [wx, wy, wz]], [pp, qq, r2]) = (vr, attitude);
        let lower = [xx, yx, yy, zx, zy, zz, ux, uy, uz, uu, vx, vy, vz, vu, v2, wx, wy, wz, wu, wv, ww];
        (lower, [xx, yy, zz, uu, v2, ww, pp, qq, r2, log_density])
    }
}

/// Product of the first elements, two at a time.
#[inline(always)]
fn dot(x: &[f64; WIDE], y: &[f64; WIDE], pairs: usize) -> f64 {
    let mut sum = 0.0;
    for ([a, b], [c, d]) in x.as_chunks::<2>().0.iter().zip(y.as_chunks::<2>().0).take(pairs) {
        sum += a * c;
        sum += b * d;
    }
    sum
}

/// Takes `factor` times the first elements of `y` from those of `x`.
#[inline(always)]
fn subtract(x: &mut [f64; WIDE], factor: f64, y: &[f64; WIDE], pairs: usize) {
    for ([a, b], [c, d]) in x.as_chunks_mut::<2>().0.iter_mut().zip(y.as_chunks::<2>().0).take(pairs) {
        *a -= factor * c;
        *b -= factor * d;
    }
}

/// Adds d·x·xᵀ to a lower triangle, row by row.
#[inline(always)]
fn add_squares(lower: &mut [f64; AXES * (AXES + 1) / 2], [x, y, z]: [f64; AXES], d: f64) {
    let ([xx, yx, yy, zx, zy, zz], [dx, dy, dz]) = (*lower, [d * x, d * y, d * z]);
    *lower = [xx + dx * x, yx + dy * x, yy + dy * y, zx + dz * x, zy + dz * y, zz + dz * z];
}

/// What a column has to do with a measurement: its weight becomes that after it, and `sum`, the variance of the measurement
/// from noise and columns so far, takes the column in. Gives v = d·f, which the column counts for in P·h, and how far it is
/// turned towards what has been found of P·h: not at all as long as there is neither noise nor variance, for that is zero then.
#[inline(always)]
fn share(d: &mut f64, f: f64, sum: &mut f64) -> (f64, f64) {
    let (v, before) = (*d * f, *sum);
    *sum += v * f;
    if *sum > 0.0 {
        *d *= before / *sum;
    }
    (v, if before > 0.0 { -f / before } else { 0.0 })
}

/// Out of line, because unrolled for every column it would be kilobytes.
#[inline(never)]
fn sum(numbers: &[f64]) -> f64 {
    numbers.iter().sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::frames::{Rot, Vec3};
    use crate::nav::filter::transition::FrameStep;
    use crate::nav::strapdown::{Increments, Nominal, Strapdown};
    use crate::planet::MARS;
    use proptest::prelude::*;
    use std::boxed::Box;

    impl Covariance {
        /// Both halves.
        pub fn predict(&mut self, transition: &Transition, noise: &ProcessNoise) -> bool {
            self.begin_prediction(transition);
            self.end_prediction(transition, noise)
        }
    }

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
        let u = Dense::from_fn(|i, j| p.columns[j][i]);
        u * Dense::from_diagonal(&p.weights.into()) * u.transpose()
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
            p.predict(&t, &NOISE);
            let found = dense(&p);
            for i in 0..ALL {
                for j in 0..ALL {
                    let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
                    assert!((found[(i, j)] - expected[(i, j)]).abs() <= 1e-12 * scale, "{i} {j}");
                }
            }
        }
    }

    /// Unit upper triangular, no weight negative, all finite.
    fn is_factored(p: &Covariance) -> bool {
        let unit = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        let triangular = (0..ALL).all(|j| (j..ALL).all(|i| p.columns[j][i] == unit(i, j)));
        let finite = p.columns.iter().flatten().chain(&p.weights).all(|x| x.is_finite());
        triangular && finite && p.weights.iter().all(|d| *d >= 0.0)
    }

    fn measure(p: &mut Covariance, h: &Full, variance: f64) -> Full {
        let f = core::array::from_fn(|j| (0..ALL).map(|i| h[i] * p.columns[j][i]).sum());
        let mut u = [0.0; ALL];
        p.reduce(&f, variance, &mut u);
        u
    }

    proptest! {
        // Sensitivities and noises far beyond those of any sensor, steps at random: what is kept stays a factor.
        #[test]
        fn no_measurements_and_predictions_make_the_covariance_indefinite(
            steps in prop::collection::vec(
                (prop::array::uniform27(-1.0..1.0f64), -12.0..6.0f64, -15.0..3.0f64, any::<bool>()), 1..60
            )
        ) {
            let (t, mut p) = (transition(), started());
            for (direction, sensitive, noise, predicts) in steps {
                let h = direction.map(|x| x * 10f64.powf(sensitive));
                let u = measure(&mut p, &h, 10f64.powf(noise));
                prop_assert!(u.iter().all(|x| x.is_finite()));
                prop_assert!(is_factored(&p));
                if predicts {
                    prop_assert!(p.predict(&t, &NOISE));
                    prop_assert!(is_factored(&p));
                }
            }
        }

        #[test]
        fn a_measurement_of_a_state_known_exactly_teaches_nothing(k in 0..ALL, noise in 0.0..1.0f64) {
            let mut p = started();
            let (mut h, mut known) = ([0.0; ALL], [0.0; ALL]);
            h[k] = 1.0;
            (0..ALL).filter(|i| *i != k).for_each(|i| known[i] = p.weights[i].sqrt());
            p.start(&known);
            let before = dense(&p);
            prop_assert_eq!(measure(&mut p, &h, noise), [0.0; ALL]);
            prop_assert_eq!(dense(&p), before);
        }
    }

    /// Ranges a million times better than the knowledge, in nearly the same direction: P − u·uᵀ/s in double precision is no
    /// covariance any more, the factors are, and know what is to be known.
    #[test]
    fn where_the_short_form_loses_positive_definiteness_the_factors_keep_it() {
        let (mut p, mut short) = (started(), dense(&started()));
        let mut short_was_lost = false;
        for k in 0..40 {
            let mut h: Full = [0.0; ALL];
            (h[0], h[1], h[2]) = (1.0, 1.0 + 1e-7 * f64::from(k), 1.0 - 2e-7 * f64::from(k));
            measure(&mut p, &h, 1e-12);
            let row = nalgebra::SVector::<f64, ALL>::from(h);
            let u = short * row;
            short -= u * u.transpose() / ((row.transpose() * u)[0] + 1e-12);
            short_was_lost |= nalgebra::Cholesky::new(short.fixed_resize::<3, 3>(0.0)).is_none();
            assert!(is_factored(&p));
        }
        assert!(short_was_lost);
        let known = p.whiten(&Sensitivity { position: [1.0; 3], ..Sensitivity::default() }, &mut [0.0; ALL]);
        assert!(known < 1e-9, "{known} m² of the sum measured forty times");
    }

    #[test]
    fn what_is_told_is_the_covariance() {
        let (t, mut p) = (transition(), started());
        for _ in 0..50 {
            p.predict(&t, &NOISE);
        }
        let (full, (lower, variances)) = (dense(&p), p.told());
        let order = (0..TOLD).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for (found, (i, j)) in lower.iter().zip(order) {
            assert!((found - full[(i, j)]).abs() <= 1e-13 * (full[(i, i)] * full[(j, j)]).sqrt(), "{i} {j}");
        }
        for (i, found) in variances.iter().enumerate() {
            assert!((found - full[(i, i)]).abs() <= 1e-13 * full[(i, i)], "{i}");
        }
    }

    #[test]
    fn a_sound_covariance_is_left_alone() {
        let (t, mut p) = (transition(), started());
        for _ in 0..3000 {
            assert!(p.predict(&t, &NOISE) && is_factored(&p));
        }
    }

    #[test]
    fn a_covariance_that_is_not_finite_starts_again() {
        let spoils: [fn(&mut Covariance); 5] = [
            |p| p.columns[20][4] = f64::NAN,
            |p| p.columns[8][1] = f64::INFINITY,
            |p| p.columns[26][24] = f64::NAN,
            |p| p.weights[7] = f64::INFINITY,
            |p| p.columns[5][3] = f64::MAX,
        ];
        for spoil in spoils {
            let mut p = started();
            spoil(&mut p);
            assert!(!p.predict(&transition(), &NOISE));
            assert_eq!(dense(&p), dense(&started()));
        }
    }
}
