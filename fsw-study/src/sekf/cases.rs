//! The cases of the study and the engine that flies them: the same draws for every filter, sums in the order of the runs.

use serde::Serialize;

use super::STATES;
use super::config::{Config, Settings};
use super::draw::{Draw, Suite};
use super::filters::Setup;
use super::kind::Kind;
use super::limit::{Limit, limits};
use super::tuned::Tuned;
use crate::cost::fastest_ns;
use crate::tally::{Divergence, Tally, geometric_ratio, mean_from, means_from};
use crate::track::{Track, Watch};
use crate::{m7, runs};

/// Flights that are timed; the fastest counts.
const TIMED_FLIGHTS: usize = 5;
/// The pull-in, whose largest error is told, s.
const PULL_IN_S: f64 = 100.0;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// Name in files.
    pub name: &'static str,
    /// Heading.
    pub title: &'static str,
    /// Factor on the noise of the sensors.
    pub noise_factor: f64,
    /// The filters believe Table 1's wrong vehicle and density.
    pub is_wrong: bool,
    /// Settings were searched for each filter.
    pub is_tuned: bool,
}

/// All cases; the paper's own first.
pub const CASES: [Case; 5] = [
    Case { name: "untuned", title: "untuned, noise as given", noise_factor: 1.0, is_wrong: false, is_tuned: false },
    Case { name: "untuned-0.1", title: "untuned, noise × 0.1", noise_factor: 0.1, is_wrong: false, is_tuned: false },
    Case {
        name: "untuned-0.01", title: "untuned, noise × 0.01", noise_factor: 0.01, is_wrong: false, is_tuned: false
    },
    Case { name: "tuned", title: "each filter tuned", noise_factor: 1.0, is_wrong: false, is_tuned: true },
    Case {
        name: "tuned-wrong",
        title: "each filter tuned, parameters wrong as in Table 1",
        noise_factor: 1.0,
        is_wrong: true,
        is_tuned: true,
    },
];

impl Case {
    /// The sensors of this case.
    #[must_use]
    pub fn suite(&self, config: &Config) -> Suite {
        Suite::new(config, self.noise_factor)
    }

    /// What the filters know in this case.
    #[must_use]
    pub fn setup<'a>(&self, config: &'a Config, suite: &'a Suite) -> Setup<'a> {
        let believed = if self.is_wrong { &config.initial } else { &config.truth };
        Setup { config, suite, model: believed.model(config.experiment.bank_deg) }
    }

    /// The settings of a filter in this case.
    #[must_use]
    pub fn settings(&self, config: &Config, tuned: &[Tuned], kind: Kind) -> Settings {
        let found = tuned.iter().find(|line| line.case == self.name && line.filter == kind.tuned_as());
        match found {
            Some(line) if self.is_tuned => line.settings,
            _ => config.filters.untuned,
        }
    }
}

/// A case with its outcomes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Flown {
    /// Name.
    pub case: &'static str,
    /// Heading.
    pub title: &'static str,
    /// One of each filter.
    pub filters: Vec<Outcome>,
    /// What none of them can go below.
    pub limits: Vec<Limit>,
}

/// What a filter did in all runs of a case.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Which filter.
    pub filter: Kind,
    /// With which settings.
    pub settings: Settings,
    /// Root mean square error of each state, averaged over time: m, m/s, rad, rad, rad, rad.
    pub rmse: [f64; STATES],
    /// The same of the position, m.
    pub position_rmse_m: f64,
    /// Geometric mean over the states of (RMSE of the EKF)/(RMSE of this filter).
    pub ratio_to_ekf: f64,
    /// Largest root mean square position error of the first 100 s without the first step, m.
    pub pull_in_peak_m: f64,
    /// Mean normalised estimation error squared of the six states over the same time; 6 is right.
    pub nees: f64,
    /// Share of all steps with an indefinite covariance.
    pub indefinite_share: f64,
    /// Runs with a position error beyond the bound after the pull-in, or stopped by an error.
    pub diverged: u64,
    /// Those of them that were stopped by an error.
    pub failed: u64,
    /// Host time of a step, ns, the fastest of some flights; not a number when runs were stopped.
    pub host_ns_per_step: f64,
    /// Instructions of a step on the Cortex-M7, where they were counted for this configuration.
    pub m7_instructions_per_step: Option<f64>,
    /// Root mean square error of each state after each step.
    #[serde(skip)]
    pub history: Vec<[f64; STATES]>,
    /// Errors of run 0 after each step.
    #[serde(skip)]
    pub single: Vec<[f64; STATES]>,
}

