//! Every filter as its study flies it when nothing is set: for whoever counts what a step of each costs. `study-image` does
//! on the flight processor, and [`crate::m7`] has what it counted.

use alloc::vec::Vec;

use crate::mmae::roster::{alone, shared_rules};
use crate::mmae::run::{Outcome, Sight};
use crate::{ddf, mmae, sekf, track};

/// Seed of the runs.
const SEED: u64 = 1;

/// A flight that is ready: flies it, and tells whether the filter came through.
pub type Flight<'a> = &'a dyn Fn() -> bool;

/// Readies a flight of so many of the first steps for whom it is handed to.
pub type Ready<'a> = &'a dyn Fn(usize, &mut dyn FnMut(Flight<'_>));

/// A filter to be counted.
pub struct Counted<'a> {
    /// Its study, for [`mmae`] with the scenario.
    pub study: &'a str,
    /// Its name in the tables.
    pub filter: &'a str,
    /// Steps of a whole flight.
    pub steps: usize,
    /// Its flights. What one costs more than a flight of no step is the cost of its steps.
    pub ready: Ready<'a>,
}

impl Counted<'_> {
    /// The most steps that it comes through: for one that stops on its way.
    #[must_use]
    pub fn longest(&self) -> usize {
        let (mut through, mut stopped) = (0, self.steps + 1);
        while stopped - through > 1 {
            let steps = through.midpoint(stopped);
            let mut is_through = false;
            (self.ready)(steps, &mut |fly| is_through = fly());
            if is_through { through = steps } else { stopped = steps }
        }
        through
    }
}

/// Hands every filter of every study over, in the order of the tables.
pub fn each(mut told: impl FnMut(&Counted<'_>)) {
    sekf(&mut told);
    ddf(&mut told);
    mmae::filters::Scenario::BOTH.into_iter().for_each(|scenario| mmae(scenario, &mut told));
}

/// The untuned case: settings change numbers, not the work.
fn sekf(told: &mut impl FnMut(&Counted<'_>)) {
    use sekf::draw::{Draw, Suite};
    let config = sekf::config::Config::default();
    let suite = Suite::new(&config, 1.0);
    let whole = Draw::new(&config, &suite, SEED, 0);
    let setup =
        sekf::filters::Setup { config: &config, suite: &suite, model: config.truth.model(config.experiment.bank_deg) };
    for kind in &config.filters.fly {
        let ready = |steps: usize, go: &mut dyn FnMut(Flight<'_>)| {
            let truth = whole.truth.iter().copied().take(steps).collect();
            let draw = Draw { truth, readings: whole.readings.iter().take(steps).cloned().collect() };
            go(&|| setup.fly(*kind, &config.filters.untuned, &draw, track::Watch::Nothing).failure.is_none());
        };
        told(&Counted { study: "sekf", filter: kind.name(), steps: config.steps(), ready: &ready });
    }
}

fn ddf(told: &mut impl FnMut(&Counted<'_>)) {
    let config = ddf::Config::default();
    let suite = ddf::Suite::new(&config);
    let draw = ddf::Draw::new(&config, &suite, SEED, 0);
    let setup = ddf::Setup::new(&config, &suite);
    for filter in ddf::Filter::of(&config) {
        let ready = |steps: usize, go: &mut dyn FnMut(Flight<'_>)| {
            go(&|| setup.fly(filter, &draw, track::Watch::Nothing, steps).track.failure.is_none());
        };
        told(&Counted { study: "ddf", filter: &filter.name(), steps: config.steps(), ready: &ready });
    }
}

/// The case of the ranking.
fn mmae(scenario: mmae::filters::Scenario, told: &mut impl FnMut(&Counted<'_>)) {
    use mmae::truth::{Draw, fly as fly_truth};
    let mut config = mmae::config::Config::default();
    config.flight.longest_s = mmae::COST_STEPS as f64 * config.flight.step_s;
    let draw = Draw::at_rate(&config, config.ranking.reading, config.ranking.rate_hz);
    let whole = fly_truth(&config, &draw, SEED, 0);
    let model = mmae::filters::model(&config);
    let study = mmae_name(scenario.number());
    let steps = whole.sensed.len();
    let mut hand_over = |label: &str, outcomes: &dyn Fn(&Sight<'_>) -> Vec<Outcome>| {
        let ready = |steps: usize, go: &mut dyn FnMut(Flight<'_>)| {
            let mut truth = whole.clone();
            truth.sensed.truncate(steps);
            let (watch, reading) = (mmae::run::Watch::Nothing, draw.reading);
            let sight = Sight { config: &config, model: &model, scenario, reading, truth: &truth, watch };
            go(&|| outcomes(&sight).iter().all(|outcome| outcome.failure.is_none()));
        };
        told(&Counted { study, filter: label, steps, ready: &ready });
    };
    for name in &config.filters.fly {
        let rules = shared_rules(&config, &[*name], &config.bank.rates);
        for rule in &rules {
            hand_over(&rule.0, &|sight| sight.constants(&config.bank.densities, core::slice::from_ref(rule)));
        }
        if rules.is_empty() {
            hand_over(name.name(), &|sight| alone(*name, sight));
        }
    }
}

/// Name of P3's study by its scenario.
#[must_use]
pub const fn mmae_name(scenario: usize) -> &'static str {
    if scenario == 1 { "mmae-1" } else { "mmae-2" }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_flight_ends_right_before_the_step_that_stops_the_filter() {
        for stops_at in [1, 7, 10, 11] {
            let ready = |steps: usize, go: &mut dyn FnMut(Flight<'_>)| go(&|| steps < stops_at);
            let counted = Counted { study: "s", filter: "f", steps: 10, ready: &ready };
            assert_eq!(counted.longest(), stops_at - 1);
        }
    }

    #[test]
    fn filters_of_every_study_come_through_a_flight_of_no_step() {
        let mut studies = Vec::new();
        each(|counted| {
            let mut came_through = false;
            (counted.ready)(0, &mut |fly| came_through = fly());
            assert!(came_through, "{} {}", counted.study, counted.filter);
            studies.push(counted.study.to_owned());
        });
        studies.dedup();
        assert_eq!(studies, ["sekf", "ddf", "mmae-1", "mmae-2"]);
    }
}
