//! The table of a ranking.

use std::fmt::Write as _;

use fsw_core::link::parameters::NavigationMode;
use serde::Serialize;

use super::{Entry, RankArgs, Track};
use crate::campaign::observer::Flown;
use crate::campaign::statistics::quantile;
use crate::campaign::summary::ascending;

/// Error at a time of the flight, over all entries that were still flying.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Over {
    /// Time, s.
    pub time_s: f64,
    /// Root mean square of the position error, m, and of the velocity error, m/s.
    pub rmse: [f64; 2],
}

/// The physical limit on the recorded logs.
#[derive(Clone, Debug, Serialize)]
pub struct Limit {
    /// Least root mean square error of the position when the parachute opens, m, and of the velocity, m/s.
    pub deploy: [f64; 2],
    /// The same over the whole flight.
    pub flight: [f64; 2],
    /// The same over time.
    pub over_time: Vec<Over>,
}

/// What a filter did.
#[derive(Clone, Debug, Serialize)]
pub struct Placed {
    /// Its name.
    pub filter: &'static str,
    /// What it is.
    pub title: &'static str,
    /// Root mean square error when the parachute opens: position, m; velocity, m/s.
    pub deploy: [f64; 2],
    /// The same over the bound.
    pub over_bound: [f64; 2],
    /// Over the whole flight.
    pub flight: [f64; 2],
    /// Over time.
    pub over_time: Vec<Over>,
    /// Mean normalised error squared; 6 is right.
    pub nees: Option<f64>,
    /// Share of it inside the central 95 %, percent.
    pub nees_inside_pct: Option<f64>,
    /// Share of epochs with an indefinite covariance, percent.
    pub indefinite_pct: f64,
    /// Flights in which the filter was given up for dead reckoning.
    pub given_up: usize,
    /// Estimates that were no number.
    pub not_finite: usize,
    /// Miss in closed loop, m: median, 90 %, largest.
    pub miss_m: Option<[f64; 3]>,
    /// Flights in closed loop in which the parachute opened.
    pub opened: Option<usize>,
    /// Those inside the box.
    pub success: Option<usize>,
    /// Entries.
    pub flights: usize,
}

/// A case.
#[derive(Clone, Debug, Serialize)]
pub struct Ranking {
    /// Its name.
    pub case: String,
    /// The limit.
    pub bound: Limit,
    /// The filters, best position first.
    pub filters: Vec<Placed>,
}

/// Filters that are there to be seen failing.
const TEACHING: [NavigationMode; 2] = [NavigationMode::MmaeBare, NavigationMode::MmaeProduct];

fn mean_root(of: impl Iterator<Item = [f64; 2]>) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for [position, velocity] in of {
        sum = [sum[0] + position, sum[1] + velocity];
        count += 1.0;
    }
    sum.map(|s| (s / count).sqrt())
}

/// Epochs between two points of a curve: two seconds.
const THINNING: usize = 20;
/// Seconds between two epochs.
const EPOCH_S: f64 = 0.1;

fn over_time<'a>(errors: impl Iterator<Item = &'a Vec<[f64; 2]>>) -> Vec<Over> {
    let all: Vec<_> = errors.collect();
    let longest = all.iter().map(|errors| errors.len()).max().unwrap_or(0);
    let at = |k: usize| {
        let rmse = mean_root(all.iter().filter_map(|errors| errors.get(k).copied()));
        Over { time_s: (k + 1) as f64 * EPOCH_S, rmse }
    };
    (0..longest).step_by(THINNING).map(at).collect()
}

impl Ranking {
    /// Of all entries.
    pub(super) fn of(case: String, filters: &[NavigationMode], entries: &[Entry]) -> Self {
        let bound = Limit {
            deploy: mean_root(entries.iter().filter_map(|entry| entry.bound.last().copied())),
            flight: mean_root(entries.iter().flat_map(|entry| entry.bound.iter().copied())),
            over_time: over_time(entries.iter().map(|entry| &entry.bound)),
        };
        let mut placed: Vec<Placed> = filters
            .iter()
            .enumerate()
            .map(|(i, mode)| {
                let flown: Vec<&(Track, Option<Flown>)> = entries.iter().filter_map(|e| e.flown.get(i)).collect();
                place(*mode, &bound, &flown)
            })
            .collect();
        placed.sort_by(|a, b| a.deploy[0].total_cmp(&b.deploy[0]));
        Self { case, bound, filters: placed }
    }

