//! [`Engine`]: the kernel that flies, whichever it is, behind one face: started, given its share of the work frame by frame,
//! and asked what it knows.

use super::design::{Design, EXPERTS, Family, PARAMETERS, STATES, WITH_PARAMETERS, expert_parameters, expert_sigma};
use super::divided::{choose_order, correct_together};
use super::linearised::{Look, correct, correct_expert, predict, predict_expert};
use super::start::{spread_experts, start_bank, started};
use super::watch::GivenUp;
use super::window::Sight;
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::math::fun::sqrt;
use crate::nav::estimators::bank::Bank;
use crate::nav::estimators::divided::{Divided, Settings};
use crate::nav::estimators::linear::{Innovation, Linear};
use crate::nav::estimators::models::{AXES, Near, Onboard};
use crate::nav::estimators::weights::Channels;

/// Readings that are taken in together: the three axes of the accelerometer, or what radio and pressure bring.
pub const BATCH: usize = AXES;

/// A filter at work that is no bank. All zero bytes when there is none.
#[derive(Clone, Debug)]
#[repr(u8)]
#[allow(clippy::large_enum_variant, reason = "one filter at a time, in memory that is there for the largest")]
pub enum Single {
    /// None.
    Empty = 0,
    /// Position and velocity.
    Plain(Linear<STATES>) = 1,
    /// With an unknown input, or with parameters and accelerometer bias.
    Wide(Linear<WITH_PARAMETERS>) = 2,
    /// Divided differences.
    Divided(Divided<STATES, PARAMETERS>) = 3,
}

/// Which filter flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Kind {
    Single = 0,
    Bank = 1,
    WideBank = 2,
}

/// Room for any filter. The banks have rooms of their own because they must be built where they stand.
#[derive(Clone, Debug)]
pub struct Engine {
    kind: Kind,
    single: Single,
    /// Experts of constant parameters.
    bank: Bank<STATES, EXPERTS>,
    /// Experts that estimate parameters and bias.
    wide_bank: Bank<WITH_PARAMETERS, EXPERTS>,
    /// The expert that is worked on.
    expert: usize,
    /// The model about its step, or that of a linearised filter.
    near: Near,
}

/// A step of the model as an engine is to take it.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// The vehicle over the step.
    pub vehicle: &'a Onboard<'a>,
    /// What the filter is.
    pub design: &'a Design<'a>,
    /// Its parameters of the sensors and the air.
    pub parameters: &'a NavigationParameters,
    /// Length, s.
    pub step_s: f64,
    /// Force felt over it, m/s².
    pub force_mps2: f64,
    /// What of a parameter's error remains after it.
    pub persistence: f64,
}

/// What a filter has learned beyond position and velocity; zero what it does not estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Beyond {
    /// Log-density and its standard deviation, if the filter knows of it.
    pub log_density: Option<(f64, f64)>,
    /// Relative lift error.
    pub lift_error: f64,
    /// Accelerometer bias, body axes, m/s².
    pub accelerometer_bias_mps2: [f64; AXES],
}

/// What became of a batch; none where nothing was taken in.
pub type Told = [Option<Innovation>; BATCH];

impl Engine {
    /// No filter, all zero bytes.
    pub const NONE: Self = Self {
        kind: Kind::Single,
        single: Single::Empty,
        bank: Bank::NONE,
        wide_bank: Bank::NONE,
        expert: 0,
        near: Near::NONE,
    };

