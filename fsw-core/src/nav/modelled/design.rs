//! [`Design`]: what tells one model-based filter from another: what it carries beyond position and velocity, how each
//! component is corrected, and what it believes of the model's errors.

use crate::link::parameters::{InitialKnowledge, NavigationMode, NavigationParameters};
use crate::math::fun::sqrt;
use crate::nav::estimators::divided::{Order, Sensitivities};
use crate::nav::estimators::joint::{Block, Layout};
use crate::nav::estimators::linear::Gain;
use crate::nav::estimators::models::AXES;
use crate::nav::estimators::weights::Rule;

/// Position and velocity.
pub const STATES: usize = 6;
/// Log-density and relative lift error.
pub const PARAMETERS: usize = 2;
/// With an unknown input in each state.
pub const WITH_INPUT: usize = 2 * STATES;
/// With the parameters and a bias of the accelerometer triad: eleven. The twelfth is known exactly and does nothing; with it
/// one kernel of twelve serves both, and 13 KB of flash are saved.
pub const WITH_PARAMETERS: usize = WITH_INPUT;

/// 1σ of the relative lift error (P2's assumption, and three times what an entry vehicle's aerodynamics are known to).
pub const LIFT_SIGMA: f64 = 0.10;
/// Share of the force that the model's errors make when no parameter stands for them, 1σ: density, drag and lift together.
const UNMODELLED_SHARE: f64 = 0.08;
/// The same where an input is calibrated that takes up what keeps its sign.
const CALIBRATED_SHARE: f64 = 0.02;
/// The same where the best of several experts is a third of a spacing away, and none knows of the lift.
const SPACING_SHARE: f64 = 0.015;
/// The same where density and lift are carried, or are known to be uncertain: what of waves, Mach number and attitude is left.
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
    /// Divided differences, with sensitivities or without.
    Divided {
        /// Which differences count.
        order: Order,
        /// What is known of the estimate's derivatives by the parameters.
        sensitivities: Sensitivities,
        /// The order follows the rank-sampled degree of nonlinearity, second above this.
        by_ranks: Option<f64>,
    },
    /// Experts that each believe in a density of their own.
    Bank(Rule),
    /// Experts that estimate the parameters, from different beginnings.
    AugmentedBank(Rule),
}

