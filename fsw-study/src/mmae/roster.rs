//! The filters of a case, each by its label.

use alloc::borrow::ToOwned;
use alloc::string::String;
use alloc::vec::Vec;
use alloc::{format, vec};

use fsw_core::nav::estimators::weights::Rule;

use super::config::{Config, FilterName};
use super::filters;
use super::run::{Outcome, Sight};

/// Label of a gating by its rate.
#[must_use]
pub fn gating_label(name: FilterName, rate: f64) -> String {
    format!("{} η {rate}", name.name())
}

/// Rules that one bank of the settings' densities serves together, with their labels; `rates` are those of the gatings.
#[must_use]
pub fn shared_rules(config: &Config, filters: &[FilterName], rates: &[f64]) -> Vec<(String, Rule)> {
    let mut rules = Vec::new();
    for filter in filters {
        match filter {
            FilterName::Gating | FilterName::BareGating => {
                let each = rates
                    .iter()
                    .filter_map(|rate| Some((gating_label(*filter, *rate), filters::rule(config, *filter, *rate)?)));
                rules.extend(each);
            }
            FilterName::BareProduct | FilterName::Bayes => {
                rules.extend(filters::rule(config, *filter, 0.0).map(|rule| (filter.name().to_owned(), rule)));
            }
            _ => {}
        }
    }
    rules
}

/// A filter that shares nothing with another.
#[must_use]
pub fn alone(filter: FilterName, sight: &Sight<'_>) -> Vec<Outcome> {
    let Sight { config, reading, model, .. } = *sight;
    let prior = (0.0, filters::density_sigma(config));
    let rules = || {
        filters::rule(config, filter, 0.0).map(|rule| (filter.name().to_owned(), rule)).into_iter().collect::<Vec<_>>()
    };
    match filter {
        FilterName::DeadReckoning => vec![sight.dead_reckoning()],
        FilterName::Ekf => vec![sight.single(filter, &filters::ekf(config, reading, model, 0.0))],
        FilterName::Schmidt => {
            vec![sight.single(filter, &filters::augmented(config, reading, model, prior, true))]
        }
        FilterName::Augmented => {
            vec![sight.single(filter, &filters::augmented(config, reading, model, prior, false))]
        }
        FilterName::GaussMarkov => vec![sight.single(filter, &filters::gauss_markov(config, reading, model))],
        FilterName::BayesFine => sight.constants(&config.bank.fine_densities, &rules()),
        FilterName::Imm => sight.constants(&config.bank.densities, &rules()),
        FilterName::Experts => sight.cells(&rules()),
        FilterName::Gating | FilterName::BareGating | FilterName::BareProduct | FilterName::Bayes => Vec::new(),
    }
}
