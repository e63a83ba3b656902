//! [`Design`]: what tells one model-based filter from another: what it carries beyond position and velocity, how each
//! component is corrected, and what it believes of the model's errors.

use crate::link::parameters::{EstimatorParameters, InitialKnowledge, NavigationMode, NavigationParameters};
use crate::math::fun::sqrt;
use crate::math::num::max;
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

/// White acceleration that no model holds, (m/s²)·√s: gravity beyond J2, and rounding's better.
const FLOOR_MPS2: f64 = 1e-5;

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

/// A filter of the papers in flight.
#[derive(Clone, Copy, Debug)]
pub struct Design<'a> {
    /// Settings of the filters.
    pub settings: &'a EstimatorParameters,
    /// Its kind.
    pub family: Family,
    /// Share of the specific force that the model may be wrong by, 1σ: along the path, and where a reading is set against it.
    pub force_share: f64,
}

impl<'a> Design<'a> {
    /// The design of a mode; none for those that are not model-based.
    #[must_use]
    pub const fn of(mode: NavigationMode, settings: &'a EstimatorParameters) -> Option<Self> {
        let family = match mode {
            NavigationMode::Ekf | NavigationMode::DeadReckoning | NavigationMode::Ideal => return None,
            NavigationMode::ModelEkf => Family::Plain,
            NavigationMode::Sekf => Family::Tied(1.0),
            NavigationMode::SekfRho => Family::Tied(settings.calibration_share),
            NavigationMode::AugmentedInput => Family::Input,
            NavigationMode::Augmented => Family::Augmented,
            NavigationMode::Schmidt => Family::Considered,
            NavigationMode::Ddf1 => divided(Order::First, Sensitivities::None, None),
            NavigationMode::Ddf2 => divided(Order::Second, Sensitivities::None, None),
            NavigationMode::Rddf1 => divided(Order::First, Sensitivities::First, None),
            NavigationMode::Rddf2 => divided(Order::Second, Sensitivities::Full, None),
            NavigationMode::Rddf2Lite => divided(Order::Second, Sensitivities::First, None),
            NavigationMode::Arddf => divided(Order::First, Sensitivities::Full, Some(settings.rank_threshold)),
            NavigationMode::ArddfFree => {
                divided(Order::Measured { threshold: settings.free_threshold }, Sensitivities::First, None)
            }
            NavigationMode::Mmae => Family::Bank(Rule::Gating { rate: settings.gating_rate }),
            NavigationMode::MmaeBare => Family::Bank(Rule::BareGating { rate: settings.gating_rate }),
            NavigationMode::MmaeProduct => Family::Bank(Rule::BareProduct),
            NavigationMode::MmaeBayes => Family::Bank(Rule::Bayes { floor: settings.weight_floor }),
            NavigationMode::Imm => Family::Bank(Rule::Switching { stay: settings.switching_stay }),
            NavigationMode::MmaeAugmented => Family::AugmentedBank(Rule::Bayes { floor: settings.weight_floor }),
        };
        let force_share = match family {
            Family::Plain | Family::Input | Family::Divided { sensitivities: Sensitivities::None, .. } => {
                settings.unmodelled_share
            }
            Family::Tied(_) => settings.calibrated_share,
            Family::Bank(_) => settings.spacing_share,
            Family::Divided { .. } | Family::Augmented | Family::Considered | Family::AugmentedBank(_) => {
                settings.modelled_share
            }
        };
        Some(Self { settings, family, force_share })
    }

    /// What stands where in the joint state; the parameters fade by `persistence` a step.
    #[must_use]
    pub fn layout(&self, step_s: f64, persistence: f64) -> Layout {
        match self.family {
            Family::Plain | Family::Divided { .. } | Family::Bank(_) => Layout::default(),
            Family::Tied(_) | Family::Input => {
                let persistence = match self.family {
                    Family::Tied(share) if share < 1.0 => max(1.0 - step_s / self.settings.calibration_fade_s, 0.0),
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
            [parameters.log_density_sigma, self.settings.lift_sigma, bias, bias, bias]
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
            Family::Tied(share) => Gain::Tied { to: i - STATES, factor: share / self.settings.calibration_s },
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
        let drift = self.force_share * force_mps2;
        let velocity = sqrt((self.as_white(drift * drift) + FLOOR_MPS2) * step_s);
        let mut noise = [0.0; J];
        noise.iter_mut().skip(AXES).take(AXES).for_each(|sigma| *sigma = velocity);
        let beyond = noise.iter_mut().skip(STATES);
        match self.family {
            Family::Plain | Family::Tied(_) | Family::Divided { .. } | Family::Bank(_) => {}
            Family::Input => {
                let root_step = sqrt(step_s);
                beyond.skip(AXES).take(AXES).for_each(|sigma| *sigma = self.settings.input_growth_mps2 * root_step);
            }
            Family::Augmented | Family::Considered | Family::AugmentedBank(_) => {
                let renewed = sqrt(1.0 - persistence * persistence);
                let sigmas = [parameters.log_density_sigma, self.settings.lift_sigma];
                beyond.zip(sigmas).for_each(|(sigma, whole)| *sigma = whole * renewed);
            }
        }
        noise
    }

    /// 1σ of a reading of the specific force over a window of `length_s` in which `force_mps2` was felt, m/s².
    #[must_use]
    pub fn force_reading_sigma(&self, length_s: f64, force_mps2: f64, parameters: &NavigationParameters) -> f64 {
        let (white, model) = (parameters.accelerometer_noise, self.force_share * force_mps2);
        let bias = if self.carries_parameters() { 0.0 } else { parameters.accelerometer_bias_sigma_mps2 };
        sqrt((white * white + self.as_white(model * model + bias * bias)) / length_s)
    }

    /// White noise density that does to an average what an error of this variance does that keeps its sign for a while: taken for
    /// white at each reading, it would seem to average out.
    #[must_use]
    pub fn as_white(&self, variance: f64) -> f64 {
        variance * self.settings.error_correlation_s
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
