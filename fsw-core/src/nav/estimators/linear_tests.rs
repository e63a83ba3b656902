//! The linearised kernel against dense formulas, exact covariances and the paper's own recursion.

use std::vec::Vec;

use super::super::joint::{Block, Layout};
use super::super::models::{Noise, Quantity, Sensor, Spherical};
use super::*;
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;

const N: usize = 3;
const JOINT: usize = 2 * N;
const SEEN: usize = 2;
type Square = SMatrix<f64, N, N>;
type Rows = SMatrix<f64, SEEN, N>;
type Gains = SMatrix<f64, N, SEEN>;
type Double = SMatrix<f64, JOINT, JOINT>;

const OPEN: f64 = f64::INFINITY;

/// One step of a random time-varying system.
#[derive(Clone, Debug)]
struct Step {
    phi: Square,
    h: Rows,
    q: SVector<f64, N>,
    r: SVector<f64, SEEN>,
    z: SVector<f64, SEEN>,
}

fn steps(count: usize) -> impl Strategy<Value = Vec<Step>> {
    let numbers = prop::collection::vec(-1.0..1.0f64, N * N + SEEN * N + N + 2 * SEEN);
    prop::collection::vec(numbers, count).prop_map(|all| {
        let step = |n: &Vec<f64>| Step {
            // A step of a flight is close to the identity.
            phi: Square::identity() + 0.2 * Square::from_column_slice(&n[..9]),
            h: Rows::from_column_slice(&n[9..15]) + Rows::identity(),
            q: SVector::<f64, N>::from_column_slice(&n[15..18]).map(|x| 0.1 + 0.1 * x * x),
            r: SVector::<f64, SEEN>::from_column_slice(&n[18..20]).map(|x| 0.2 + x * x),
            z: SVector::<f64, SEEN>::from_column_slice(&n[20..22]),
        };
        all.iter().map(step).collect()
    })
}

fn largest<const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> f64 {
    m.iter().fold(0.0, |largest, x| if x.abs() > largest { x.abs() } else { largest })
}

fn covariance<const J: usize>(filter: &Linear<J>) -> SMatrix<f64, J, J> {
    filter.factor() * filter.factor().transpose()
}

fn block(filter: &Linear<JOINT>) -> Square {
    covariance(filter).fixed_view::<N, N>(0, 0).into_owned()
}

const P0: f64 = 2.0;

fn self_calibrating(rho: f64) -> Linear<JOINT> {
    let gains = core::array::from_fn(|i| if i < N { Gain::Optimal } else { Gain::Tied { to: i - N, factor: rho } });
    let sigmas = core::array::from_fn(|i| if i < N { f64::sqrt(P0) } else { 0.0 });
    Linear::new([0.0; JOINT], &sigmas, gains).unwrap()
}

/// x' = Φ x + d, d' = d.
fn advance(filter: &mut Linear<JOINT>, step: &Step) {
    let x = SVector::<f64, JOINT>::from(*filter.state());
    let moved = step.phi * x.fixed_rows::<N>(0) + x.fixed_rows::<N>(N);
    let mut transition = Transition { next: *filter.state(), rows: [[0.0; JOINT]; N], persistence: [1.0; JOINT] };
    for i in 0..N {
        transition.next[i] = moved[i];
        (0..N).for_each(|j| transition.rows[i][j] = step.phi[(i, j)]);
        transition.rows[i][N + i] = 1.0;
    }
    filter.transport(&transition).unwrap();
    let mut sigmas = [0.0; JOINT];
    (0..N).for_each(|i| sigmas[i] = step.q[i].sqrt());
    filter.add_independent_noise(&sigmas).unwrap();
}

fn measure(filter: &mut Linear<JOINT>, step: &Step) {
    let x = SVector::<f64, N>::from_column_slice(&filter.state()[..N]);
    let expected = step.h * x;
    for m in 0..SEEN {
        let mut row = [0.0; JOINT];
        (0..N).for_each(|j| row[j] = step.h[(m, j)]);
        filter.absorb(step.z[m] - expected[m], &row, step.r[m], OPEN).unwrap();
    }
}

/// Step k counts from 1; the SEKF starts at k = 3.
fn run_step(filter: &mut Linear<JOINT>, k: usize, step: &Step) {
    if k < 3 {
        filter.forget(N, N);
    }
    advance(filter, step);
    measure(filter, step);
}

