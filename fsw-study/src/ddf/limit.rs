//! What no filter can go below: posterior Cramér–Rao bounds of the experiment, averaged over true flights.

use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::{Block, Joint, Layout};
use serde::Serialize;

use super::config::{Config, PARAMETERS, STATES};
use super::draw::{Draw, Suite};
use crate::bound::Bound;
use crate::limit::{Least, Variances, position_variance};

/// The triad of accelerometers.
const AXES: usize = 3;
/// State, parameters, bias of the accelerometers.
const JOINT: usize = STATES + PARAMETERS + AXES;

/// How much is known beside the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knowledge {
    /// Parameters and bias: process noise and sensors alone are left.
    Everything,
    /// Of the parameters the variances W that the desensitized filters go by, of each axis' bias its size.
    Statistics,
}

impl Knowledge {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Everything, Self::Statistics];

    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Everything => "bound, parameters known",
            Self::Statistics => "bound, parameters uncertain",
        }
    }
}

/// A bound of the experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// For a filter that knows what.
    pub knowledge: Knowledge,
    /// Least root mean square error of each state, averaged over time as the filters' are.
    pub rmse: [f64; STATES],
    /// The same of the position, m.
    pub position_rmse_m: f64,
    /// After each step.
    pub history: Vec<[f64; STATES]>,
}

/// Both bounds on the runs of a seed; none where the model has no value along a flight.
#[must_use]
pub fn limits(config: &Config, seed: u64, runs: u64) -> Vec<Limit> {
    let suite = Suite::new(config);
    let limit = |knowledge| {
        let along = |run| along(config, &suite, &Draw::new(config, &suite, seed, run), knowledge);
        let least = Least::over(runs, (config.steps(), config.first_counted()), along).ok()?;
        let Least { rmse, position_rmse_m, history } = least;
        Some(Limit { knowledge, rmse, position_rmse_m, history })
    };
    Knowledge::ALL.into_iter().filter_map(limit).collect()
}

/// The bound along one true flight.
fn along(
    config: &Config,
    suite: &Suite,
    draw: &Draw,
    knowledge: Knowledge,
) -> Result<Variances<STATES>, EstimatorError> {
    let model = config.model();
    let (parameters, bias) = (Block::constant(STATES), Block::constant(STATES + PARAMETERS));
    let layout = Layout { parameters: Some(parameters), bias: Some(bias), ..Layout::default() };
    let joint = Joint::<'_, _, STATES, PARAMETERS, { STATES + PARAMETERS }> {
        model: &model,
        parameters: [0.0; PARAMETERS],
        layout,
    };
    let truth = &config.truth;
    let axis = config.sensors.accelerometer_bias_mps2;
    let known = [truth.density_error, truth.lift_error, axis, axis, axis];
    let mut bound = Bound::new(&joined(config.initial_sigmas(), sigmas(config, knowledge)))?;
    let noise = joined(config.step_noise(), [0.0; PARAMETERS + AXES]);
    let mut before = joined(config.start(), known);
    let mut variances = Vec::new();
    for (step, (readings, state)) in suite.read(&model, draw, 1.0).zip(&draw.truth).enumerate() {
        bound.step(&joint, &before, config.experiment.step_s, &noise)?;
        let now = joined(*state, known);
        for reading in readings.iter().take(suite.count(step)) {
            bound.inform(&joint, &reading.sensor, &now)?;
        }
        let covariance = bound.covariance();
        let place = position_variance(state, |i| covariance[(i, i)]);
        variances.push((std::array::from_fn(|i| covariance[(i, i)]), place));
        before = now;
    }
    Ok(variances)
}

/// Prior deviations of parameters and bias.
fn sigmas(config: &Config, knowledge: Knowledge) -> [f64; PARAMETERS + AXES] {
    match knowledge {
        Knowledge::Everything => [0.0; PARAMETERS + AXES],
        Knowledge::Statistics => {
            let [density, lift] = config.filters.weights.map(f64::sqrt);
            let bias = config.sensors.accelerometer_bias_mps2.abs();
            [density, lift, bias, bias, bias]
        }
    }
}

fn joined(state: [f64; STATES], behind: [f64; PARAMETERS + AXES]) -> [f64; JOINT] {
    let mut joined = [0.0; JOINT];
    joined.iter_mut().zip(state.into_iter().chain(behind)).for_each(|(to, value)| *to = value);
    joined
}

#[cfg(test)]
mod tests {
    use super::super::{Filter, Kind, Suite, fly};
    use super::*;

    /// The truth is what the filters believe.
    fn known() -> Config {
        let mut config = Config::default();
        (config.truth.density_error, config.truth.lift_error) = (0.0, 0.0);
        config.sensors.accelerometer_bias_mps2 = 0.0;
        config
    }

    #[test]
    fn a_filter_of_the_true_parameters_comes_near_the_bound_of_who_knows_them_and_none_goes_below() {
        let config = known();
        let [everything, statistics] = &limits(&config, 3, 40)[..] else { panic!("two bounds") };
        let ekf = fly(&config, &Suite::new(&config), Filter { kind: Kind::Ekf, threshold: None }, 3, 40);
        for (state, (error, least)) in ekf.rmse.iter().zip(&everything.rmse).enumerate() {
            // Forty runs tell a tenth; where errors are linear the filter is the bound's.
            assert!((0.85..1.35).contains(&(error / least)), "state {state}: {}", error / least);
        }
        assert!(everything.rmse.iter().zip(&statistics.rmse).all(|(known, unknown)| known < unknown));
        assert!(everything.position_rmse_m < statistics.position_rmse_m);
    }

    #[test]
    fn no_filter_that_is_wrong_about_the_parameters_is_below_the_bound_of_who_is_uncertain() {
        let config = Config::default();
        let limits = limits(&config, 3, 12);
        for kind in [Kind::Ekf, Kind::EkfTuned, Kind::Rddf1, Kind::Ekf8] {
            let flown = fly(&config, &Suite::new(&config), Filter { kind, threshold: None }, 3, 12);
            assert!(flown.position_rmse_m > limits[0].position_rmse_m, "{kind:?}");
        }
    }
}
