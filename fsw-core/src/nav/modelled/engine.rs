//! [`Engine`]: the kernel that flies, whichever it is, behind one face: started, given its share of the work frame by frame,
//! and asked what it knows.

use super::design::{Design, EXPERTS, Family, PARAMETERS, STATES, WITH_PARAMETERS, expert_parameters, expert_sigma};
use super::watch::GivenUp;
use super::window::Sight;
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::math::fun::sqrt;
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::bank::{Bank, BankError};
use crate::nav::estimators::divided::{Divided, Order, Settings, Stepped};
use crate::nav::estimators::joint::{Joint, Seen, Transition};
use crate::nav::estimators::linear::{Innovation, Linear};
use crate::nav::estimators::models::{AXES, Earlier, Near, Onboard, Reading, Sensor};
use crate::nav::estimators::weights::{Channels, Rule, Weights};

/// Derivatives by position, velocity and parameters, for all: those by the parameters cost a filter that does not need them
/// a fifth more time, and a second width would cost 20 KB of flash.
const WIDE: usize = STATES + PARAMETERS;
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
    pub design: &'a Design,
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
        design: &Design,
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
                let [density, lift] = [parameters.log_density_sigma, super::design::LIFT_SIGMA];
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
    pub fn beyond(&self, design: &Design, parameters: &NavigationParameters) -> Beyond {
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

fn first<const J: usize>(joint: &[f64; J]) -> [f64; STATES] {
    core::array::from_fn(|i| joint.get(i).copied().unwrap_or(0.0))
}

fn started<const J: usize>(
    design: &Design,
    state: &[f64; STATES],
    knowledge: &InitialKnowledge,
    parameters: &NavigationParameters,
) -> Result<Linear<J>, EstimatorError> {
    let mut joint = [0.0; J];
    joint.iter_mut().zip(state).for_each(|(to, from)| *to = *from);
    Linear::new(joint, &design.sigmas(knowledge, parameters), design.gains())
}

fn start_bank<const J: usize>(bank: &mut Bank<J, EXPERTS>, rule: Rule, first: &Linear<J>) -> Result<(), GivenUp> {
    bank.start(first, Weights::new(rule, EXPERTS).map_err(BankError::Weights)?);
    Ok(())
}

/// Experts that estimate the density begin around where those that do not stand.
fn spread_experts(
    bank: &mut Bank<WITH_PARAMETERS, EXPERTS>,
    design: &Design,
    state: &[f64; STATES],
    knowledge: &InitialKnowledge,
    parameters: &NavigationParameters,
) -> Result<(), GivenUp> {
    for expert in 0..EXPERTS {
        let [stand, _] = expert_parameters(expert, parameters);
        let mut joint = [0.0; WITH_PARAMETERS];
        joint.iter_mut().zip(state.iter().chain([&stand])).for_each(|(to, from)| *to = *from);
        let mut sigmas = design.sigmas(knowledge, parameters);
        sigmas.iter_mut().skip(STATES).take(1).for_each(|sigma| *sigma = expert_sigma(parameters));
        let linear = Linear::new(joint, &sigmas, design.gains())?;
        bank.replace_expert(expert, &linear)?;
    }
    Ok(bank.fuse().map(|_| ())?)
}

/// The joint state of a design; the model comes in through [`Near`].
fn joint_of(step: &Step<'_>, parameters: [f64; PARAMETERS]) -> Joint<'static, (), STATES, PARAMETERS, WIDE> {
    Joint { model: &(), parameters, layout: step.design.layout(step.step_s, step.persistence) }
}

/// Density and lift as a joint state has them, or as the filter was told.
fn parameters_of<const J: usize>(joint: &[f64; J], step: &Step<'_>, told: [f64; PARAMETERS]) -> [f64; PARAMETERS] {
    if !step.design.carries_parameters() {
        return told;
    }
    core::array::from_fn(|i| joint.get(STATES + i).copied().unwrap_or(0.0))
}

/// The step of a joint state.
#[inline(never)]
fn moved<const J: usize>(
    near: &mut Near,
    joint: &[f64; J],
    step: &Step<'_>,
    told: [f64; PARAMETERS],
) -> Result<Transition<STATES, J>, EstimatorError> {
    near.move_to(step.vehicle, &first(joint), &parameters_of(joint, step, told), step.step_s);
    joint_of(step, told).step_of(joint, near.next(), near.rows())
}

#[inline(never)]
fn predict<const J: usize>(filter: &mut Linear<J>, near: &mut Near, step: &Step<'_>) -> Result<(), EstimatorError> {
    let noise = step.design.noise(step.step_s, step.force_mps2, step.persistence, step.parameters);
    let moved = moved(near, filter.state(), step, [0.0; PARAMETERS])?;
    filter.advance(&moved, &noise)
}

/// An expert that fails retires, and the others go on.
#[inline(never)]
fn predict_expert<const J: usize>(
    bank: &mut Bank<J, EXPERTS>,
    expert: usize,
    near: &mut Near,
    step: &Step<'_>,
    parameters: [f64; PARAMETERS],
) -> Result<(), BankError> {
    let noise = step.design.noise(step.step_s, step.force_mps2, step.persistence, step.parameters);
    let mut outcome = bank.mix_expert(expert);
    if let (Ok(()), Some(there)) = (outcome, bank.expert(expert)) {
        let moved = moved(near, there.state(), step, parameters);
        outcome = bank.advance_expert(expert, moved, &noise);
    }
    spared(outcome).map(|_| ())
}

/// What one expert cannot do is not the bank's failure.
fn spared<T>(outcome: Result<T, BankError>) -> Result<Option<T>, BankError> {
    match outcome {
        Ok(done) => Ok(Some(done)),
        Err(BankError::Absent { .. } | BankError::Expert { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// A reading, and all that it takes to take it in.
struct Look<'a> {
    near: &'a Near,
    step: &'a Step<'a>,
    sight: &'a Sight,
    parameters: [f64; PARAMETERS],
    gate_sigma: f64,
}

impl Look<'_> {
    /// Innovation and derivatives at the state of the prediction, and the variance of the reading.
    #[inline(never)]
    fn at<const J: usize>(&self, anchor: &[f64; J]) -> Result<(Seen<J>, f64), EstimatorError> {
        let Self { near, step, sight, parameters, .. } = self;
        let line = near.see(&sight.quantity, sight.age_s, &first(anchor), &parameters_of(anchor, step, *parameters));
        let joint = joint_of(step, *parameters);
        let seen = joint.seen_of(anchor, line.value, &line.row, sight.quantity.bias_axis())?;
        Ok((seen, sight.noise.variance(seen.expected)))
    }
}

fn reading_of<'a>(sight: &Sight, earlier: &'a Earlier<'a>) -> Reading<Sensor<'a, Earlier<'a>>> {
    let sensor = Sensor { vehicle: earlier, quantity: sight.quantity, noise: sight.noise };
    Reading { sensor, value: sight.value }
}

#[inline(never)]
fn correct<const J: usize>(filter: &mut Linear<J>, look: &Look<'_>) -> Result<Innovation, EstimatorError> {
    let (seen, variance) = look.at(filter.anchor())?;
    filter.absorb(look.sight.value - seen.expected, &seen.row, variance, look.gate_sigma)
}

#[inline(never)]
fn correct_expert<const J: usize>(
    bank: &mut Bank<J, EXPERTS>,
    expert: usize,
    look: &Look<'_>,
) -> Result<Option<Innovation>, BankError> {
    let Some(there) = bank.expert(expert) else { return Ok(None) };
    spared(match look.at(there.anchor()) {
        Ok((seen, variance)) => {
            let innovation = look.sight.value - seen.expected;
            bank.absorb_expert(expert, innovation, &seen.row, variance, look.gate_sigma)
        }
        // As a reading that is no number: refused by all alike.
        Err(error) => Err(BankError::Expert { expert: u8::try_from(expert).unwrap_or(u8::MAX), error }),
    })
}

/// P2's adaptive filter: the order of this step by the rank-sampled degree of nonlinearity.
fn choose_order(filter: &mut Divided<STATES, PARAMETERS>, step: &Step<'_>) -> Result<(), EstimatorError> {
    if let Family::Divided { by_ranks: Some(threshold), .. } = step.design.family {
        let map = Stepped { process: step.vehicle, step_s: step.step_s };
        let degree = filter.nonlinearity_by_ranks(&map)?;
        filter.set_order(if degree > threshold { Order::Second } else { Order::First });
    }
    Ok(())
}

/// Divided differences take readings in together: their gain is that of the batch.
#[inline(never)]
fn correct_together(
    filter: &mut Divided<STATES, PARAMETERS>,
    step: &Step<'_>,
    sights: &[Sight],
    acceleration_mps2: &[f64; AXES],
    gate_sigma: f64,
    told: &mut Told,
) -> Result<(), EstimatorError> {
    let [a, b, c] = core::array::from_fn(|i| Earlier {
        vehicle: step.vehicle,
        age_s: sights.get(i).map_or(0.0, |sight| sight.age_s),
        acceleration_mps2: *acceleration_mps2,
    });
    let done = match sights {
        [] => return Ok(()),
        [x] => filter.correct::<_, BATCH>(&[reading_of(x, &a)], gate_sigma)?,
        [x, y] => filter.correct::<_, BATCH>(&[reading_of(x, &a), reading_of(y, &b)], gate_sigma)?,
        [x, y, z, ..] => {
            filter.correct::<_, BATCH>(&[reading_of(x, &a), reading_of(y, &b), reading_of(z, &c)], gate_sigma)?
        }
    };
    told.iter_mut().zip(done.innovations()).for_each(|(told, innovation)| *told = Some(*innovation));
    Ok(())
}
