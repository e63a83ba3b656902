//! The tuned EKFs: process noise and what is believed of accelerations and pressure, searched on runs of their own.

use super::config::{Config, Factors, STATES};
use super::draw::{Draw, Suite};
use super::filters::{Filter, Kind, Setup};
use crate::runs::for_each;
use crate::tally::{Divergence, Tally, geometric_ratio, mean_from, means_from};
use crate::track::Watch;
use serde::Serialize;

/// A pair of the grid and what became of it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tuned {
    /// Factor on the process noise.
    pub process: f64,
    /// Factor on the noise of accelerations and pressure.
    pub sensors: f64,
    /// Root mean square errors of the states, averaged over time: m, m/s, rad.
    pub rmse: [f64; STATES],
    /// Of the position, m.
    pub position_rmse_m: f64,
}

impl Tuned {
    /// What the search minimises: the geometric mean over the six states, in any unit.
    #[must_use]
    pub fn cost(&self) -> f64 {
        geometric_ratio(&self.rmse, &[1.0; STATES])
    }
}

/// The whole grid of [`Kind::EkfTuned`] or [`Kind::EkfForces`], the best first.
#[must_use]
pub fn search(config: &Config, kind: Kind) -> Vec<Tuned> {
    let suite = Suite::new(config);
    let tuning = &config.tuning;
    let pairs =
        tuning.process.iter().flat_map(|process| tuning.sensors.iter().map(move |sensors| (*process, *sensors)));
    let mut all: Vec<Tuned> = pairs.map(|pair| fly(config, &suite, kind, pair)).collect();
    all.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    all
}

fn fly(config: &Config, suite: &Suite, kind: Kind, (process, sensors): (f64, f64)) -> Tuned {
    let mut config = config.clone();
    (config.filters.tuned, config.filters.forces) = (Factors { process, sensors }, Factors { process, sensors });
    let (steps, setup) = (config.steps(), Setup::new(&config, suite));
    let filter = Filter { kind, threshold: None };
    let mut tally = Tally::new(steps);
    let from = config.first_counted();
    let divergence = Divergence { from_step: from, beyond_m: config.experiment.divergence_m };
    let one = |run| setup.fly(filter, &Draw::new(&config, suite, config.tuning.seed, run), Watch::All, steps);
    for_each(config.tuning.runs, one, |_, flight| tally.add(&flight.track, divergence));
    let rmse = means_from(&tally.history(), from);
    Tuned { process, sensors, rmse, position_rmse_m: mean_from(&tally.position_history_m(), from) }
}