    /// Starts the filter of a design in place.
    ///
    /// # Errors
    /// Knowledge that is not finite; there is no engine then.
    #[inline(never)]
    pub fn start(
        &mut self,
        design: &Design<'_>,
        state: &[f64; STATES],
        knowledge: &InitialKnowledge,
        parameters: &NavigationParameters,
    ) -> Result<(), GivenUp> {
        (self.kind, self.single, self.expert) = (Kind::Single, Single::Empty, 0);
        match design.family {
            Family::Plain => self.single = Single::Plain(started(design, state, knowledge, parameters)?),
            Family::Tied(_) | Family::Input | Family::Augmented | Family::Considered => {
                self.single = Single::Wide(started(design, state, knowledge, parameters)?);
            }
            Family::Divided { order, sensitivities, .. } => {
                let [density, lift] = [parameters.log_density_sigma, design.settings.lift_sigma];
                let weights = [density * density, lift * lift];
                let settings = Settings::desensitized(order, sensitivities, weights);
                let sigmas = design.sigmas(knowledge, parameters);
                self.single = Single::Divided(Divided::new(*state, &sigmas, settings)?);
            }
            Family::Bank(rule) => {
                start_bank(&mut self.bank, rule, &started(design, state, knowledge, parameters)?)?;
                self.kind = Kind::Bank;
            }
            Family::AugmentedBank(rule) => {
                start_bank(&mut self.wide_bank, rule, &started(design, state, knowledge, parameters)?)?;
                spread_experts(&mut self.wide_bank, design, state, knowledge, parameters)?;
                self.kind = Kind::WideBank;
            }
        }
        Ok(())
    }

    /// Experts of a bank; none of the other filters.
    #[must_use]
    pub const fn experts(&self) -> usize {
        match self.kind {
            Kind::Single => 0,
            Kind::Bank | Kind::WideBank => EXPERTS,
        }
    }

    /// What follows is about this expert.
    pub const fn turn_to(&mut self, expert: usize) {
        self.expert = expert;
    }

    /// Parameters that the filter, or the expert that is worked on, flies with where it does not estimate them.
    fn parameters(&self, step: &Step<'_>) -> [f64; PARAMETERS] {
        match self.kind {
            Kind::Bank => expert_parameters(self.expert, step.parameters),
            _ => [0.0; PARAMETERS],
        }
    }

    /// Carries the estimate over a step.
    ///
    /// # Errors
    /// The estimate or its covariance has left the range of numbers.
    pub fn predict(&mut self, step: &Step<'_>) -> Result<(), GivenUp> {
        let (parameters, expert) = (self.parameters(step), self.expert);
        match (self.kind, &mut self.single) {
            (Kind::Bank, _) => predict_expert(&mut self.bank, expert, &mut self.near, step, parameters)?,
            (Kind::WideBank, _) => predict_expert(&mut self.wide_bank, expert, &mut self.near, step, parameters)?,
            (Kind::Single, Single::Empty) => {}
            (Kind::Single, Single::Plain(filter)) => predict(filter, &mut self.near, step)?,
            (Kind::Single, Single::Wide(filter)) => predict(filter, &mut self.near, step)?,
            (Kind::Single, Single::Divided(filter)) => {
                let noise = step.design.noise(step.step_s, step.force_mps2, step.persistence, step.parameters);
                choose_order(filter, step)?;
                filter.predict(step.vehicle, step.step_s, &noise)?;
            }
        }
        Ok(())
    }

    /// Takes in readings of the window that the prediction has covered, [`BATCH`] at most.
    ///
    /// # Errors
    /// As [`Self::predict`], or a measurement that has no value here.
    pub fn correct(
        &mut self,
        step: &Step<'_>,
        sights: &[Sight],
        acceleration_mps2: &[f64; AXES],
        gate_sigma: f64,
    ) -> Result<Told, GivenUp> {
        let mut told = [None; BATCH];
        let (parameters, expert) = (self.parameters(step), self.expert);
        if let (Kind::Single, Single::Divided(filter)) = (self.kind, &mut self.single) {
            correct_together(filter, step, sights, acceleration_mps2, gate_sigma, &mut told)?;
            return Ok(told);
        }
        for (sight, told) in sights.iter().zip(&mut told) {
            let look = Look { near: &self.near, step, sight, parameters, gate_sigma };
            *told = match (self.kind, &mut self.single) {
                (Kind::Bank, _) => correct_expert(&mut self.bank, expert, &look)?,
                (Kind::WideBank, _) => correct_expert(&mut self.wide_bank, expert, &look)?,
                (Kind::Single, Single::Plain(filter)) => Some(correct(filter, &look)?),
                (Kind::Single, Single::Wide(filter)) => Some(correct(filter, &look)?),
                (Kind::Single, Single::Empty | Single::Divided(_)) => None,
            };
        }
        Ok(told)
    }

