//! A linearised filter's step and its readings, alone or as an expert of a bank: the model comes in through [`Near`].

use super::design::{EXPERTS, PARAMETERS, STATES};
use super::engine::{Step, first};
use super::window::Sight;
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::bank::{Bank, BankError};
use crate::nav::estimators::joint::{Joint, Seen, Transition};
use crate::nav::estimators::linear::{Innovation, Linear};
use crate::nav::estimators::models::Near;

/// Derivatives by position, velocity and parameters, for all: a second width would cost 20 KB of flash.
const WIDE: usize = STATES + PARAMETERS;

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
pub(super) fn predict<const J: usize>(
    filter: &mut Linear<J>,
    near: &mut Near,
    step: &Step<'_>,
) -> Result<(), EstimatorError> {
    let noise = step.design.noise(step.step_s, step.force_mps2, step.persistence, step.parameters);
    let moved = moved(near, filter.state(), step, [0.0; PARAMETERS])?;
    filter.advance(&moved, &noise)
}

/// An expert that fails retires, and the others go on.
#[inline(never)]
pub(super) fn predict_expert<const J: usize>(
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
pub(super) struct Look<'a> {
    pub near: &'a Near,
    pub step: &'a Step<'a>,
    pub sight: &'a Sight,
    pub parameters: [f64; PARAMETERS],
    pub gate_sigma: f64,
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

#[inline(never)]
pub(super) fn correct<const J: usize>(filter: &mut Linear<J>, look: &Look<'_>) -> Result<Innovation, EstimatorError> {
    let (seen, variance) = look.at(filter.anchor())?;
    filter.absorb(look.sight.value - seen.expected, &seen.row, variance, look.gate_sigma)
}

#[inline(never)]
pub(super) fn correct_expert<const J: usize>(
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
