//! All cases of the study, flown.

use serde::Serialize;

use super::case::{Case, CaseResult};
use super::config::{Config, FilterName};
use super::filters::Scenario;
use super::truth::Draw;

/// Short flights of which the fastest is a filter's cost.
pub const TIMED_FLIGHTS: usize = 60;

/// The whole study, flown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Study {
    /// P3's special case, both scenarios.
    pub fixed: Vec<CaseResult>,
    /// P3's Monte Carlo.
    pub table5: Vec<CaseResult>,
    /// All filters against the bound.
    pub ranking: Vec<CaseResult>,
    /// The augmented filter against the bound, on more draws.
    pub efficiency: Vec<CaseResult>,
    /// All filters where none of the models holds.
    pub robust: Vec<CaseResult>,
}

/// Cases in the order in which they are flown.
#[must_use]
pub fn cases(config: &Config, runs: u64) -> Vec<Case> {
    let draw = |reading, rate_hz| Draw::at_rate(config, reading, rate_hz);
    let mut all = Vec::new();
    for scenario in Scenario::BOTH {
        let at = scenario.index();
        let (fixed, table5, ranking) = (config.fixed, config.table5, config.ranking);
        all.push(Case {
            name: "fixed",
            draw: Draw { fixed_density: Some(fixed.density), ..draw(fixed.reading, fixed.rate_hz) },
            scenario,
            filters: vec![FilterName::Ekf, FilterName::Gating],
            rates: fixed.rates.get(at).copied().into_iter().collect(),
            runs: 1,
            has_bound: false,
        });
        all.push(Case {
            name: "table5",
            draw: draw(table5.reading, table5.rate_hz),
            scenario,
            filters: vec![FilterName::Gating, FilterName::Augmented],
            rates: table5.rates.get(at).copied().into_iter().collect(),
            runs,
            has_bound: true,
        });
        all.push(Case {
            name: "ranking",
            draw: draw(ranking.reading, ranking.rate_hz),
            scenario,
            filters: config.filters.fly.clone(),
            rates: config.bank.rates.clone(),
            runs,
            has_bound: true,
        });
        let share = config.efficiency.share_of_runs;
        if share > 0.0 && config.filters.fly.contains(&FilterName::Augmented) {
            all.push(Case {
                name: "efficiency",
                draw: draw(ranking.reading, ranking.rate_hz),
                scenario,
                filters: vec![FilterName::Augmented],
                rates: Vec::new(),
                runs: part(runs, share),
                has_bound: true,
            });
        }
        let is_taught = |filter: &FilterName| {
            !matches!(filter, FilterName::BareGating | FilterName::BareProduct | FilterName::BayesFine)
        };
        all.push(Case {
            name: "robust",
            draw: Draw { is_robust: true, ..draw(ranking.reading, ranking.rate_hz) },
            scenario,
            filters: config.filters.fly.iter().copied().filter(is_taught).collect(),
            rates: config.bank.rates.clone(),
            runs: part(runs, config.robust.share_of_runs),
            has_bound: false,
        });
    }
    all
}

/// A share of the runs, one at least.
fn part(runs: u64, share: f64) -> u64 {
    ((runs as f64 * share).round() as u64).max(1)
}

impl Study {
    /// Every case, in the order of the page.
    pub fn all(&self) -> impl Iterator<Item = &CaseResult> {
        [&self.fixed, &self.table5, &self.ranking, &self.efficiency, &self.robust].into_iter().flatten()
    }

    /// Flies everything. `told` hears the case and the entry after each.
    #[must_use]
    pub fn fly(config: &Config, seed: u64, runs: u64, mut told: impl FnMut(&Case, u64)) -> Self {
        let mut study = Self::default();
        for case in cases(config, runs) {
            let mut result = case.fly(config, seed, |run| told(&case, run));
            match case.name {
                "fixed" => study.fixed.push(result),
                "table5" => study.table5.push(result),
                "ranking" => {
                    case.time(config, seed, TIMED_FLIGHTS, &mut result);
                    study.ranking.push(result);
                }
                "efficiency" => study.efficiency.push(result),
                _ => study.robust.push(result),
            }
        }
        study
    }
}
