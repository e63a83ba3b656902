//! The search for the tuned settings, the same for each filter and each tuned case, on runs of another seed: the whole grid,
//! then a compass search from its best point. What counts is the geometric mean of the states' errors.

use rayon::prelude::*;

use super::STATES;
use super::cases::{CASES, Case};
use super::config::{Config, Settings};
use super::draw::{Draw, Suite};
use super::filters::Setup;
use super::kind::Kind;
use super::tuned::Tuned;
use crate::runs;
use crate::tally::{Divergence, Tally, geometric_ratio, means_from};
use crate::track::Watch;

/// The best settings of every filter in every tuned case.
#[must_use]
pub fn search(config: &Config, mut tell: impl FnMut(&Tuned)) -> Vec<Tuned> {
    let mut all = Vec::new();
    for case in CASES.iter().filter(|case| case.is_tuned) {
        for kind in Kind::ALL.into_iter().filter(|kind| kind.tuned_as() == *kind) {
            let tuned = Tuned { case: case.name.to_owned(), filter: kind, settings: best(config, case, kind) };
            tell(&tuned);
            all.push(tuned);
        }
    }
    all
}

fn best(config: &Config, case: &Case, kind: Kind) -> Settings {
    let suite = case.suite(config);
    let setup = case.setup(config, &suite);
    let few = draws(config, &suite, config.tuning.grid_runs);
    let on_grid = best_of(&setup, kind, &few, grid(config, kind)).map_or_else(Settings::default, |best| best.1);
    refine(&setup, kind, &draws(config, &suite, config.tuning.runs), on_grid)
}

/// The candidate with the least score, the first of equals, whatever the threads did; nothing without a candidate.
fn best_of(setup: &Setup<'_>, kind: Kind, draws: &[Draw], candidates: Vec<Settings>) -> Option<(f64, Settings)> {
    let scored: Vec<(f64, Settings)> =
        candidates.into_par_iter().map(|settings| (score(setup, kind, &settings, draws), settings)).collect();
    scored.into_iter().reduce(|best, next| if next.0 < best.0 { next } else { best })
}

/// Compass search: to the best neighbour as long as that is better, then with the next smaller factor.
fn refine(setup: &Setup<'_>, kind: Kind, draws: &[Draw], from: Settings) -> Settings {
    let mut best = (score(setup, kind, &from, draws), from);
    for factor in &setup.config.tuning.factors {
        for _ in 0..MAX_MOVES {
            match best_of(setup, kind, draws, neighbours(kind, &best.1, *factor)) {
                Some(next) if next.0 < best.0 => best = next,
                _ => break,
            }
        }
    }
    best.1
}

/// Moves of the compass search with one factor: far more than the grid leaves to do.
const MAX_MOVES: usize = 50;
/// Significant digits that a setting is kept with.
const DIGITS: i32 = 3;

/// One setting up or down by a factor, as far as its range goes; zero stays zero.
fn neighbours(kind: Kind, of: &Settings, factor: f64) -> Vec<Settings> {
    let mut all = Vec::new();
    for by in [factor, 1.0 / factor] {
        if of.process > 0.0 {
            all.push(Settings { process: rounded(of.process * by), ..*of });
        }
        all.push(Settings { accelerometer: rounded(of.accelerometer * by), ..*of });
        if kind.has_input_setting() {
            all.push(Settings { input: rounded(of.input * by), ..*of });
        }
    }
    all.retain(|settings| settings.check("").is_ok());
    all
}

fn rounded(value: f64) -> f64 {
    let scale = 10f64.powi(DIGITS - 1 - value.abs().log10().floor() as i32);
    (value * scale).round() / scale
}

/// Every combination.
fn grid(config: &Config, kind: Kind) -> Vec<Settings> {
    let tuning = &config.tuning;
    let inputs = if kind.has_input_setting() { tuning.input.as_slice() } else { &[0.0] };
    let mut all = Vec::new();
    for process in &tuning.process {
        for accelerometer in &tuning.accelerometer {
            for input in inputs {
                all.push(Settings { process: *process, accelerometer: *accelerometer, input: *input });
            }
        }
    }
    all
}

fn draws(config: &Config, suite: &Suite, runs: u64) -> Vec<Draw> {
    runs::collect(runs, |run| Draw::new(config, suite, config.tuning.seed, run))
}

/// Geometric mean of the errors; infinite when a run failed.
fn score(setup: &Setup<'_>, kind: Kind, settings: &Settings, draws: &[Draw]) -> f64 {
    let never = Divergence { from_step: 0, beyond_m: f64::INFINITY };
    let mut tally = Tally::<STATES>::new(setup.config.steps());
    for draw in draws {
        let track = setup.fly(kind, settings, draw, Watch::Errors);
        if track.failure.is_some() {
            return f64::INFINITY;
        }
        tally.add(&track, never);
    }
    let rmse = means_from(&tally.history(), setup.config.first_averaged());
    let score = geometric_ratio(&rmse, &[1.0; STATES]);
    if score.is_finite() { score } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small() -> Config {
        let mut config = Config::default();
        config.experiment.duration_s = 60.0;
        (config.tuning.grid_runs, config.tuning.runs) = (2, 2);
        (config.tuning.process, config.tuning.accelerometer, config.tuning.input) =
            (vec![0.0, 0.4], vec![1.0, 2.0], vec![0.1, 0.5, 1.0]);
        config
    }

    #[test]
    fn the_search_is_at_least_as_good_as_the_best_of_its_grid_and_its_neighbours() {
        let config = small();
        assert_eq!(Kind::ALL.map(|kind| grid(&config, kind).len()), [4, 4, 4, 4, 4, 12, 12, 12, 12]);
        let case = CASES.iter().find(|case| case.is_tuned).unwrap();
        let suite = case.suite(&config);
        let setup = case.setup(&config, &suite);
        let draws = draws(&config, &suite, config.tuning.runs);
        for kind in [Kind::Ekf, Kind::Aekf12] {
            let best = best(&config, case, kind);
            let found = score(&setup, kind, &best, &draws);
            for settings in grid(&config, kind).into_iter().chain(neighbours(kind, &best, 1.1)) {
                assert!(found <= score(&setup, kind, &settings, &draws), "{kind:?} {settings:?}");
            }
        }
    }

    #[test]
    fn the_shipped_settings_are_nowhere_far_from_the_best() {
        let config = Config::default();
        let file = crate::sekf::tuned::TunedFile::shipped().unwrap();
        for case in CASES.iter().filter(|case| case.is_tuned) {
            let suite = case.suite(&config);
            let setup = case.setup(&config, &suite);
            let draws = draws(&config, &suite, 6);
            for line in file.tuned.iter().filter(|line| line.case == case.name) {
                let own = score(&setup, line.filter, &line.settings, &draws);
                let (best, at) =
                    best_of(&setup, line.filter, &draws, neighbours(line.filter, &line.settings, 3.0)).unwrap();
                // Six runs tell three per cent from each other at best.
                assert!(own < 1.03 * best, "{} {:?}: {own}, but {best} at {at:?}", case.name, line.filter);
            }
        }
    }
}