    /// Whether every filter that is no teaching baseline stayed with numbers and sound covariances, and ended its flights.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let teaching = TEACHING.map(NavigationMode::name);
        self.filters.iter().filter(|placed| !teaching.contains(&placed.filter)).all(|placed| {
            let completes = placed.opened.is_none_or(|opened| opened * 100 >= placed.flights * 99);
            placed.not_finite == 0 && placed.indefinite_pct == 0.0 && completes
        })
    }
}

fn place(mode: NavigationMode, bound: &Limit, flown: &[&(Track, Option<Flown>)]) -> Placed {
    let tracks = || flown.iter().map(|(track, _)| track);
    let deploy = mean_root(tracks().filter_map(|track| track.errors.last().copied()));
    let nees: Vec<f64> = tracks().flat_map(|track| track.nees.iter().copied()).collect();
    let epochs: usize = tracks().map(|track| track.errors.len()).sum();
    let inside: usize = tracks().map(|track| track.inside).sum();
    let some = |value: f64| (!nees.is_empty()).then_some(value);
    let closed: Vec<&Flown> = flown.iter().filter_map(|(_, flown)| flown.as_ref()).collect();
    let misses = ascending(&closed.iter().filter_map(|flown| flown.miss_m).collect::<Vec<_>>());
    let at = |share: f64| quantile(&misses, share).unwrap_or(f64::NAN);
    let count = |of: fn(&Flown) -> bool| (!closed.is_empty()).then(|| closed.iter().filter(|f| of(f)).count());
    Placed {
        filter: mode.name(),
        title: mode.title(),
        deploy,
        over_bound: [deploy[0] / bound.deploy[0], deploy[1] / bound.deploy[1]],
        flight: mean_root(tracks().flat_map(|track| track.errors.iter().copied())),
        over_time: over_time(tracks().map(|track| &track.errors)),
        nees: some(nees.iter().sum::<f64>() / nees.len() as f64),
        nees_inside_pct: some(100.0 * inside as f64 / nees.len() as f64),
        indefinite_pct: 100.0 * tracks().map(|track| track.indefinite).sum::<usize>() as f64 / epochs.max(1) as f64,
        given_up: tracks().filter(|track| track.given_up.is_some()).count(),
        not_finite: tracks().map(|track| track.not_finite).sum(),
        miss_m: (!misses.is_empty()).then(|| [at(0.5), at(0.9), misses.last().copied().unwrap_or(f64::NAN)]),
        opened: count(|flown| flown.deploy.is_some()),
        success: count(|flown| flown.reason.is_none()),
        flights: flown.len(),
    }
}

/// For the screen.
pub(super) fn text(args: &RankArgs, rankings: &[Ranking]) -> String {
    let mut out = String::new();
    for ranking in rankings {
        let _ = writeln!(
            out,
            "\n{}, case {}: {} entries of seed {}, every filter on the same link logs",
            args.scenario, ranking.case, args.runs, args.seed
        );
        let _ = writeln!(
            out,
            "  {:<16} {:>9} {:>8} {:>7} {:>7} {:>9} {:>8} {:>8} {:>7} {:>8} {:>8} {:>8} {:>7}",
            "filter",
            "deploy m",
            "m/s",
            "/bound",
            "/bound",
            "flight m",
            "m/s",
            "NEES",
            "in 95%",
            "given up",
            "miss p50",
            "p90 m",
            "opened"
        );
        let [r, v] = ranking.bound.deploy;
        let [fr, fv] = ranking.bound.flight;
        let _ = writeln!(
            out,
            "  {:<16} {r:>9.1} {v:>8.3} {:>7} {:>7} {fr:>9.1} {fv:>8.3}",
            "Cramér–Rao bound", "1.00", "1.00"
        );
        for p in &ranking.filters {
            let number =
                |value: Option<f64>, digits: usize| value.map_or("–".to_owned(), |v| format!("{v:.digits$}"));
            let _ = writeln!(
                out,
                "  {:<16} {:>9.1} {:>8.3} {:>7.2} {:>7.2} {:>9.1} {:>8.3} {:>8} {:>7} {:>8} {:>8} {:>8} {:>7}",
                p.filter,
                p.deploy[0],
                p.deploy[1],
                p.over_bound[0],
                p.over_bound[1],
                p.flight[0],
                p.flight[1],
                number(p.nees, 2),
                number(p.nees_inside_pct, 1),
                p.given_up,
                number(p.miss_m.map(|m| m[0]), 0),
                number(p.miss_m.map(|m| m[1]), 0),
                p.opened.map_or("–".to_owned(), |n| format!("{n}/{}", p.flights)),
            );
        }
    }
    out
}
