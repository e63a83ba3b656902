//! [`Bound`]: posterior Cramér–Rao bound, the smallest covariance that any filter can reach, for any model and sensors.
//!
//! Tichavský, Muravchik, Nehorai 1998: with prior information J₀ the information of the state follows
//! Jₖ₊₁ = (Φ Jₖ⁻¹ Φᵀ + Q)⁻¹ + Σ hᵀh·i, with Φ and h the derivatives **at the true state** and i the information of a reading
//! about its expected value. Here its inverse is carried, as the triangular factor of the core's [`Linear`] kernel: no
//! information is ever inverted, so that a process without noise, a state that is known exactly and one of which nothing is
//! known are all welcome. Per true trajectory this is the bound for that trajectory; the average over trajectories, of
//! covariances and not of their roots, is [`MeanBound`].
//!
//! For another study:
//!
//! ```text
//! let mut bound = Bound::new(&prior_sigmas)?;              the joint state's: vehicle, then the blocks of the layout
//! for each step:      bound.step(&joint, &true_joint_state, step_s, &noise_sigmas)?;     state before the step
//! for each reading:   bound.inform(&joint, &sensor, &true_joint_state_now)?;
//! mean.add(&bound);                                        at the end, or wherever filters are compared
//! ```
//!
//! `joint` is the one that the filter under test uses; whatever it carries is unknown, whatever it does not is known.

use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::{Joint, Seen};
use fsw_core::nav::estimators::linear::{Gain, Linear};
use fsw_core::nav::estimators::models::{Measurement, Process};
use nalgebra::SMatrix;

/// The bound along one true trajectory; `J` numbers in the joint state.
///
/// It is the covariance of a linear filter that knows the derivatives at the truth and of each reading its score, the slope of
/// its log-density. What that filter's error would be on the readings at hand is known too ([`Self::error`]): its mean square
/// over many runs is the bound, and over some, on the same draws, it scatters as a filter's that comes near the bound.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound<const J: usize> {
    least: Linear<J>,
    /// The error as the last step left it.
    predicted: [f64; J],
}

impl<const J: usize> Bound<J> {
    /// Before any reading: independent deviations of the prior; zero is known exactly.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn new(sigmas: &[f64; J]) -> Result<Self, EstimatorError> {
        Self::from_error([0.0; J], sigmas)
    }

    /// The same; `error` is the prior's estimate less the truth.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn from_error(error: [f64; J], sigmas: &[f64; J]) -> Result<Self, EstimatorError> {
        Ok(Self { least: Linear::new(error, sigmas, [Gain::Optimal; J])?, predicted: error })
    }

    /// One step of the model from the true joint state `before`, then process noise of these standard deviations.
    ///
    /// # Errors
    /// The model has no finite value or derivative there.
    pub fn step<M: Process<N, P>, const N: usize, const P: usize, const W: usize>(
        &mut self,
        joint: &Joint<'_, M, N, P, W>,
        before: &[f64; J],
        step_s: f64,
        noise: &[f64; J],
    ) -> Result<(), EstimatorError> {
        let mut transition = joint.step(before, step_s)?;
        let error = *self.least.state();
        transition.next = std::array::from_fn(|i| match transition.rows.get(i) {
            Some(row) => row.iter().zip(&error).map(|(phi, e)| phi * e).sum(),
            None => transition.persistence[i] * error[i],
        });
        self.least.transport(&transition)?;
        self.predicted = transition.next;
        self.least.add_independent_noise(noise)
    }

    /// A reading of a sensor at the true joint state `now`. Noise whose variance V depends on the expected value y tells of it
    /// too: i = 1/V + ½ (V′/V)².
    ///
    /// # Errors
    /// The measurement has no finite value or derivative there, or its variance is not positive.
    pub fn inform<M: Process<N, P>, Z: Measurement<N, P>, const N: usize, const P: usize, const W: usize>(
        &mut self,
        joint: &Joint<'_, M, N, P, W>,
        sensor: &Z,
        now: &[f64; J],
    ) -> Result<(), EstimatorError> {
        let seen = joint.see(sensor, now)?;
        self.take(sensor, &seen, None)
    }

    /// The same of a sensor that read `value`: what this does to the error. Readings of one instant may come in any order.
    ///
    /// # Errors
    /// As there.
    pub fn read<M: Process<N, P>, Z: Measurement<N, P>, const N: usize, const P: usize, const W: usize>(
        &mut self,
        joint: &Joint<'_, M, N, P, W>,
        sensor: &Z,
        now: &[f64; J],
        value: f64,
    ) -> Result<(), EstimatorError> {
        let seen = joint.see(sensor, now)?;
        self.take(sensor, &seen, Some(value))
    }

    fn take<Z: Measurement<N, P>, const N: usize, const P: usize>(
        &mut self,
        sensor: &Z,
        seen: &Seen<J>,
        value: Option<f64>,
    ) -> Result<(), EstimatorError> {
        let variance = sensor.variance(seen.expected);
        // Variances are at most quadratic in what is read: their central difference is exact at any width.
        let width = 1e-3 * if seen.expected == 0.0 { 1.0 } else { seen.expected.abs() };
        let slope = (sensor.variance(seen.expected + width) - sensor.variance(seen.expected - width)) / (2.0 * width);
        let information = 1.0 / variance + 0.5 * (slope / variance).powi(2);
        let score = value.map_or(0.0, |value| {
            let noise = value - seen.expected;
            noise / variance + 0.5 * slope / variance * (noise * noise / variance - 1.0)
        });
        // The kernel takes innovations at its prediction; from the error's present value it corrects to that by itself.
        let predicted: f64 = seen.row.iter().zip(&self.predicted).map(|(h, e)| h * e).sum();
        self.least.absorb(score / information - predicted, &seen.row, 1.0 / information, f64::INFINITY).map(|_| ())
    }

    /// Error of the filter that attains the bound, estimate less truth: on what was [`read`](Self::read) since
    /// [`from_error`](Self::from_error).
    #[must_use]
    pub const fn error(&self) -> &[f64; J] {
        self.least.state()
    }

    /// The least covariance.
    #[must_use]
    pub fn covariance(&self) -> SMatrix<f64, J, J> {
        self.least.factor() * self.least.factor().transpose()
    }
}

