//! What no filter of an entry can go below, and what attains it.

use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::Joint;
use fsw_core::nav::estimators::models::Cartesian;
use nalgebra::SMatrix;

use super::filters::{self, Pressure, STATE, WITH_DENSITY, readings};
use super::run::Sight;
use crate::bound::Bound;

/// The bound at the parachute's opening.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// Least covariance when the density is unknown.
    pub unknown: SMatrix<f64, STATE, STATE>,
    /// Least covariance when it is known.
    pub known: SMatrix<f64, STATE, STATE>,
    /// Error, on the readings of this entry, of the linear filter that attains the first.
    pub attained: [f64; STATE],
}

impl Limit {
    /// For this entry.
    ///
    /// # Errors
    /// The model has no value at the truth.
    pub fn of(sight: &Sight<'_>) -> Result<Self, EstimatorError> {
        let density = sight.truth.disturbance.density.ln_1p();
        let off = sight.truth.disturbance.entry.map(|off| -off);
        let sigmas = filters::entry_sigmas(sight.config, sight.reading);
        let unknown = along::<WITH_DENSITY, WITH_DENSITY>(
            sight,
            &filters::density_joint(sight.model, 1.0, false),
            Bound::from_error(
                filters::joined(off, &[-density]),
                &filters::joined(sigmas, &[filters::density_sigma(sight.config)]),
            )?,
            &[density],
        )?;
        let known = along::<STATE, STATE>(
            sight,
            &filters::plain_joint(sight.model, sight.truth.disturbance.density),
            Bound::new(&sigmas)?,
            &[],
        )?;
        let mut attained = [0.0; STATE];
        attained.iter_mut().zip(unknown.error()).for_each(|(to, error)| *to = *error);
        Ok(Self { unknown: of_state(&unknown), known: of_state(&known), attained })
    }
}

fn of_state<const J: usize>(bound: &Bound<J>) -> SMatrix<f64, STATE, STATE> {
    bound.covariance().fixed_view::<STATE, STATE>(0, 0).into_owned()
}

fn along<const J: usize, const W: usize>(
    sight: &Sight<'_>,
    joint: &Joint<'_, Cartesian<1>, STATE, 1, W>,
    mut bound: Bound<J>,
    behind: &[f64],
) -> Result<Bound<J>, EstimatorError> {
    for (states, sensed) in sight.truth.states.windows(2).zip(&sight.truth.sensed) {
        let &[before, now] = states else { continue };
        bound.step(joint, &filters::joined(before, behind), sight.config.flight.step_s, &[0.0; J])?;
        let Some(sensed) = sensed else { continue };
        for reading in readings(sight.config, sight.model, sensed, Pressure::Plain).iter().take(sight.scenario.count())
        {
            bound.read(joint, &reading.sensor, &filters::joined(now, behind), reading.value)?;
        }
    }
    Ok(bound)
}