/// Experts of a bank.
pub const EXPERTS: usize = 7;
/// Where the experts stand, in standard deviations of the log-density: the cells of a uniform law of the same variance, as
/// P3's seven between −10 % and 10 %.
const STANDS: [f64; EXPERTS] = [-1.732_05, -1.039_23, -0.346_41, 0.0, 0.346_41, 1.039_23, 1.732_05];
/// Share of the whole uncertainty of the log-density that an expert which estimates it begins with.
const EXPERT_SHARE: f64 = 1.0 / 3.0;
/// Learning rate of the gating at ten instants a second (P3 gives none; of those tried the best on P3's second scenario).
const GATING_RATE: f64 = 0.01;
/// An expert is the right one for so long, on average: 0.999 of the steps, as in P3's comparison.
const STAY: f64 = 0.999;
/// Smallest weight of an expert, so that none is out for good while the air changes.
const FLOOR: f64 = 1e-3;
/// Degrees of nonlinearity above which second differences count.
const RANK_THRESHOLD: f64 = 5e-3;
/// The same, from the filter's own points.
const FREE_THRESHOLD: f64 = 2e-5;

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
            NavigationMode::Ddf1 => divided(Order::First, Sensitivities::None, None),
            NavigationMode::Ddf2 => divided(Order::Second, Sensitivities::None, None),
            NavigationMode::Rddf1 => divided(Order::First, Sensitivities::First, None),
            NavigationMode::Rddf2 => divided(Order::Second, Sensitivities::Full, None),
            NavigationMode::Rddf2Lite => divided(Order::Second, Sensitivities::First, None),
            NavigationMode::Arddf => divided(Order::First, Sensitivities::Full, Some(RANK_THRESHOLD)),
            NavigationMode::ArddfFree => {
                divided(Order::Measured { threshold: FREE_THRESHOLD }, Sensitivities::First, None)
            }
            NavigationMode::Mmae => Family::Bank(Rule::Gating { rate: GATING_RATE }),
            NavigationMode::MmaeBare => Family::Bank(Rule::BareGating { rate: GATING_RATE }),
            NavigationMode::MmaeProduct => Family::Bank(Rule::BareProduct),
            NavigationMode::MmaeBayes => Family::Bank(Rule::Bayes { floor: FLOOR }),
            NavigationMode::Imm => Family::Bank(Rule::Switching { stay: STAY }),
            NavigationMode::MmaeAugmented => Family::AugmentedBank(Rule::Bayes { floor: FLOOR }),
        };
        let (reading_share, path_share) = match family {
            Family::Plain | Family::Input => (UNMODELLED_SHARE, UNMODELLED_SHARE),
            Family::Tied(_) => (CALIBRATED_SHARE, CALIBRATED_SHARE),
            Family::Divided { sensitivities: Sensitivities::None, .. } => (UNMODELLED_SHARE, UNMODELLED_SHARE),
            Family::Bank(_) => (SPACING_SHARE, SPACING_SHARE),
            Family::Divided { .. } | Family::Augmented | Family::Considered | Family::AugmentedBank(_) => {
                (MODELLED_SHARE, MODELLED_SHARE)
            }
        };
        Some(Self { family, reading_share, path_share })
    }

    /// What stands where in the joint state; the parameters fade by `persistence` a step.
    #[must_use]
    pub fn layout(&self, step_s: f64, persistence: f64) -> Layout {
        match self.family {
            Family::Plain | Family::Divided { .. } | Family::Bank(_) => Layout::default(),
            Family::Tied(_) | Family::Input => {
                let persistence = match self.family {
                    Family::Tied(share) if share < 1.0 => 1.0 - step_s / FADE_S,
                    _ => 1.0,
                };
                Layout { input: Some((Block { first: STATES, persistence }, step_s)), ..Layout::default() }
            }
            Family::Augmented | Family::Considered | Family::AugmentedBank(_) => Layout {
                parameters: Some(Block { first: STATES, persistence }),
                bias: Some(Block::constant(STATES + PARAMETERS)),
                ..Layout::default()
            },
        }
    }

    /// Whether the filter estimates, or considers, density, lift and accelerometer bias.
    #[must_use]
    pub const fn carries_parameters(&self) -> bool {
        matches!(self.family, Family::Augmented | Family::Considered | Family::AugmentedBank(_))
    }

    /// Initial standard deviations of the joint state.
    #[must_use]
    pub fn sigmas<const J: usize>(&self, knowledge: &InitialKnowledge, parameters: &NavigationParameters) -> [f64; J] {
        let (r, v) = (knowledge.position_sigma_m, knowledge.velocity_sigma_mps);
        let carries_parameters = self.carries_parameters();
        let bias = parameters.accelerometer_bias_sigma_mps2;
        let beyond = if carries_parameters {
            [parameters.log_density_sigma, LIFT_SIGMA, bias, bias, bias]
        } else {
            [0.0; PARAMETERS + AXES]
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
            _ => Gain::Optimal,
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
            Family::Plain | Family::Tied(_) | Family::Divided { .. } | Family::Bank(_) => {}
            Family::Input => {
                let root_step = sqrt(step_s);
                beyond.zip(INPUT_GROWTH).for_each(|(sigma, growth)| *sigma = growth * root_step);
            }
            Family::Augmented | Family::Considered | Family::AugmentedBank(_) => {
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
        let bias = if self.carries_parameters() { 0.0 } else { parameters.accelerometer_bias_sigma_mps2 };
        sqrt((white * white + as_white(model * model + bias * bias)) / length_s)
    }
}

const fn divided(order: Order, sensitivities: Sensitivities, by_ranks: Option<f64>) -> Family {
    Family::Divided { order, sensitivities, by_ranks }
}

/// Parameters of an expert that believes in a density of its own.
#[must_use]
pub fn expert_parameters(expert: usize, parameters: &NavigationParameters) -> [f64; PARAMETERS] {
    [STANDS.get(expert).copied().unwrap_or(0.0) * parameters.log_density_sigma, 0.0]
}

/// 1σ of the log-density about an expert's beginning.
#[must_use]
pub fn expert_sigma(parameters: &NavigationParameters) -> f64 {
    EXPERT_SHARE * parameters.log_density_sigma
}

/// White noise density that does to an average what an error of this variance does that keeps its sign for
/// [`CORRELATION_S`]: taken for white at each reading, it would seem to average out.
#[must_use]
pub fn as_white(variance: f64) -> f64 {
    variance * CORRELATION_S
}
