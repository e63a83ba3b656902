//! [`Design`]: what tells one model-based filter from another: what it carries beyond position and velocity, how each
//! component is corrected, and what it believes of the model's errors.

use crate::link::parameters::{InitialKnowledge, NavigationMode, NavigationParameters};
use crate::math::fun::sqrt;
use crate::nav::estimators::joint::{Block, Layout};
use crate::nav::estimators::linear::Gain;
use crate::nav::estimators::models::AXES;

/// Position and velocity.
pub const STATES: usize = 6;
/// Log-density and relative lift error.
pub const PARAMETERS: usize = 2;
/// With an unknown input in each state.
pub const WITH_INPUT: usize = 2 * STATES;
/// With the parameters and a bias of the accelerometer triad.
pub const WITH_PARAMETERS: usize = STATES + PARAMETERS + AXES;

/// 1σ of the relative lift error (P2's assumption, and three times what an entry vehicle's aerodynamics are known to).
pub const LIFT_SIGMA: f64 = 0.10;
/// Share of the force that the model's errors make when no parameter stands for them, 1σ: density, drag and lift together.
const UNMODELLED_SHARE: f64 = 0.08;
/// The same where an input is calibrated that takes up what keeps its sign.
const CALIBRATED_SHARE: f64 = 0.02;
/// The same where density and lift are carried: what of waves, Mach number and attitude is left.
const MODELLED_SHARE: f64 = 0.004;
/// How long such an error keeps its sign, s.
const CORRELATION_S: f64 = 20.0;
/// A self-calibrating filter takes what a reading corrects as what the model misses in so long, s: P1's step.
const CALIBRATION_S: f64 = 1.0;
/// What it holds of it fades in so long, s, when it takes a share only: no reading of a blackout confirms it.
const FADE_S: f64 = 10.0;
/// White acceleration that no model holds, (m/s²)·√s: gravity beyond J2, and rounding's better.
const FLOOR_MPS2: f64 = 1e-5;
/// Unknown input of the filters that estimate one, a rate: 1σ of its growth over a second, m/s and m/s².
const INPUT_GROWTH: [f64; STATES] = [0.0, 0.0, 0.0, 0.3, 0.3, 0.3];

/// What kind of filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Family {
    /// Position and velocity alone.
    Plain,
    /// With an input d in each state, corrected by this share of the state's gain.
    Tied(f64),
    /// With an input that has a gain of its own.
    Input,
    /// Parameters and bias estimated.
    Augmented,
    /// Parameters and bias considered.
    Considered,
}

/// A filter of the papers in flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// Its kind.
    pub family: Family,
    /// Share of the specific force that a reading of it may differ by from the model's, 1σ.
    pub reading_share: f64,
    /// Share that may be missing along the path.
    pub path_share: f64,
}

impl Design {
    /// The design of a mode; none for those that are not model-based.
    #[must_use]
    pub const fn of(mode: NavigationMode) -> Option<Self> {
        let family = match mode {
            NavigationMode::Ekf | NavigationMode::DeadReckoning | NavigationMode::Ideal => return None,
            NavigationMode::ModelEkf => Family::Plain,
            NavigationMode::Sekf => Family::Tied(1.0),
            NavigationMode::SekfRho => Family::Tied(0.3),
            NavigationMode::AugmentedInput => Family::Input,
            NavigationMode::Augmented => Family::Augmented,
            NavigationMode::Schmidt => Family::Considered,
        };
        let (reading_share, path_share) = match family {
            Family::Plain | Family::Input => (UNMODELLED_SHARE, UNMODELLED_SHARE),
            Family::Tied(_) => (CALIBRATED_SHARE, CALIBRATED_SHARE),
            Family::Augmented | Family::Considered => (MODELLED_SHARE, MODELLED_SHARE),
        };
        Some(Self { family, reading_share, path_share })
    }