    /// All readings of an instant are in: the experts of a bank are weighed.
    ///
    /// # Errors
    /// There are no weights any more.
    pub fn weigh(&mut self, channels: &Channels) -> Result<(), GivenUp> {
        match self.kind {
            Kind::Single => {}
            Kind::Bank => self.bank.weigh(channels)?,
            Kind::WideBank => self.wide_bank.weigh(channels)?,
        }
        Ok(())
    }

    /// The experts of a bank become one estimate.
    ///
    /// # Errors
    /// It is no number.
    pub fn fuse(&mut self) -> Result<(), GivenUp> {
        match self.kind {
            Kind::Single => {}
            Kind::Bank => self.bank.fuse().map(|_| ())?,
            Kind::WideBank => self.wide_bank.fuse().map(|_| ())?,
        }
        Ok(())
    }

    /// The filter's self-calibration has not begun: what it holds of its input is forgotten.
    pub fn forget_input(&mut self) {
        if let Single::Wide(filter) = &mut self.single {
            filter.forget(STATES, STATES);
        }
    }

    /// Position and velocity: of a bank, those of the expert that is worked on.
    #[must_use]
    pub fn working_state(&self) -> [f64; STATES] {
        let expert = match self.kind {
            Kind::Single => None,
            Kind::Bank => self.bank.expert(self.expert).map(|expert| first(expert.state())),
            Kind::WideBank => self.wide_bank.expert(self.expert).map(|expert| first(expert.state())),
        };
        expert.unwrap_or_else(|| self.state())
    }

    /// Position and velocity.
    #[must_use]
    pub fn state(&self) -> [f64; STATES] {
        match (self.kind, &self.single) {
            (Kind::Bank, _) => first(self.bank.fused().state()),
            (Kind::WideBank, _) => first(self.wide_bank.fused().state()),
            (Kind::Single, Single::Empty) => [0.0; STATES],
            (Kind::Single, Single::Plain(filter)) => first(filter.state()),
            (Kind::Single, Single::Wide(filter)) => first(filter.state()),
            (Kind::Single, Single::Divided(filter)) => *filter.state(),
        }
    }

    /// Covariance of two components of position and velocity.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        match (self.kind, &self.single) {
            (Kind::Bank, _) => self.bank.fused().covariance(i, j),
            (Kind::WideBank, _) => self.wide_bank.fused().covariance(i, j),
            (Kind::Single, Single::Empty) => 0.0,
            (Kind::Single, Single::Plain(filter)) => filter.covariance(i, j),
            (Kind::Single, Single::Wide(filter)) => filter.covariance(i, j),
            (Kind::Single, Single::Divided(filter)) => filter.covariance(i, j),
        }
    }

    /// What else it has learned.
    #[must_use]
    pub fn beyond(&self, design: &Design<'_>, parameters: &NavigationParameters) -> Beyond {
        match (self.kind, &self.single) {
            (Kind::Bank, _) => self.density_of_experts(parameters),
            (Kind::WideBank, _) => beyond(self.wide_bank.fused()),
            (Kind::Single, Single::Wide(filter)) if design.carries_parameters() => beyond(filter),
            (Kind::Single, _) => Beyond::default(),
        }
    }

    /// Mean and spread of what the experts believe of the density.
    fn density_of_experts(&self, parameters: &NavigationParameters) -> Beyond {
        let (mut mean, mut square) = (0.0, 0.0);
        for (expert, weight) in self.bank.weights().values().iter().enumerate() {
            let [stand, _] = expert_parameters(expert, parameters);
            mean += weight * stand;
            square += weight * stand * stand;
        }
        let own = expert_sigma(parameters);
        let spread = crate::math::num::max(square - mean * mean, 0.0);
        Beyond { log_density: Some((mean, sqrt(spread + own * own))), ..Beyond::default() }
    }
}

fn beyond(filter: &Linear<WITH_PARAMETERS>) -> Beyond {
    let [_, _, _, _, _, _, log_density, lift_error, x, y, z, _] = *filter.state();
    Beyond { log_density: Some((log_density, filter.sigma(STATES))), lift_error, accelerometer_bias_mps2: [x, y, z] }
}

/// Position and velocity of a joint state.
pub(super) fn first<const J: usize>(joint: &[f64; J]) -> [f64; STATES] {
    core::array::from_fn(|i| joint.get(i).copied().unwrap_or(0.0))
}
