//! What a step of each filter of a case costs: timed on this machine, looked up for the flight processor.

use super::COST_STEPS;
use super::case::{Case, CaseResult};
use super::config::{Config, FilterName};
use super::filters;
use super::roster::{alone, shared_rules};
use super::run::{Outcome, Watch};
use super::truth::fly;
use crate::{counted, m7};

impl Case {
    /// Times each filter as it would fly, and writes it down in `result`. In each round all of them fly one after the other, so
    /// that what disturbs the machine disturbs all alike.
    pub fn time(&self, config: &Config, seed: u64, rounds: usize, result: &mut CaseResult) {
        let mut truth = fly(config, &self.draw, seed, 0);
        // A short flight is more often left alone by others of the machine.
        truth.sensed.truncate(COST_STEPS);
        truth.states.truncate(COST_STEPS + 1);
        let model = filters::model(config);
        let sight = self.sight(config, &model, &truth, Watch::Nothing);
        let steps = truth.sensed.len();
        let once = |one: &dyn Fn() -> Vec<Outcome>| crate::cost::fastest_ns(1, steps, one);
        let shared = shared_rules(config, &self.filters, &self.rates);
        let mut ekf = f64::INFINITY;
        // A filter that stops on its way has no cost of a whole flight.
        let mut timed: Vec<_> =
            result.filters.iter_mut().filter(|f| f.failed == 0).map(|f| (f, f64::INFINITY)).collect();
        for _ in 0..rounds {
            ekf = ekf.min(once(&|| alone(FilterName::Ekf, &sight)));
            for (filter, least) in &mut timed {
                let rule = shared.iter().find(|(label, _)| *label == filter.label);
                let name = self.filters.iter().find(|name| name.name() == filter.label);
                let ns = match (rule, name) {
                    (Some(rule), _) => once(&|| sight.constants(&config.bank.densities, std::slice::from_ref(rule))),
                    (None, Some(name)) => once(&|| alone(*name, &sight)),
                    (None, None) => continue,
                };
                *least = least.min(ns);
            }
        }
        for (filter, least) in timed {
            (filter.step_ns, filter.ekfs) = (Some(least), Some(least / ekf));
        }
        if config.has_recorded_cost() {
            self.look_up(result);
        }
    }

    /// Writes down what was counted on the Cortex-M7, for this case with the settings as they are when nothing is set.
    fn look_up(&self, result: &mut CaseResult) {
        let count = |label: &str| m7::instructions(counted::mmae_name(self.scenario.number()), label);
        let ekf = count(FilterName::Ekf.name());
        for filter in &mut result.filters {
            filter.m7_instructions = count(&filter.label);
            filter.m7_ekfs = filter.m7_instructions.zip(ekf).map(|(own, ekf)| own / ekf);
        }
    }
}