fn kalman_gain(p: &Square, step: &Step) -> Gains {
    let s = step.h * p * step.h.transpose() + Matrix2::from_diagonal(&step.r);
    p * step.h.transpose() * s.try_inverse().unwrap()
}
type Matrix2 = SMatrix<f64, SEEN, SEEN>;

/// The error of the filter of P1 eq. 11 as a linear function of every independent unit source: initial errors, process and
/// measurement noises. Its covariance is exact: no recursion for covariances is in it.
struct Exact {
    now: Vec<SVector<f64, N>>,
    before: Vec<SVector<f64, N>>,
    noise_before: Vec<SVector<f64, N>>,
    phi_before: Square,
}

impl Exact {
    fn new() -> Self {
        let now = (0..N).map(|i| SVector::from_fn(|j, _| if i == j { P0.sqrt() } else { 0.0 })).collect();
        Self { now, before: Vec::new(), noise_before: Vec::new(), phi_before: Square::zeros() }
    }

    fn step(&mut self, k: usize, step: &Step) -> Square {
        let zero = SVector::<f64, N>::zeros();
        let sources = self.now.len();
        let old = |of: &[SVector<f64, N>], at: usize| of.get(at).copied().unwrap_or(zero);
        let mut predicted: Vec<_> = (0..sources)
            .map(|at| {
                let (e, before, noise) = (self.now[at], old(&self.before, at), old(&self.noise_before, at));
                if k < 3 { step.phi * e } else { e + step.phi * e - self.phi_before * before - noise }
            })
            .collect();
        let mut noise = std::vec![zero; sources];
        for i in 0..N {
            let column = SVector::from_fn(|j, _| if i == j { step.q[i].sqrt() } else { 0.0 });
            predicted.push(column);
            noise.push(column);
        }
        let p = predicted.iter().fold(Square::zeros(), |p, e| p + e * e.transpose());
        let gain = kalman_gain(&p, step);
        let a = Square::identity() - gain * step.h;
        let mut now: Vec<_> = predicted.iter().map(|e| a * e).collect();
        (0..SEEN).for_each(|m| now.push(-gain.column(m).into_owned() * step.r[m].sqrt()));
        self.before = core::mem::replace(&mut self.now, now);
        (self.noise_before, self.phi_before) = (noise, step.phi);
        self.now.iter().fold(Square::zeros(), |p, e| p + e * e.transpose())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_covariance_of_the_self_calibrating_filter_is_exact(steps in steps(30)) {
        let (mut filter, mut exact) = (self_calibrating(1.0), Exact::new());
        for (k, step) in (1..).zip(&steps) {
            run_step(&mut filter, k, step);
            let expected = exact.step(k, step);
            // The bar of the project: 1e-12 of the largest element.
            let error = largest(&(block(&filter) - expected)) / largest(&expected);
            prop_assert!(error < 1e-12, "step {}: {}", k, error);
        }
    }

    #[test]
    fn the_joint_form_is_the_printed_recursion_from_its_exact_start(steps in steps(25)) {
        let mut filter = self_calibrating(1.0);
        let mut printed = Printed::new();
        for (k, step) in (1..).zip(&steps) {
            run_step(&mut filter, k, step);
            printed.step(k, step, Start::Exact);
            // Rounding grows in the printed form even when it is made symmetric in each step.
            let error = largest(&(block(&filter) - printed.p)) / largest(&printed.p);
            prop_assert!(error < 1e-9, "step {}: {}", k, error);
            for i in 0..N {
                prop_assert!((filter.state()[i] - printed.x[i]).abs() < 1e-9, "step {}", k);
            }
        }
    }

    #[test]
    fn the_start_that_the_paper_prints_is_another_covariance(steps in steps(4)) {
        let (mut filter, mut printed) = (self_calibrating(1.0), Printed::new());
        for (k, step) in (1..).zip(&steps) {
            run_step(&mut filter, k, step);
            printed.step(k, step, Start::Printed);
        }
        prop_assert!(largest(&(block(&filter) - printed.p)) > 1e-3 * largest(&printed.p));
    }

    #[test]
    fn with_a_ratio_of_zero_it_is_the_kalman_filter(steps in steps(20)) {
        let mut filter = self_calibrating(0.0);
        let (mut x, mut p) = (SVector::<f64, N>::zeros(), Square::identity() * P0);
        for (k, step) in (1..).zip(&steps) {
            run_step(&mut filter, k, step);
            p = step.phi * p * step.phi.transpose() + Square::from_diagonal(&step.q);
            let gain = kalman_gain(&p, step);
            x = step.phi * x;
            x += gain * (step.z - step.h * x);
            p = (Square::identity() - gain * step.h) * p;
            prop_assert!(largest(&(block(&filter) - p)) < 1e-12 * largest(&p));
            prop_assert!((0..N).all(|i| (filter.state()[i] - x[i]).abs() < 1e-12));
            prop_assert!((N..JOINT).all(|i| filter.state()[i].abs() < 1e-15));
        }
    }

    #[test]
    fn estimated_inputs_are_the_kalman_filter_of_the_joint_state(steps in steps(20)) {
        let sigmas = [1.0, 1.0, 1.0, 0.5, 0.5, 0.5];
        let mut filter = Linear::new([0.0; JOINT], &sigmas, [Gain::Optimal; JOINT]).unwrap();
        let mut p = Double::from_diagonal(&SVector::from(sigmas.map(|s| s * s)));
        for step in &steps {
            advance(&mut filter, step);
            measure(&mut filter, step);
            let (transition, q, h) = dense(step);
            p = transition * p * transition.transpose() + q;
            let s = h * p * h.transpose() + Matrix2::from_diagonal(&step.r);
            let gain = p * h.transpose() * s.try_inverse().unwrap();
            p -= gain * s * gain.transpose();
            prop_assert!(largest(&(covariance(&filter) - p)) < 1e-11 * largest(&p));
        }
    }

    #[test]
    fn considered_inputs_are_schmidts_filter(steps in steps(20)) {
        let sigmas = [1.0, 1.0, 1.0, 0.5, 0.5, 0.5];
        let gains = core::array::from_fn(|i| if i < N { Gain::Optimal } else { Gain::Considered });
        let mut filter = Linear::new([0.0; JOINT], &sigmas, gains).unwrap();
        // C = E[e bᵀ], b constant.
        let (mut p, mut c, b) = (Square::identity(), Square::zeros(), Square::identity() * 0.25);
        for step in &steps {
            advance(&mut filter, step);
            measure(&mut filter, step);
            p = step.phi * p * step.phi.transpose() + step.phi * c + c.transpose() * step.phi.transpose() + b
                + Square::from_diagonal(&step.q);
            c = step.phi * c + b;
            let gain = kalman_gain(&p, step);
            let a = Square::identity() - gain * step.h;
            (p, c) = (a * p, a * c);
            let found = covariance(&filter);
            prop_assert!(largest(&(block(&filter) - p)) < 1e-11 * largest(&p));
            prop_assert!(largest(&(found.fixed_view::<N, N>(0, N) - c)) < 1e-11 * largest(&p));
            prop_assert!(largest(&(found.fixed_view::<N, N>(N, N) - b)) < 1e-12 * largest(&p));
        }
    }

    #[test]
    fn no_measurement_makes_a_covariance_indefinite_or_a_number_infinite(
        start in prop::array::uniform6(-12.0..12.0f64),
        measurements in prop::collection::vec(
            (prop::array::uniform6(-1.0..1.0f64), -40.0..40.0f64, -40.0..20.0f64, any::<f64>()), 40),
        tied in 0..3usize
    ) {
        let gains = core::array::from_fn(|i| match (i < N, tied) {
            (true, _) | (_, 0) => Gain::Optimal,
            (_, 1) => Gain::Tied { to: i - N, factor: 1.0 },
            _ => Gain::Considered,
        });
        let mut filter = Linear::new([0.0; JOINT], &start.map(|exponent| 10f64.powf(exponent)), gains).unwrap();
        for (row, size, noise, innovation) in measurements {
            let before = filter.clone();
            let row = row.map(|h| h * 10f64.powf(size));
            if let Err(EstimatorError::BadVariance(_) | EstimatorError::NotFinite { part: Part::Measurement, .. }) =
                filter.absorb(innovation, &row, 10f64.powf(noise), OPEN)
            {
                prop_assert_eq!(&filter, &before);
            }
            prop_assert!(filter.state().iter().all(|x| x.is_finite()));
            prop_assert!(is_positive(&filter), "{}", filter.factor());
        }
    }
}

/// Every component finite, and no direction with a negative variance in the correlations.
fn is_positive(filter: &Linear<JOINT>) -> bool {
    let l = filter.factor();
    if !l.iter().all(|x| x.is_finite()) {
        return false;
    }
    let mut scaled = *l;
    for mut row in scaled.row_iter_mut() {
        let norm = row.norm();
        if norm > 0.0 {
            row /= norm;
        }
    }
    let correlations = scaled * scaled.transpose();
    // Rounding of the product and of the eigenvalues.
    correlations.symmetric_eigenvalues().iter().all(|x| *x > -1e-13)
}

fn dense(step: &Step) -> (Double, Double, SMatrix<f64, SEEN, JOINT>) {
    let (mut transition, mut q) = (Double::identity(), Double::zeros());
    transition.fixed_view_mut::<N, N>(0, 0).copy_from(&step.phi);
    transition.fixed_view_mut::<N, N>(0, N).copy_from(&Square::identity());
    q.fixed_view_mut::<N, N>(0, 0).copy_from(&Square::from_diagonal(&step.q));
    let mut h = SMatrix::<f64, SEEN, JOINT>::zeros();
    h.fixed_view_mut::<SEEN, N>(0, 0).copy_from(&step.h);
    (transition, q, h)
}

/// Where the printed recursion takes its first S from.
#[derive(Clone, Copy, PartialEq)]
enum Start {
    /// S₂ = A₂ Φ₁ P₁.
    Exact,
    /// S₁ = P₁ (P1 eq. 19).
    Printed,
}

/// P1 eq. 11, 12, 16 as printed, with P made symmetric in each step.
struct Printed {
    x: SVector<f64, N>,
    p: Square,
    moved_before: SVector<f64, N>,
    phi: [Square; 2],
    q: [Square; 2],
    a_before: Square,
    p_before: Square,
    s: Square,
}

impl Printed {
    fn new() -> Self {
        let zero = Square::zeros();
        Self {
            x: SVector::zeros(),
            p: Square::identity() * P0,
            moved_before: SVector::zeros(),
            phi: [zero; 2],
            q: [zero; 2],
            a_before: zero,
            p_before: zero,
            s: zero,
        }
    }

