//! From the table of all runs to the figures of `summary.json`.

mod conditions;
mod distribution;
mod named;
mod split;
mod verdict;
mod work;

pub use conditions::{Deploy, Peaks, Violations};
pub use distribution::{Bounds, Distribution, Spread, SpreadBounds, Within};
pub use named::Worst;
pub use split::{Split, SplitBounds};
pub use verdict::Unreachable;
pub use work::Guidance;

pub use super::runs::Runs;
pub use super::statistics::ascending;

use std::io;

use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::statistics::{Share, mean, wilson};
use crate::record::ScenarioFacts;

/// Content of `summary.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What was flown.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// First run.
    pub first: u64,
    /// Runs asked for.
    pub runs: u64,
    /// Runs that ended with a parachute.
    pub completed: u64,
    /// Runs deployed inside the box.
    pub success_pct: Option<Share>,
    /// Runs by their end.
    pub outcomes: Vec<(String, u64)>,
    /// Great-circle miss of the completed runs, m.
    pub miss_m: Option<Distribution>,
    /// Share of all runs that deployed within a distance of the target.
    pub within_pct: Within,
    /// What the flight software said of the target.
    pub unreachable: Unreachable,
    /// Error of the navigation at the end, m.
    pub navigation_position_error_m: Option<Distribution>,
    /// The same of velocity, m/s.
    pub navigation_velocity_error_mps: Option<Distribution>,
    /// Mean normalised estimation error squared.
    pub nees_mean: Option<f64>,
    /// Conditions at deployment.
    pub deploy: Deploy,
    /// Largest values along the paths.
    pub peak: Peaks,
    /// Runs beyond a limit of the scenario.
    pub violations: Violations,
    /// Bank reversals.
    pub reversals: Option<Spread>,
    /// Work of guidance.
    pub guidance: Guidance,
    /// Shares of the miss.
    pub split: Option<Split>,
    /// Worst completed runs.
    pub worst: Vec<Worst>,
    /// Runs that did not end with a parachute inside the box, at most as many as are named.
    pub failed: Vec<Worst>,
    /// Wall time of the sitting that flew the last runs, s.
    pub wall_s: f64,
    /// Runs flown in it per second of wall time; none when the runs were flown elsewhere.
    pub runs_per_s: Option<f64>,
}

/// The figures of a table.
///
/// # Errors
/// The table cannot be read.
pub fn summarise(runs: &Runs, identity: &Identity, facts: &ScenarioFacts) -> io::Result<Summary> {
    let misses = runs.numbers("miss_m")?;
    let numbers = runs.numbers("run")?;
    let success = runs.flags("success")?;
    let position = runs.numbers("navigation_position_error_m")?;
    let velocity = runs.numbers("navigation_velocity_error_mps")?;
    Ok(Summary {
        scenario: identity.scenario.clone(),
        seed: identity.seed,
        first: identity.first,
        runs: identity.runs,
        completed: misses.iter().filter(|m| m.is_finite()).count() as u64,
        success_pct: wilson(success.iter().filter(|s| **s).count() as u64, success.len() as u64),
        outcomes: outcomes(&runs.words("outcome")?),
        miss_m: Distribution::of(&misses),
        within_pct: Within::of(&misses),
        unreachable: Unreachable::of(runs, &numbers, &misses)?,
        navigation_position_error_m: Distribution::of(&position),
        navigation_velocity_error_mps: Distribution::of(&velocity),
        nees_mean: mean(&ascending(&runs.numbers("nees_mean")?)),
        deploy: Deploy::of(runs)?,
        peak: Peaks::of(runs)?,
        violations: Violations::of(runs, facts)?,
        reversals: conditions::spread(runs, "reversals")?,
        guidance: Guidance::of(runs)?,
        split: Split::of(runs, &misses)?,
        worst: named::worst(runs, identity, &numbers, &misses)?,
        failed: named::failed(runs, identity, &numbers, &success)?,
        wall_s: 0.0,
        runs_per_s: None,
    })
}

fn outcomes(words: &[Option<String>]) -> Vec<(String, u64)> {
    let mut counts = std::collections::BTreeMap::<&str, u64>::new();
    words.iter().flatten().for_each(|word| *counts.entry(word).or_default() += 1);
    counts.into_iter().map(|(word, count)| (word.to_owned(), count)).collect()
}
