//! A divided-difference filter's order and its readings.

use super::design::{Family, PARAMETERS, STATES};
use super::engine::{BATCH, Step, Told};
use super::window::Sight;
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::divided::{Divided, Order, Stepped};
use crate::nav::estimators::models::{AXES, Earlier, Reading, Sensor};

fn reading_of<'a>(sight: &Sight, earlier: &'a Earlier<'a>) -> Reading<Sensor<'a, Earlier<'a>>> {
    let sensor = Sensor { vehicle: earlier, quantity: sight.quantity, noise: sight.noise };
    Reading { sensor, value: sight.value }
}

/// P2's adaptive filter: the order of this step by the rank-sampled degree of nonlinearity.
pub(super) fn choose_order(filter: &mut Divided<STATES, PARAMETERS>, step: &Step<'_>) -> Result<(), EstimatorError> {
    if let Family::Divided { by_ranks: Some(threshold), .. } = step.design.family {
        let map = Stepped { process: step.vehicle, step_s: step.step_s };
        let degree = filter.nonlinearity_by_ranks(&map)?;
        filter.set_order(if degree > threshold { Order::Second } else { Order::First });
    }
    Ok(())
}

/// Divided differences take readings in together: their gain is that of the batch.
#[inline(never)]
pub(super) fn correct_together(
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
