//! [`Engine`]: the kernel that flies, whichever it is, behind one face: started, given its share of the work frame by frame,
//! and asked what it knows.

use super::design::{Design, PARAMETERS, STATES, WITH_INPUT, WITH_PARAMETERS};
use super::window::Sight;
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::nav::estimators::EstimatorError;
use crate::nav::estimators::joint::Joint;
use crate::nav::estimators::linear::{Innovation, Linear};
use crate::nav::estimators::models::{AXES, Earlier, Onboard, Reading, Sensor};

/// Derivatives by position and velocity.
const NARROW: usize = STATES;
/// And by the parameters.
const WIDE: usize = STATES + PARAMETERS;

/// The filter at work. All zero bytes when there is none.
#[derive(Clone, Debug)]
#[repr(u8)]
#[allow(clippy::large_enum_variant, reason = "one filter at a time, in memory that is there for the largest")]
pub enum Engine {
    /// None.
    Empty = 0,
    /// Position and velocity.
    Plain(Linear<STATES>) = 1,
    /// With an unknown input.
    Input(Linear<WITH_INPUT>) = 2,
    /// With parameters and accelerometer bias.
    Parameters(Linear<WITH_PARAMETERS>) = 3,
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

impl Engine {
    /// Starts the filter of a design in place.
    ///
    /// # Errors
    /// Knowledge that is not finite; there is no engine then.
    pub fn start(
        &mut self,
        design: &Design,
        state: &[f64; STATES],
        knowledge: &InitialKnowledge,
        parameters: &NavigationParameters,
    ) -> Result<(), EstimatorError> {
        use super::design::Family;
        *self = Self::Empty;
        *self = match design.family {
            Family::Plain => Self::Plain(started(design, state, knowledge, parameters)?),
            Family::Tied(_) | Family::Input => Self::Input(started(design, state, knowledge, parameters)?),
            Family::Augmented | Family::Considered => Self::Parameters(started(design, state, knowledge, parameters)?),
        };
        Ok(())
    }

    /// Carries the estimate over a step.
    ///
    /// # Errors
    /// The estimate or its covariance has left the range of numbers.
    pub fn predict(&mut self, step: &Step<'_>) -> Result<(), EstimatorError> {
        match self {
            Self::Empty => Ok(()),
            Self::Plain(filter) => predict::<_, NARROW>(filter, step),
            Self::Input(filter) => predict::<_, NARROW>(filter, step),
            Self::Parameters(filter) => predict::<_, WIDE>(filter, step),
        }
    }

    /// Takes in a reading of the window that the prediction has covered.
    ///
    /// # Errors
    /// As [`Self::predict`], or a measurement that has no value here.
    pub fn correct(
        &mut self,
        step: &Step<'_>,
        earlier: &Earlier<'_>,
        sight: &Sight,
        gate_sigma: f64,
    ) -> Result<Option<Innovation>, EstimatorError> {
        let reading = Reading {
            sensor: Sensor { vehicle: earlier, quantity: sight.quantity, noise: sight.noise },
            value: sight.value,
        };
        match self {
            Self::Empty => Ok(None),
            Self::Plain(filter) => correct::<_, NARROW>(filter, step, earlier, &reading, gate_sigma),
            Self::Input(filter) => correct::<_, NARROW>(filter, step, earlier, &reading, gate_sigma),
            Self::Parameters(filter) => correct::<_, WIDE>(filter, step, earlier, &reading, gate_sigma),
        }
    }

    /// The filter's self-calibration has not begun: what it holds of its input is forgotten.
    pub fn forget_input(&mut self) {
        if let Self::Input(filter) = self {
            filter.forget(STATES, STATES);
        }
    }

    /// Position and velocity.
    #[must_use]
    pub fn state(&self) -> [f64; STATES] {
        match self {
            Self::Empty => [0.0; STATES],
            Self::Plain(filter) => first(filter.state()),
            Self::Input(filter) => first(filter.state()),
            Self::Parameters(filter) => first(filter.state()),
        }
    }

    /// Covariance of two components of position and velocity.
    #[must_use]
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Empty => 0.0,
            Self::Plain(filter) => filter.covariance(i, j),
            Self::Input(filter) => filter.covariance(i, j),
            Self::Parameters(filter) => filter.covariance(i, j),
        }
    }

    /// What else it has learned.
    #[must_use]
    pub fn beyond(&self) -> Beyond {
        match self {
            Self::Empty | Self::Plain(_) | Self::Input(_) => Beyond::default(),
            Self::Parameters(filter) => {
                let [_, _, _, _, _, _, log_density, lift_error, x, y, z] = *filter.state();
                Beyond {
                    log_density: Some((log_density, filter.sigma(STATES))),
                    lift_error,
                    accelerometer_bias_mps2: [x, y, z],
                }
            }
        }
    }
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

#[inline(never)]
fn predict<const J: usize, const W: usize>(filter: &mut Linear<J>, step: &Step<'_>) -> Result<(), EstimatorError> {
    let layout = step.design.layout(step.step_s, step.persistence);
    let joint = Joint::<_, STATES, PARAMETERS, W> { model: step.vehicle, parameters: [0.0; PARAMETERS], layout };
    let noise = step.design.noise(step.step_s, step.force_mps2, step.persistence, step.parameters);
    filter.predict(&joint, step.step_s, &noise)
}

#[inline(never)]
fn correct<const J: usize, const W: usize>(
    filter: &mut Linear<J>,
    step: &Step<'_>,
    earlier: &Earlier<'_>,
    reading: &Reading<Sensor<'_, Earlier<'_>>>,
    gate_sigma: f64,
) -> Result<Option<Innovation>, EstimatorError> {
    let layout = step.design.layout(step.step_s, step.persistence);
    let joint = Joint::<_, STATES, PARAMETERS, W> { model: earlier, parameters: [0.0; PARAMETERS], layout };
    filter.correct(&joint, reading, gate_sigma).map(Some)
}
