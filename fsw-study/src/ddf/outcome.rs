//! All runs of a filter.

use serde::Serialize;

use super::config::{Config, STATES};
use super::draw::{Draw, Suite};
use super::filters::{Filter, Setup};
use crate::cost::fastest_ns;
use crate::m7;
use crate::runs::for_each;
use crate::tally::{Divergence, Tally, mean_from, means_from};
use crate::track::Watch;

/// Flights that are timed, of which the fastest counts: enough for one of them to be left alone by others of the machine.
const TIMED: usize = 15;

/// What became of a filter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Which.
    pub filter: Filter,
    /// Its name.
    pub name: String,
    /// Root mean square errors of the states, averaged over time: m, m/s, rad.
    pub rmse: [f64; STATES],
    /// Of the position, m.
    pub position_rmse_m: f64,
    /// Mean normalised estimation error squared over the same time; 6 is right.
    pub nees: f64,
    /// Share of steps whose covariance is indefinite.
    pub indefinite_share: f64,
    /// Runs whose position error went beyond the bound, or that failed.
    pub diverged: u64,
    /// Runs stopped by an error of the filter.
    pub failed: u64,
    /// Share of all steps that were of second order.
    pub second_share: f64,
    /// Time of a whole run on this machine, ms, the fastest of some.
    pub host_ms_per_run: f64,
    /// Instructions of a step on the Cortex-M7, where they were counted for this configuration.
    pub m7_instructions_per_step: Option<f64>,
    /// Root mean square errors after each step.
    pub history: Vec<[f64; STATES]>,
    /// Share of runs in second order after each step; empty for linearised filters.
    pub second_history: Vec<f64>,
    /// Mean over runs of the degree of nonlinearity; likewise.
    pub nonlinearity_history: Vec<f64>,
}

/// Flies every filter of a configuration over the same runs; `done` is told each.
#[must_use]
pub fn fly_all(config: &Config, seed: u64, runs: u64, mut done: impl FnMut(&Outcome)) -> Vec<Outcome> {
    let suite = Suite::new(config);
    let one = |filter| {
        let outcome = fly(config, &suite, filter, seed, runs);
        done(&outcome);
        outcome
    };
    Filter::of(config).into_iter().map(one).collect()
}

/// Flies one filter.
#[must_use]
pub fn fly(config: &Config, suite: &Suite, filter: Filter, seed: u64, runs: u64) -> Outcome {
    let (steps, setup) = (config.steps(), Setup::new(config, suite));
    let mut tally = Tally::new(steps);
    let mut degrees = vec![(0u64, 0.0, 0u64); steps];
    let divergence = Divergence { from_step: config.first_counted(), beyond_m: config.experiment.divergence_m };
    let one = |run| setup.fly(filter, &Draw::new(config, suite, seed, run), Watch::All, steps);
    for_each(runs, one, |_, flight| {
        tally.add(&flight.track, divergence);
        for ((seconds, sum, count), degree) in degrees.iter_mut().zip(&flight.degrees) {
            *seconds += u64::from(degree.is_second);
            *sum += degree.nonlinearity;
            *count += 1;
        }
    });
    let from = config.first_counted();
    let history = tally.history();
    let known: Vec<_> = degrees.iter().take_while(|(_, _, count)| *count > 0).collect();
    let (seconds, all) = known.iter().fold((0, 0), |(a, b), (seconds, _, count)| (a + seconds, b + count));
    let draw = Draw::new(config, suite, seed, 0);
    Outcome {
        name: filter.name(),
        rmse: means_from(&history, from),
        position_rmse_m: mean_from(&tally.position_history_m(), from),
        nees: mean_from(&tally.nees_history(), from),
        indefinite_share: tally.indefinite_share(),
        diverged: tally.diverged,
        failed: tally.failed,
        second_share: if all == 0 { 0.0 } else { seconds as f64 / all as f64 },
        host_ms_per_run: 1e-6 * fastest_ns(TIMED, 1, || setup.fly(filter, &draw, Watch::Nothing, steps)),
        m7_instructions_per_step: m7::instructions("ddf", &filter.name()).filter(|_| config.has_recorded_cost()),
        history,
        second_history: known.iter().map(|(seconds, _, count)| *seconds as f64 / *count as f64).collect(),
        nonlinearity_history: known.iter().map(|(_, sum, count)| sum / *count as f64).collect(),
        filter,
    }
}

/// Flies the first `steps` steps of run 0 of a filter and looks at nothing: for whoever counts instructions.
pub fn fly_steps(config: &Config, filter: Filter, steps: usize) {
    let suite = Suite::new(config);
    let draw = Draw::new(config, &suite, 1, 0);
    std::hint::black_box(Setup::new(config, &suite).fly(filter, &draw, Watch::Nothing, steps));
}