    /// What stands where in the joint state; the parameters fade by `persistence` a step.
    #[must_use]
    pub fn layout(&self, step_s: f64, persistence: f64) -> Layout {
        match self.family {
            Family::Plain => Layout::default(),
            Family::Tied(_) | Family::Input => {
                let persistence = match self.family {
                    Family::Tied(share) if share < 1.0 => 1.0 - step_s / FADE_S,
                    _ => 1.0,
                };
                Layout { input: Some((Block { first: STATES, persistence }, step_s)), ..Layout::default() }
            }
            Family::Augmented | Family::Considered => Layout {
                parameters: Some(Block { first: STATES, persistence }),
                bias: Some(Block::constant(STATES + PARAMETERS)),
                ..Layout::default()
            },
        }
    }

    /// Initial standard deviations of the joint state.
    #[must_use]
    pub fn sigmas<const J: usize>(&self, knowledge: &InitialKnowledge, parameters: &NavigationParameters) -> [f64; J] {
        let (r, v) = (knowledge.position_sigma_m, knowledge.velocity_sigma_mps);
        let carries_parameters = matches!(self.family, Family::Augmented | Family::Considered);
        let bias = parameters.accelerometer_bias_sigma_mps2;
        let beyond = if carries_parameters {
            [parameters.log_density_sigma, LIFT_SIGMA, bias, bias, bias]
        } else {
            [0.0; WITH_PARAMETERS - STATES]
        };
        let all = [r, r, r, v, v, v].into_iter().chain(beyond);
        let mut sigmas = [0.0; J];
        sigmas.iter_mut().zip(all).for_each(|(sigma, value)| *sigma = value);
        sigmas
    }

    /// How each component of the joint state is corrected.
    #[must_use]
    pub fn gains<const J: usize>(&self) -> [Gain; J] {
        core::array::from_fn(|i| match self.family {
            _ if i < STATES => Gain::Optimal,
            Family::Tied(share) => Gain::Tied { to: i - STATES, factor: share / CALIBRATION_S },
            Family::Considered => Gain::Considered,
            Family::Plain | Family::Input | Family::Augmented => Gain::Optimal,
        })
    }

    /// Process noise of a step in which the force was `force_mps2` and the parameters faded by `persistence`.
    #[must_use]
    pub fn noise<const J: usize>(
        &self,
        step_s: f64,
        force_mps2: f64,
        persistence: f64,
        parameters: &NavigationParameters,
    ) -> [f64; J] {
        let drift = self.path_share * force_mps2;
        let velocity = sqrt((drift * drift * CORRELATION_S + FLOOR_MPS2) * step_s);
        let mut noise = [0.0; J];
        noise.iter_mut().skip(AXES).take(AXES).for_each(|sigma| *sigma = velocity);
        let beyond = noise.iter_mut().skip(STATES);
        match self.family {
            Family::Plain | Family::Tied(_) => {}
            Family::Input => {
                let root_step = sqrt(step_s);
                beyond.zip(INPUT_GROWTH).for_each(|(sigma, growth)| *sigma = growth * root_step);
            }
            Family::Augmented | Family::Considered => {
                let renewed = sqrt(1.0 - persistence * persistence);
                let sigmas = [parameters.log_density_sigma, LIFT_SIGMA];
                beyond.zip(sigmas).for_each(|(sigma, whole)| *sigma = whole * renewed);
            }
        }
        noise
    }

    /// 1σ of a reading of the specific force over a window of `length_s` in which `force_mps2` was felt, m/s².
    #[must_use]
    pub fn force_reading_sigma(&self, length_s: f64, force_mps2: f64, parameters: &NavigationParameters) -> f64 {
        let (white, model) = (parameters.accelerometer_noise, self.reading_share * force_mps2);
        let bias = match self.family {
            Family::Augmented | Family::Considered => 0.0,
            _ => parameters.accelerometer_bias_sigma_mps2,
        };
        sqrt((white * white + as_white(model * model + bias * bias)) / length_s)
    }
}

/// White noise density that does to an average what an error of this variance does that keeps its sign for
/// [`CORRELATION_S`]: taken for white at each reading, it would seem to average out.
#[must_use]
pub fn as_white(variance: f64) -> f64 {
    variance * CORRELATION_S
}
