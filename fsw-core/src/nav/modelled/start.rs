//! How the filters of an [`Engine`](super::engine::Engine) begin.

use super::design::{Design, EXPERTS, STATES, WITH_PARAMETERS, expert_parameters, expert_sigma};
use super::watch::GivenUp;
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::bank::{Bank, BankError};
use crate::nav::estimators::linear::Linear;
use crate::nav::estimators::weights::{Rule, Weights};

/// A linearised filter of a design.
///
/// # Errors
/// Knowledge that is not finite.
pub(super) fn started<const J: usize>(
    design: &Design<'_>,
    state: &[f64; STATES],
    knowledge: &InitialKnowledge,
    parameters: &NavigationParameters,
) -> Result<Linear<J>, EstimatorError> {
    let mut joint = [0.0; J];
    joint.iter_mut().zip(state).for_each(|(to, from)| *to = *from);
    Linear::new(joint, &design.sigmas(knowledge, parameters), design.gains())
}

/// A bank of experts that are all alike.
///
/// # Errors
/// Weights that there cannot be.
pub(super) fn start_bank<const J: usize>(
    bank: &mut Bank<J, EXPERTS>,
    rule: Rule,
    first: &Linear<J>,
) -> Result<(), GivenUp> {
    bank.start(first, Weights::new(rule, EXPERTS).map_err(BankError::Weights)?);
    Ok(())
}

/// Experts that estimate the density begin around where those that do not stand.
pub(super) fn spread_experts(
    bank: &mut Bank<WITH_PARAMETERS, EXPERTS>,
    design: &Design<'_>,
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