    /// With k the step, `phi[0]` is Φ_{k−2}, `phi[1]` Φ_{k−3}; `s` is S_{k−1}.
    fn step(&mut self, k: usize, step: &Step, start: Start) {
        let (one, q) = (Square::identity(), Square::from_diagonal(&step.q));
        let moved = step.phi * self.x;
        let sum = one + step.phi;
        let (x, p) = if k < 3 {
            (moved, step.phi * self.p * step.phi.transpose() + q)
        } else {
            let cross = sum * self.s * self.phi[0].transpose() + sum * self.a_before * self.q[0];
            let p = sum * self.p * sum.transpose() + self.phi[0] * self.p_before * self.phi[0].transpose()
                - cross
                - cross.transpose()
                + q
                + self.q[0];
            (moved + self.x - self.moved_before, p)
        };
        let gain = kalman_gain(&p, step);
        let a = one - gain * step.h;
        // S_k from S_{k−1}: eq. 16 a step later.
        self.s = match (k, start) {
            (1, _) => self.p,
            (2, Start::Exact) => a * step.phi * self.p,
            (2, Start::Printed) => {
                // S₁ = P₁ put into eq. 16.
                a * (sum * self.p - self.phi[0] * self.p.transpose() - self.q[0] * self.a_before.transpose())
            }
            _ => a * (sum * self.p - self.phi[0] * self.s.transpose() - self.q[0] * self.a_before.transpose()),
        };
        self.p_before = self.p;
        self.x = x + gain * (step.z - step.h * x);
        self.p = a * p * a.transpose() + gain * Matrix2::from_diagonal(&step.r) * gain.transpose();
        self.p = (self.p + self.p.transpose()) * 0.5;
        (self.phi, self.q) = ([step.phi, self.phi[0]], [q, self.q[0]]);
        (self.a_before, self.moved_before) = (a, moved);
    }
}

/// The scalar system Φ = H = 1 with its SEKF; `q` and `r` are variances.
fn scalar_step(filter: &mut Linear<2>, z: f64, q: f64, r: f64, seen: bool) -> f64 {
    let [x, d] = *filter.state();
    let transition = Transition { next: [x + d, d], rows: [[1.0, 1.0]], persistence: [1.0; 2] };
    filter.transport(&transition).unwrap();
    filter.add_independent_noise(&[q.sqrt(), 0.0]).unwrap();
    if !seen {
        return 0.0;
    }
    let before = filter.covariance(0, 0);
    filter.absorb(z - filter.state()[0], &[1.0, 0.0], r, OPEN).unwrap();
    before / (before + r)
}

fn scalar_filter() -> Linear<2> {
    Linear::new([0.0; 2], &[3.0, 0.0], [Gain::Optimal, Gain::Tied { to: 0, factor: 1.0 }]).unwrap()
}

#[test]
fn without_process_noise_the_gain_stays_at_two_thirds() {
    let mut filter = scalar_filter();
    let gain = (0..400).fold(0.0, |_, _| scalar_step(&mut filter, 0.0, 0.0, 4.0, true));
    assert!((gain - 2.0 / 3.0).abs() < 1e-9, "{gain}");
    // P = 2R/3, above the R/2 below which it never falls.
    assert!((filter.covariance(0, 0) - 4.0 * 2.0 / 3.0).abs() < 1e-8);
}

#[test]
fn a_step_of_the_input_rings_with_the_poles_of_the_gain() {
    let mut filter = scalar_filter();
    let gain = (0..400).fold(0.0, |_, _| scalar_step(&mut filter, 0.0, 0.0, 1.0, true));
    let errors: Vec<f64> = (1..20)
        .map(|k| {
            let truth = f64::from(k);
            scalar_step(&mut filter, truth, 0.0, 1.0, true);
            truth - filter.state()[0]
        })
        .collect();
    for e in errors.windows(3) {
        // e_k = 2(1−K) e_{k−1} − (1−K) e_{k−2}.
        assert!((e[2] - (1.0 - gain) * (2.0 * e[1] - e[0])).abs() < 1e-9);
    }
    let ratio = errors[18].abs().powf(1.0 / 18.0);
    // |z| = √(1−K) = 0.577; the phase of the last sample moves the root a little.
    assert!((ratio - (1.0 - gain).sqrt()).abs() < 0.06, "{ratio}");
}

#[test]
fn what_is_not_seen_goes_on_at_the_last_correction() {
    let mut filter = scalar_filter();
    for k in 0..10 {
        scalar_step(&mut filter, f64::from(k % 3), 0.1, 1.0, true);
    }
    let [x, d] = *filter.state();
    (0..5).for_each(|_| {
        scalar_step(&mut filter, 0.0, 0.1, 1.0, false);
    });
    assert!(d.abs() > 1e-3 && (filter.state()[0] - (x + 5.0 * d)).abs() < 1e-12);
}

#[test]
fn the_log_densities_of_scalars_sum_to_that_of_the_batch() {
    let step = Step {
        phi: Square::identity(),
        h: Rows::from_row_slice(&[1.0, 0.5, 0.0, 0.2, 1.0, -1.0]),
        q: SVector::repeat(0.1),
        r: SVector::from([0.3, 0.7]),
        z: SVector::from([0.9, -1.4]),
    };
    let mut filter = self_calibrating(0.0);
    let p = Square::identity() * P0;
    let mut found = 0.0;
    for m in 0..SEEN {
        let row = core::array::from_fn(|j| if j < N { step.h[(m, j)] } else { 0.0 });
        found += filter.absorb(step.z[m], &row, step.r[m], OPEN).unwrap().log_density();
    }
    let s = step.h * p * step.h.transpose() + Matrix2::from_diagonal(&step.r);
    let quadratic = (step.z.transpose() * s.try_inverse().unwrap() * step.z)[0];
    let expected = -0.5 * (quadratic + (s.determinant() * (2.0 * core::f64::consts::PI).powi(2)).ln());
    assert!((found - expected).abs() < 1e-13);
}

#[test]
fn beyond_the_gate_nothing_is_corrected() {
    let mut filter = scalar_filter();
    let before = filter.clone();
    let told = filter.absorb(100.0, &[1.0, 0.0], 1.0, 5.0).unwrap();
    assert!(!told.used && (told.variance - 10.0).abs() < 1e-12 && (told.value - 100.0).abs() < 1e-12);
    assert_eq!(filter, before);
}

#[test]
fn a_noise_that_is_not_positive_is_refused_by_its_value() {
    for noise in [0.0, -1.0, f64::NAN] {
        assert!(matches!(scalar_filter().absorb(1.0, &[1.0, 0.0], noise, OPEN), Err(EstimatorError::BadVariance(_))));
    }
}

#[test]
fn a_covariance_that_leaves_the_range_of_numbers_claims_nothing() {
    let mut filter = scalar_filter();
    let step = Transition { next: [1.0, 0.0], rows: [[1e200, 1e200]], persistence: [1e200; 2] };
    let failed = (0..3).find_map(|_| filter.transport(&step).err());
    assert!(matches!(failed, Some(EstimatorError::NotFinite { part: Part::Covariance, .. })));
    assert_eq!((filter.sigma(0), filter.sigma(1)), (UNKNOWN, UNKNOWN));
}

const WHOLE: usize = 17;

/// x, b, α and accelerometer bias: every block there is.
fn whole(model: &Spherical) -> Joint<'_, Spherical, 6, 2, 8> {
    let layout = Layout {
        input: Some((Block::constant(6), 2.0)),
        parameters: Some(Block { first: 12, persistence: 0.9 }),
        bias: Some(Block::constant(14)),
    };
    Joint { model, parameters: [0.0; 2], layout }
}

