//! What no filter can go below: posterior Cramér–Rao bounds of the experiment, averaged over true flights.

use fsw_core::nav::estimators::EstimatorError;
use fsw_core::nav::estimators::joint::{Block, Joint, Layout};
use fsw_core::nav::estimators::models::{Noise, Sensor, Spherical};
use serde::Serialize;

use super::STATES;
use super::cases::Case;
use super::config::Config;
use super::draw::{Draw, Suite};
use super::filters::{PARAMETERS, WITH_BIAS, WITH_INPUT, WITH_PARAMETERS};
use crate::bound::Bound;
use crate::limit::{Least, Variances, position_variance};

/// Width of the derivatives.
const WIDTH: usize = STATES + PARAMETERS;

/// How much is known beside the sensors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Knowledge {
    /// Input, parameters and bias: the sensors alone are left.
    Everything,
    /// Of the input when it jumps and its root mean square, component by component; of the bias, and in the case of wrong
    /// parameters of those, the deviations that the filters start with.
    Statistics,
}

impl Knowledge {
    /// Name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Everything => "bound, input known",
            Self::Statistics => "bound, unknown",
        }
    }
}

/// A bound of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Limit {
    /// For a filter that knows what.
    pub knowledge: Knowledge,
    /// Least root mean square error of each state, averaged over time as the filters' are.
    pub rmse: [f64; STATES],
    /// The same of the position, m.
    pub position_rmse_m: f64,
    /// Geometric mean over the states of (RMSE of the EKF)/(this); not a number until the EKF has flown.
    pub ratio_to_ekf: f64,
    /// After each step.
    #[serde(skip)]
    pub history: Vec<[f64; STATES]>,
}

/// Both bounds of a case; none when the model has no value along a flight.
#[must_use]
pub fn limits(case: &Case, config: &Config, suite: &Suite, (seed, runs): (u64, u64)) -> Vec<Limit> {
    let all = [Knowledge::Everything, Knowledge::Statistics];
    all.into_iter().filter_map(|knowledge| limit(case, config, suite, (seed, runs), knowledge).ok()).collect()
}

fn limit(
    case: &Case,
    config: &Config,
    suite: &Suite,
    (seed, runs): (u64, u64),
    knowledge: Knowledge,
) -> Result<Limit, EstimatorError> {
    let along = |run| along(case, config, suite, &Draw::new(config, suite, seed, run), knowledge);
    let Least { rmse, position_rmse_m, history } = Least::over(runs, (config.steps(), config.first_averaged()), along)?;
    Ok(Limit { knowledge, rmse, position_rmse_m, ratio_to_ekf: f64::NAN, history })
}

/// The bound along one true flight.
fn along(
    case: &Case,
    config: &Config,
    suite: &Suite,
    draw: &Draw,
    knowledge: Knowledge,
) -> Result<Variances<STATES>, EstimatorError> {
    let model = config.truth.model(config.experiment.bank_deg);
    let step_s = config.experiment.step_s;
    let (prior, noise) = deviations(case, config, knowledge);
    let mut bound = Bound::new(&prior)?;
    let mut before = joined(config, &config.truth.state(), 0);
    let mut variances = Vec::new();
    for (index, truth) in draw.truth.iter().enumerate() {
        let piece = |step: usize| config.input.piece(step as f64 * step_s);
        let is_last_of_piece = piece(index + 1) != piece(index);
        let mut noise = noise;
        if is_last_of_piece {
            noise.iter_mut().zip(&prior).skip(STATES).take(STATES).for_each(|(noise, sigma)| *noise = *sigma);
        }
        bound.step(&joint(&model, step_s, is_last_of_piece), &before, step_s, &noise)?;
        let now = joined(config, truth, index + 1);
        for (quantity, sigma) in suite.at(index) {
            let sensor = Sensor { vehicle: &model, quantity: *quantity, noise: Noise::of(*sigma) };
            bound.inform(&joint(&model, step_s, false), &sensor, &now)?;
        }
        let covariance = bound.covariance();
        variances.push((std::array::from_fn(|i| covariance[(i, i)]), position_variance(truth, |i| covariance[(i, i)])));
        before = now;
    }
    Ok(variances)
}

