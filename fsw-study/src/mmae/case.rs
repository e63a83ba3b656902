//! A case of the study: many entries, all filters over each, sums of what they did.

use std::collections::BTreeMap;

use serde::Serialize;

use super::config::{Config, FilterName, Reading};
use super::filters::{self, STATE, Scenario};
use super::limit::Limit;
use super::roster::{alone, shared_rules};
use super::run::{Outcome, Sight, Watch};
use super::sums::{Sums, add};
use super::truth::{Draw, Truth, fly};
use crate::bound::MeanBound;
use crate::runs;

/// What is flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Its name in files.
    pub name: &'static str,
    /// Entries.
    pub draw: Draw,
    /// What is read.
    pub scenario: Scenario,
    /// By which filters.
    pub filters: Vec<FilterName>,
    /// Learning rates of the gating filters.
    pub rates: Vec<f64>,
    /// Entries.
    pub runs: u64,
    /// Whether the bound belongs to it: only where the filters' model holds.
    pub has_bound: bool,
}

/// Root mean squares: position (m), velocity (m/s).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Rmse {
    /// x, y, z (m), vx, vy, vz (m/s).
    pub axes: [f64; STATE],
    /// All axes of the position, m.
    pub position_m: f64,
    /// All axes of the velocity, m/s.
    pub velocity_mps: f64,
}

impl Rmse {
    /// Of the mean squares of the components.
    #[must_use]
    pub fn of_squares(squares: [f64; STATE]) -> Self {
        let [x, y, z, vx, vy, vz] = squares;
        Self { axes: squares.map(f64::sqrt), position_m: (x + y + z).sqrt(), velocity_mps: (vx + vy + vz).sqrt() }
    }

    /// Of root mean squares.
    #[must_use]
    pub fn of_roots(roots: [f64; STATE]) -> Self {
        Self::of_squares(roots.map(|root| root * root))
    }
}

/// An instant of the mean over all entries that flew so long.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Moment {
    /// Time since entry.
    pub time_s: f64,
    /// Root mean square error.
    pub rmse: [f64; STATE],
    /// Root mean variance as the filter believes.
    pub sigma: [f64; STATE],
}

/// One entry in full.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Trace {
    /// Times since entry.
    pub time_s: Vec<f64>,
    /// Estimate less truth.
    pub errors: Vec<[f64; STATE]>,
    /// As the filter believes.
    pub sigmas: Vec<[f64; STATE]>,
    /// Of the experts, for a bank.
    pub weights: Vec<Vec<f64>>,
}

/// What a filter did in all entries.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FilterResult {
    /// Its name, with the rate of a gating.
    pub label: String,
    /// Entries.
    pub runs: u64,
    /// Root mean square at the parachute's opening, over the entries in which it came there.
    pub rmse: Rmse,
    /// Mean normalised error there, 6 when the covariance is true.
    pub nees: Option<f64>,
    /// Share of instants with an indefinite covariance.
    pub indefinite_share: f64,
    /// Entries with a large position error at the end, or without an end.
    pub diverged: u64,
    /// Entries in which it stopped.
    pub failed: u64,
    /// What it said then, and the earliest and latest time.
    pub failure: Option<Failure>,
    /// Nanoseconds of a step on the host.
    pub step_ns: Option<f64>,
    /// The same over that of one EKF.
    pub ekfs: Option<f64>,
    /// Instructions of a step on the Cortex-M7, where they were counted for this configuration.
    pub m7_instructions: Option<f64>,
    /// The same over those of one EKF.
    pub m7_ekfs: Option<f64>,
    /// Mean over entries.
    pub history: Vec<Moment>,
    /// The only entry of a case that has no other.
    pub first: Trace,
}

/// How a filter stopped.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Failure {
    /// In its words.
    pub words: String,
    /// Earliest, s after entry.
    pub first_s: f64,
    /// Latest.
    pub last_s: f64,
}

/// The bound at the parachute's opening.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BoundResult {
    /// When the density is unknown.
    pub unknown_density: Rmse,
    /// When it is known.
    pub known_density: Rmse,
    /// Errors, on the very draws of the case, of the linear filter that attains the first: it scatters about the bound with
    /// the number of entries, and the errors of filters scatter with it.
    pub attained: Rmse,
}