const STATE: [f64; WHOLE] =
    [3_450_000.0, 5_500.0, -0.15, 0.05, 0.03, 1.4, 10.0, 2.0, 1e-4, 1e-5, -1e-5, 1e-4, 0.1, -0.2, 0.03, -0.02, 0.01];

/// Compares a row of derivatives with central differences of `of`.
fn assert_row(row: &[f64; WHOLE], of: impl Fn(&[f64; WHOLE]) -> f64, what: usize) {
    for j in 0..WHOLE {
        let step = if matches!(j, 0 | 1 | 6 | 7) { 0.5 } else { 1e-4 };
        let (mut ahead, mut behind) = (STATE, STATE);
        (ahead[j], behind[j]) = (STATE[j] + step, STATE[j] - step);
        let (ahead, behind) = (of(&ahead), of(&behind));
        let tolerance = 2e-5 * row[j].abs() + 1e-15 * ahead.abs() / step;
        assert!(
            (row[j] - (ahead - behind) / (2.0 * step)).abs() <= tolerance,
            "{what} by {j}: {} {}",
            row[j],
            (ahead - behind) / (2.0 * step)
        );
    }
}

#[test]
fn derivatives_of_the_joint_state_agree_with_differences() {
    let model = Spherical::MARS.banked(0.8);
    let joint = whole(&model);
    joint.check::<WHOLE>().unwrap();
    let step = joint.step(&STATE, 1.0).unwrap();
    for i in 0..WHOLE {
        let row = match step.rows.get(i) {
            Some(row) => *row,
            None => core::array::from_fn(|j| if i == j { step.persistence[i] } else { 0.0 }),
        };
        assert_row(&row, |x| joint.step(x, 1.0).unwrap().next[i], i);
    }
    for quantity in
        [Quantity::SpecificForce { axis: 2 }, Quantity::DYNAMIC_PRESSURE, Quantity::Range { source_m: [4e6; 3] }]
    {
        let sensor = Sensor { vehicle: &model, quantity, noise: Noise::of(1.0) };
        let seen = joint.see(&sensor, &STATE).unwrap();
        assert_row(&seen.row, |x| joint.see(&sensor, x).unwrap().expected, 100);
    }
}