/// Average of bounds over true trajectories.
#[derive(Clone, Debug, PartialEq)]
pub struct MeanBound<const J: usize> {
    sum: SMatrix<f64, J, J>,
    count: u64,
}

impl<const J: usize> Default for MeanBound<J> {
    fn default() -> Self {
        Self { sum: SMatrix::zeros(), count: 0 }
    }
}

impl<const J: usize> MeanBound<J> {
    /// Adds the bound of a trajectory.
    pub fn add(&mut self, covariance: &SMatrix<f64, J, J>) {
        self.sum += covariance;
        self.count += 1;
    }

    /// Least root mean square error of each component; not a number before the first trajectory.
    #[must_use]
    pub fn rmse(&self) -> [f64; J] {
        std::array::from_fn(|i| (self.sum[(i, i)] / self.count as f64).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use fsw_core::math::Scalar;
    use fsw_core::nav::estimators::joint::{Block, Layout};
    use nalgebra::SVector;

    use super::*;

    /// x' = x + v Δt, v' = v + a Δt − ½ v² Δt with an unknown acceleration a.
    struct Glider;

    impl Process<2, 1> for Glider {
        fn step<S: Scalar>(&self, &[x, v]: &[S; 2], &[a]: &[S; 1], step_s: f64) -> [S; 2] {
            [x + v * step_s, v + (a - v * v * 0.5) * step_s]
        }
    }

    /// Position, with noise in proportion and some besides.
    struct Ruler;

    impl Measurement<2, 1> for Ruler {
        fn expected<S: Scalar>(&self, &[x, _]: &[S; 2], _: &[S; 1]) -> S {
            x * x
        }
        fn variance(&self, expected: f64) -> f64 {
            0.01 + (0.1 * expected).powi(2)
        }
    }

    /// The same in the other form, information of the first state, with derivatives by hand: Φ and h of this very system.
    #[test]
    fn without_process_noise_it_is_the_inverse_information_of_the_start_carried_to_the_end() {
        const STEP_S: f64 = 0.1;
        let layout = Layout { parameters: Some(Block::constant(2)), ..Layout::default() };
        let joint = Joint::<_, 2, 1, 3> { model: &Glider, parameters: [0.0], layout };
        let prior = [0.5, 0.3, 0.2];
        let mut bound = Bound::new(&prior).unwrap();
        let mut truth = [1.0, 1.5, 0.4];
        let mut by_start = SMatrix::<f64, 3, 3>::identity();
        let mut information = SMatrix::<f64, 3, 3>::from_diagonal(&SVector::from(prior).map(|s| 1.0 / (s * s)));
        for _ in 0..40 {
            bound.step(&joint, &truth, STEP_S, &[0.0; 3]).unwrap();
            let [x, v, a] = truth;
            let phi = SMatrix::<f64, 3, 3>::new(1.0, STEP_S, 0.0, 0.0, 1.0 - v * STEP_S, STEP_S, 0.0, 0.0, 1.0);
            truth = [x + v * STEP_S, v + (a - 0.5 * v * v) * STEP_S, a];
            by_start = phi * by_start;
            bound.inform(&joint, &Ruler, &truth).unwrap();
            let y = truth[0] * truth[0];
            let variance = 0.01 + 0.01 * y * y;
            let row = SMatrix::<f64, 1, 3>::new(2.0 * truth[0], 0.0, 0.0) * by_start;
            information += row.transpose() * row * (1.0 / variance + 0.5 * (0.02 * y / variance).powi(2));
        }
        let expected = by_start * information.try_inverse().unwrap() * by_start.transpose();
        // A condition of some 1e4 in the information: twelve digits remain.
        assert!((bound.covariance() - expected).norm() < 1e-10 * expected.norm());
    }

    #[test]
    fn with_process_noise_it_is_tichavskys_recursion() {
        let joint = Joint::<_, 2, 1, 2> { model: &Glider, parameters: [0.4], layout: Layout::default() };
        let noise = [0.02, 0.05];
        let mut bound = Bound::new(&[0.5, 0.3]).unwrap();
        let mut information = SMatrix::<f64, 2, 2>::new(4.0, 0.0, 0.0, 1.0 / 0.09);
        let weight = SMatrix::<f64, 2, 2>::new(1.0 / 4e-4, 0.0, 0.0, 1.0 / 25e-4);
        let mut truth = [1.0, 1.5];
        for _ in 0..40 {
            bound.step(&joint, &truth, 0.1, &noise).unwrap();
            let phi = SMatrix::<f64, 2, 2>::new(1.0, 0.1, 0.0, 1.0 - 0.1 * truth[1]);
            truth = Glider.step(&truth, &[0.4], 0.1);
            bound.inform(&joint, &Ruler, &truth).unwrap();
            // Eq. 21: D22 − D21 (J + D11)⁻¹ D12 with D11 = ΦᵀQ⁻¹Φ, D12 = −ΦᵀQ⁻¹, D22 = Q⁻¹ + what was read.
            let gone = (information + phi.transpose() * weight * phi).try_inverse().unwrap();
            information = weight - weight * phi * gone * phi.transpose() * weight;
            let y = truth[0] * truth[0];
            let variance = 0.01 + 0.01 * y * y;
            information[(0, 0)] += 4.0 * truth[0] * truth[0] * (1.0 / variance + 0.5 * (0.02 * y / variance).powi(2));
        }
        let expected = information.try_inverse().unwrap();
        assert!((bound.covariance() - expected).norm() < 1e-9 * expected.norm());
    }

    /// A normal variable of a small linear generator: sums of twelve.
    fn normal(seed: &mut u64) -> f64 {
        let mut uniform = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn the_errors_of_the_filter_that_attains_it_have_it_as_their_mean_square() {
        const RUNS: usize = 4_000;
        let layout = Layout { parameters: Some(Block::constant(2)), ..Layout::default() };
        let joint = Joint::<_, 2, 1, 3> { model: &Glider, parameters: [0.0], layout };
        let prior = [0.05, 0.03, 0.02];
        let (mut seed, mut sum, mut least) = (1, SMatrix::<f64, 3, 3>::zeros(), SMatrix::<f64, 3, 3>::zeros());
        for _ in 0..RUNS {
            let mut truth = [1.0, 1.5, 0.4];
            let mut bound = Bound::from_error(prior.map(|sigma| sigma * normal(&mut seed)), &prior).unwrap();
            for _ in 0..10 {
                bound.step(&joint, &truth, 0.1, &[0.0; 3]).unwrap();
                let [x, v] = Glider.step(&[truth[0], truth[1]], &[truth[2]], 0.1);
                truth = [x, v, truth[2]];
                let expected = x * x;
                let sigma = Measurement::<2, 1>::variance(&Ruler, expected).sqrt();
                bound.read(&joint, &Ruler, &truth, expected + sigma * normal(&mut seed)).unwrap();
            }
            let error = SVector::<f64, 3>::from_row_slice(bound.error());
            sum += error * error.transpose() / RUNS as f64;
            least = bound.covariance();
        }
        // A mean square of 4000 is uncertain by 2.2 %; three of that.
        for i in 0..3 {
            assert!((sum[(i, i)] / least[(i, i)] - 1.0).abs() < 0.067, "{i}: {}", sum[(i, i)] / least[(i, i)]);
        }
    }

    #[test]
    fn bounds_are_averaged_as_covariances() {
        let mut mean = MeanBound::<1>::default();
        mean.add(&SMatrix::from_element(1.0));
        mean.add(&SMatrix::from_element(49.0));
        assert_eq!(mean.rmse(), [5.0]);
    }
}