/// A case flown.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseResult {
    /// Its name.
    pub name: &'static str,
    /// 1 or 2.
    pub scenario: usize,
    /// What Table 1 means.
    pub reading: Reading,
    /// Readings a second.
    pub rate_hz: f64,
    /// Entries.
    pub runs: u64,
    /// The bound, where the filters' model holds.
    pub bound: Option<BoundResult>,
    /// The filters.
    pub filters: Vec<FilterResult>,
}

impl CaseResult {
    /// A filter by its label.
    #[must_use]
    pub fn filter(&self, label: &str) -> Option<&FilterResult> {
        self.filters.iter().find(|filter| filter.label == label)
    }

    /// The gating with the least position error.
    #[must_use]
    pub fn best_gating(&self) -> Option<&FilterResult> {
        let is_gating = |f: &&FilterResult| f.label.starts_with("gating") && f.failed < f.runs;
        self.filters.iter().filter(is_gating).min_by(|a, b| a.rmse.position_m.total_cmp(&b.rmse.position_m))
    }
}

impl Case {
    /// All filters over one entry.
    fn outcomes(&self, sight: &Sight<'_>) -> Vec<Outcome> {
        let mut outcomes = Vec::new();
        let shared = shared_rules(sight.config, &self.filters, &self.rates);
        if !shared.is_empty() {
            outcomes.extend(sight.constants(&sight.config.bank.densities, &shared));
        }
        for filter in &self.filters {
            outcomes.extend(alone(*filter, sight));
        }
        outcomes
    }

    fn run(&self, config: &Config, seed: u64, run: u64) -> (Vec<Outcome>, Option<Limit>) {
        let truth = fly(config, &self.draw, seed, run);
        let model = filters::model(config);
        let sight = self.sight(config, &model, &truth, Watch::Record);
        (self.outcomes(&sight), if self.has_bound { Limit::of(&sight).ok() } else { None })
    }

    pub(super) fn sight<'a>(
        &self,
        config: &'a Config,
        model: &'a fsw_core::nav::estimators::models::Cartesian<1>,
        truth: &'a Truth,
        watch: Watch,
    ) -> Sight<'a> {
        Sight { config, model, scenario: self.scenario, reading: self.draw.reading, truth, watch }
    }

    /// Flies all entries; `told` is called after each.
    #[must_use]
    pub fn fly(&self, config: &Config, seed: u64, mut told: impl FnMut(u64)) -> CaseResult {
        let mut sums: BTreeMap<usize, Sums> = BTreeMap::new();
        let (mut unknown, mut known) = (MeanBound::default(), MeanBound::default());
        let (mut attained, mut limited) = ([0.0; STATE], 0u64);
        runs::for_each(
            self.runs,
            |run| self.run(config, seed, run),
            |run, (outcomes, limit)| {
                for (at, outcome) in outcomes.iter().enumerate() {
                    sums.entry(at).or_default().add(outcome, config.flight.divergence_m);
                }
                if let Some(limit) = limit {
                    unknown.add(&limit.unknown);
                    known.add(&limit.known);
                    add(&mut attained, limit.attained.iter().map(|error| error * error));
                    limited += 1;
                }
                told(run);
            },
        );
        let bound = BoundResult {
            unknown_density: Rmse::of_roots(unknown.rmse()),
            known_density: Rmse::of_roots(known.rmse()),
            attained: Rmse::of_squares(attained.map(|sum| sum / limited as f64)),
        };
        let mut results: Vec<_> = sums.into_values().map(Sums::result).collect();
        let order = |result: &FilterResult| {
            let is = |name: &FilterName| result.label.split(' ').next() == Some(name.name());
            self.filters.iter().position(is)
        };
        results.sort_by_key(order);
        CaseResult {
            name: self.name,
            scenario: self.scenario.number(),
            reading: self.draw.reading,
            rate_hz: 1.0 / (self.draw.every as f64 * config.flight.step_s),
            runs: self.runs,
            bound: self.has_bound.then_some(bound),
            filters: results,
        }
    }
}