#[test]
fn a_layout_that_does_not_fit_is_refused() {
    let model = Spherical::MARS;
    assert!(matches!(whole(&model).check::<16>(), Err(EstimatorError::BadLayout { first: 14, size: 3, joint: 16 })));
    let over = Layout { bias: Some(Block::constant(5)), ..Layout::default() };
    let joint = Joint::<'_, _, 6, 2, 6> { model: &model, parameters: [0.0; 2], layout: over };
    assert!(joint.check::<9>().is_err());
    let narrow = Layout { parameters: Some(Block::constant(6)), ..Layout::default() };
    let joint = Joint::<'_, _, 6, 2, 6> { model: &model, parameters: [0.0; 2], layout: narrow };
    assert!(joint.check::<8>().is_err());
}

#[test]
fn a_model_without_a_value_is_an_error_and_changes_nothing() {
    let model = Spherical::MARS;
    let joint = Joint::<'_, _, 6, 2, 6> { model: &model, parameters: [0.0; 2], layout: Layout::default() };
    let mut filter = Linear::new([3.5e6, 0.0, 0.0, 0.0, 0.0, 0.0], &[1.0; 6], [Gain::Optimal; 6]).unwrap();
    let before = filter.clone();
    assert!(matches!(
        filter.predict(&joint, 1.0, &[0.0; 6]),
        Err(EstimatorError::NotFinite { part: Part::Prediction | Part::Transition, .. })
    ));
    assert_eq!(filter, before);
}