/// The joint state of the filter that estimates all: a rate b, parameters, bias. At a jump b is forgotten.
fn joint(model: &Spherical, step_s: f64, is_jump: bool) -> Joint<'_, Spherical, STATES, PARAMETERS, WIDTH> {
    let input = Block { first: STATES, persistence: if is_jump { 0.0 } else { 1.0 } };
    let layout = Layout {
        input: Some((input, step_s)),
        parameters: Some(Block::constant(WITH_INPUT)),
        bias: Some(Block::constant(WITH_PARAMETERS)),
    };
    Joint { model, parameters: [0.0; PARAMETERS], layout }
}

/// Prior and process noise of a step.
fn deviations(case: &Case, config: &Config, knowledge: Knowledge) -> ([f64; WITH_BIAS], [f64; WITH_BIAS]) {
    let (mut prior, mut noise) = ([0.0; WITH_BIAS], [0.0; WITH_BIAS]);
    let states = config.truth.state().into_iter().zip(config.initial.state());
    prior.iter_mut().zip(states).for_each(|(sigma, (truth, initial))| *sigma = (initial - truth).abs());
    let root = config.experiment.step_s.sqrt();
    noise.iter_mut().zip(config.experiment.process_noise).for_each(|(noise, sigma)| *noise = sigma * root);
    if knowledge == Knowledge::Statistics {
        let filters = &config.filters;
        let (density, lift) = if case.is_wrong { (filters.density_sigma, filters.lift_sigma) } else { (0.0, 0.0) };
        let bias = filters.bias_sigma_mps2;
        let behind = config.input.root_mean_square().into_iter().chain([density, lift, bias, bias, bias]);
        prior.iter_mut().skip(STATES).zip(behind).for_each(|(sigma, value)| *sigma = value);
    }
    (prior, noise)
}

/// The true joint state after `step` steps.
fn joined(config: &Config, state: &[f64; STATES], step: usize) -> [f64; WITH_BIAS] {
    let alpha = config.input.alpha(step as f64 * config.experiment.step_s);
    let bias = config.sensors.accelerometer_bias_mps2;
    let behind = config.input.amplitude.map(|amplitude| amplitude * alpha).into_iter();
    let all = state.iter().copied().chain(behind).chain([0.0; PARAMETERS]).chain([bias; 3]);
    let mut joined = [0.0; WITH_BIAS];
    joined.iter_mut().zip(all).for_each(|(to, value)| *to = value);
    joined
}

#[cfg(test)]
mod tests {
    use super::super::cases::{CASES, fly};
    use super::super::kind::Kind;
    use super::*;

    #[test]
    fn to_know_less_bounds_higher_and_no_tuned_filter_is_below() {
        let mut config = Config::default();
        config.filters.fly = vec![Kind::Ekf, Kind::Aekf17];
        for case in CASES.iter().filter(|case| case.is_tuned) {
            let tuned = super::super::tuned::TunedFile::shipped().unwrap().tuned;
            let flown = fly(case, (&config, &tuned), (3, 12));
            let [known, unknown] = flown.limits.as_slice() else { panic!("two bounds") };
            assert!(known.position_rmse_m < unknown.position_rmse_m);
            for state in 0..STATES {
                assert!(known.rmse[state] < unknown.rmse[state], "state {state}");
                for outcome in &flown.filters {
                    assert!(known.rmse[state] < outcome.rmse[state], "state {state} of {:?}", outcome.filter);
                }
            }
        }
    }

    #[test]
    fn a_kalman_filter_that_knows_everything_has_the_bound_as_its_covariance() {
        // Without input and bias the EKF is the filter that the first bound is of: its errors come near it.
        let mut config = Config::default();
        config.input.amplitude = [0.0; STATES];
        config.sensors.accelerometer_bias_mps2 = 0.0;
        config.filters.bias_sigma_mps2 = 0.0;
        config.filters.fly = vec![Kind::Ekf];
        let flown = fly(&CASES[0], (&config, &[]), (3, 40));
        let (ekf, bound) = (&flown.filters[0], &flown.limits[0]);
        // The initial error is one deviation in every run, not a draw: it fades, and 40 runs tell a tenth.
        for (state, (error, least)) in ekf.rmse.iter().zip(&bound.rmse).enumerate() {
            assert!((0.85..1.25).contains(&(error / least)), "state {state}: {}", error / least);
        }
        assert!((4.5..8.0).contains(&ekf.nees), "{}", ekf.nees);
    }
}