/// Flies the filters of a configuration in a case, over runs 0 to `runs` − 1 of a seed.
#[must_use]
pub fn fly(case: &Case, (config, tuned): (&Config, &[Tuned]), (seed, runs): (u64, u64)) -> Flown {
    let suite = case.suite(config);
    let setup = case.setup(config, &suite);
    let filters: Vec<(Kind, Settings)> =
        config.filters.fly.iter().map(|kind| (*kind, case.settings(config, tuned, *kind))).collect();
    let divergence = Divergence { from_step: config.first_averaged(), beyond_m: config.experiment.divergence_m };
    let mut tallies = vec![Tally::new(config.steps()); filters.len()];
    let mut singles = Vec::new();
    let one = |run| -> Vec<Track<STATES>> {
        let draw = Draw::new(config, &suite, seed, run);
        filters.iter().map(|(kind, settings)| setup.fly(*kind, settings, &draw, Watch::All)).collect()
    };
    runs::for_each(runs, one, |run, tracks| {
        tallies.iter_mut().zip(&tracks).for_each(|(tally, track)| tally.add(track, divergence));
        if run == 0 {
            singles = tracks.into_iter().map(|track| track.errors).collect();
        }
    });
    let outcomes = filters.iter().zip(&tallies).zip(singles);
    let mut outcomes: Vec<Outcome> = outcomes
        .map(|(((kind, settings), tally), single)| Outcome::new(config, (*kind, *settings), tally, single))
        .collect();
    let reference = outcomes.iter().find(|o| o.filter == Kind::Ekf).map_or([f64::NAN; STATES], |ekf| ekf.rmse);
    let draw = Draw::new(config, &suite, seed, 0);
    for outcome in &mut outcomes {
        outcome.ratio_to_ekf = geometric_ratio(&reference, &outcome.rmse);
        if outcome.failed > 0 {
            continue;
        }
        let once = || setup.fly(outcome.filter, &outcome.settings, &draw, Watch::Nothing);
        outcome.host_ns_per_step = fastest_ns(TIMED_FLIGHTS, config.steps(), once);
    }
    let mut limits = limits(case, config, &suite, (seed, runs));
    limits.iter_mut().for_each(|limit| limit.ratio_to_ekf = geometric_ratio(&reference, &limit.rmse));
    Flown { case: case.name, title: case.title, filters: outcomes, limits }
}

impl Outcome {
    /// Means over time; the ratio and the cost are not yet known.
    fn new(
        config: &Config,
        (filter, settings): (Kind, Settings),
        tally: &Tally<STATES>,
        single: Vec<[f64; STATES]>,
    ) -> Self {
        let from = config.first_averaged();
        let (history, position) = (tally.history(), tally.position_history_m());
        let pull_in = (PULL_IN_S / config.experiment.step_s) as usize;
        Self {
            filter,
            settings,
            rmse: means_from(&history, from),
            position_rmse_m: mean_from(&position, from),
            ratio_to_ekf: f64::NAN,
            pull_in_peak_m: position.iter().take(pull_in).skip(1).copied().fold(0.0, f64::max),
            nees: mean_from(&tally.nees_history(), from),
            indefinite_share: tally.indefinite_share(),
            diverged: tally.diverged,
            failed: tally.failed,
            host_ns_per_step: f64::NAN,
            m7_instructions_per_step: m7::instructions("sekf", filter.name()).filter(|_| config.has_recorded_cost()),
            history,
            single,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_case_that_is_not_tuned_takes_the_untuned_settings() {
        let config = Config::default();
        let found = Settings { process: 9.0, accelerometer: 2.0, input: 0.1 };
        let tuned = CASES.map(|case| Tuned { case: case.name.into(), filter: Kind::Sekf, settings: found });
        for case in CASES {
            for kind in [Kind::Sekf, Kind::SekfPrinted, Kind::SekfUnfactored] {
                let settings = case.settings(&config, &tuned, kind);
                assert_eq!(settings == found, case.is_tuned, "{}", case.name);
            }
            assert_eq!(case.settings(&config, &tuned, Kind::Ekf), config.filters.untuned);
        }
    }

    #[test]
    fn without_tuning_the_sekf_beats_the_ekf_the_more_the_lower_the_noise_and_only_the_printed_form_loses_definiteness()
    {
        let config = Config::default();
        let mut ratios = Vec::new();
        for case in CASES.iter().filter(|case| !case.is_tuned) {
            let flown = fly(case, (&config, &[]), (3, 6));
            for outcome in &flown.filters {
                let is_printed = outcome.filter == Kind::SekfPrinted;
                assert_eq!(
                    (outcome.indefinite_share > 0.0, outcome.failed),
                    (is_printed, if is_printed { 6 } else { 0 })
                );
                assert!(outcome.filter != Kind::Ekf || (outcome.ratio_to_ekf - 1.0).abs() < 1e-12);
            }
            ratios.extend(flown.filters.iter().find(|o| o.filter == Kind::Sekf).map(|o| o.ratio_to_ekf));
        }
        assert!(
            matches!(ratios[..], [base, tenth, hundredth] if base > 1.5 && tenth > 8.0 && hundredth > 20.0),
            "{ratios:?}"
        );
    }
}
