//! The table of a ranking.

use std::fmt::Write as _;

use fsw_core::link::parameters::NavigationMode;
use serde::Serialize;

use super::cost::{OnTarget, on_target};
use super::entry::{Closed, Curve, EPOCH_S, Entry, Judged, THINNING};
use super::{CaseName, RankArgs};
use crate::campaign::statistics::quantile;
use crate::campaign::summary::ascending;
use crate::columns::aligned;

/// Error at a time of the flight, over all entries that were still flying: half of all or more.
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
    /// Times that the flight software found the full covariance, 27 states of the strapdown solution, not finite, and
    /// restarted it.
    pub restarted: u64,
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
    /// What it costs on the reference computer.
    pub on_target: Option<OnTarget>,
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

/// What the default filter may exceed the bound by when the parachute opens.
const MOST_OVER_BOUND: f64 = 1.1;
/// Filters that are there to be seen failing.
const TEACHING: [NavigationMode; 2] = [NavigationMode::MmaeBare, NavigationMode::MmaeProduct];

/// Root of a mean square.
fn root(sum: [f64; 2], count: f64) -> [f64; 2] {
    sum.map(|s| (s / count).sqrt())
}

fn total(of: impl Iterator<Item = [f64; 2]>) -> ([f64; 2], f64) {
    of.fold(([0.0; 2], 0.0), |(sum, count), one| ([sum[0] + one[0], sum[1] + one[1]], count + 1.0))
}

/// When the parachute opens.
fn at_deploy(curves: &[&Curve]) -> [f64; 2] {
    let (sum, count) = total(curves.iter().map(|curve| curve.last));
    root(sum, count)
}

fn over_flight(curves: &[&Curve]) -> [f64; 2] {
    let (sum, _) = total(curves.iter().map(|curve| curve.sum));
    root(sum, curves.iter().map(|curve| f64::from(curve.epochs)).sum())
}

/// Over all entries that were still flying, while they are half of all: the last few would be a mean over other flights.
fn over_time(curves: &[&Curve]) -> Vec<Over> {
    let mut lengths: Vec<usize> = curves.iter().map(|curve| curve.thinned.len()).collect();
    lengths.sort_unstable();
    let median = lengths.get(lengths.len() / 2).copied().unwrap_or(0);
    let at = |k: usize| {
        let (sum, count) = total(curves.iter().filter_map(|curve| curve.thinned.get(k)).map(|s| s.map(f64::from)));
        Over { time_s: (k * THINNING + 1) as f64 * EPOCH_S, rmse: root(sum, count) }
    };
    (0..median).map(at).collect()
}

impl Ranking {
    /// Of all entries.
    pub(super) fn of(case: String, filters: &[NavigationMode], entries: &[Entry]) -> Self {
        let least: Vec<&Curve> = entries.iter().map(|entry| &entry.bound).collect();
        let bound = Limit { deploy: at_deploy(&least), flight: over_flight(&least), over_time: over_time(&least) };
        let mut placed: Vec<Placed> = filters
            .iter()
            .enumerate()
            .map(|(i, mode)| {
                let judged: Vec<&Judged> = entries.iter().filter_map(|entry| entry.flown.get(i)).collect();
                place(*mode, &bound, &judged)
            })
            .collect();
        placed.sort_by(|a, b| a.deploy[0].total_cmp(&b.deploy[0]));
        Self { case, bound, filters: placed }
    }

    /// Numbers that are none and covariances that are not positive definite, in a sentence.
    pub(super) fn failures(&self) -> String {
        let failed = self.filters.iter().filter(|p| p.not_finite > 0 || p.indefinite_pct > 0.0 || p.restarted > 0);
        let told: Vec<String> = failed
            .map(|p| {
                let Placed { filter, not_finite, indefinite_pct, restarted, .. } = p;
                format!("{filter}: {not_finite} estimates, {indefinite_pct:.2} % of the epochs, {restarted} times")
            })
            .collect();
        if told.is_empty() {
            "No filter gave an estimate that is no number, or a covariance that is not positive definite, or had one restarted.".to_owned()
        } else {
            format!(
                "Estimates that are no number, epochs with an indefinite covariance, times one was restarted: {}.",
                told.join("; ")
            )
        }
    }

    /// How the default filter stands to the bound, in a sentence; none when it was not flown. The errors of so many entries are
    /// known to a part of 1/√2N.
    pub(super) fn standing(&self) -> Option<String> {
        let default = self.filters.iter().find(|placed| placed.filter == NavigationMode::default().name())?;
        let [position, velocity] = default.over_bound;
        // It is asked for where the flight software was told the truth of its sensors and its air.
        let asked = match (self.case == CaseName::Plain.name(), position.max(velocity) <= MOST_OVER_BOUND) {
            (false, _) => String::new(),
            (true, is_met) => {
                format!(" (asked for: at most {MOST_OVER_BOUND}, {})", if is_met { "met" } else { "missed" })
            }
        };
        Some(format!(
            "The default, {}, stands at {position:.2} of the bound in position and {velocity:.2} in velocity when the parachute opens\
             {asked}; {} entries know that to {:.0} % (1 σ).",
            default.filter,
            default.flights,
            100.0 / (2.0 * default.flights as f64).sqrt()
        ))
    }

    /// Whether every filter that is no teaching baseline stayed with numbers and sound covariances, and ended its flights.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let teaching = TEACHING.map(NavigationMode::name);
        self.filters.iter().filter(|placed| !teaching.contains(&placed.filter)).all(|placed| {
            let completes = placed.opened.is_none_or(|opened| opened * 100 >= placed.flights * 99);
            placed.not_finite == 0 && placed.indefinite_pct == 0.0 && placed.restarted == 0 && completes
        })
    }
}

fn place(mode: NavigationMode, bound: &Limit, judged: &[&Judged]) -> Placed {
    let curves: Vec<&Curve> = judged.iter().map(|filter| &filter.errors).collect();
    let deploy = at_deploy(&curves);
    let sum = |of: fn(&Judged) -> u32| judged.iter().map(|filter| u64::from(of(filter))).sum::<u64>();
    let (epochs, with_nees) = (sum(|filter| filter.errors.epochs), sum(|filter| filter.judged));
    let share = |value: f64| (with_nees > 0).then(|| value / with_nees as f64);
    let closed: Vec<Closed> = judged.iter().filter_map(|filter| filter.closed).collect();
    let misses = ascending(&closed.iter().filter_map(|flown| flown.miss_m).collect::<Vec<_>>());
    let at = |share: f64| quantile(&misses, share).unwrap_or(f64::NAN);
    let count = |of: fn(&Closed) -> bool| (!closed.is_empty()).then(|| closed.iter().filter(|f| of(f)).count());
    Placed {
        filter: mode.name(),
        title: mode.title(),
        deploy,
        over_bound: [deploy[0] / bound.deploy[0], deploy[1] / bound.deploy[1]],
        flight: over_flight(&curves),
        over_time: over_time(&curves),
        nees: share(judged.iter().map(|filter| filter.nees).sum()),
        nees_inside_pct: share(100.0 * sum(|filter| filter.inside) as f64),
        indefinite_pct: 100.0 * sum(|filter| filter.indefinite) as f64 / epochs.max(1) as f64,
        restarted: sum(|filter| filter.restarted),
        given_up: judged.iter().filter(|filter| filter.given_up_s.is_some()).count(),
        not_finite: sum(|filter| filter.not_finite) as usize,
        miss_m: (!misses.is_empty()).then(|| [at(0.5), at(0.9), misses.last().copied().unwrap_or(f64::NAN)]),
        opened: count(|flown| flown.opened),
        success: count(|flown| flown.success),
        flights: judged.len(),
        on_target: on_target(mode),
    }
}

/// Columns on the screen.
const HEADS: [&str; 15] = [
    "filter",
    "deploy m",
    "deploy m/s",
    "over bound",
    "m/s over bound",
    "flight m",
    "flight m/s",
    "NEES",
    "in 95 %",
    "given up",
    "miss m, 50 %",
    "90 %",
    "opened",
    "M7 k/s",
    "k/frame",
];

impl Ranking {
    /// The bound and the filters, for the screen.
    fn rows(&self) -> Vec<[String; HEADS.len()]> {
        let none = || "–".to_owned();
        let number = |value: Option<f64>, digits: usize| value.map_or_else(none, |v| format!("{v:.digits$}"));
        let errors = |name: &str, [deploy, over, flight]: [[f64; 2]; 3], rest: [String; 8]| {
            let figures = [deploy[0], deploy[1], over[0], over[1], flight[0], flight[1]];
            let figures =
                figures.into_iter().zip([1, 3, 2, 2, 1, 3]).map(|(value, digits)| format!("{value:.digits$}"));
            let mut cells = [name.to_owned()].into_iter().chain(figures).chain(rest);
            std::array::from_fn(|_| cells.next().unwrap_or_default())
        };
        let least = self.bound.deploy;
        let bound = errors("Cramér–Rao bound", [least, [1.0; 2], self.bound.flight], std::array::from_fn(|_| none()));
        let filter = |p: &Placed| {
            let rest = [
                number(p.nees, 2),
                number(p.nees_inside_pct, 1),
                p.given_up.to_string(),
                number(p.miss_m.map(|m| m[0]), 0),
                number(p.miss_m.map(|m| m[1]), 0),
                p.opened.map_or_else(none, |n| format!("{n}/{}", p.flights)),
                number(p.on_target.map(|cost| f64::from(cost.navigation_per_second) * 1e-3), 0),
                number(p.on_target.map(|cost| f64::from(cost.worst_frame) * 1e-3), 1),
            ];
            errors(p.filter, [p.deploy, p.over_bound, p.flight], rest)
        };
        [bound].into_iter().chain(self.filters.iter().map(filter)).collect()
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
        out += &aligned(&HEADS.map(str::to_owned), &ranking.rows(), &[]);
        ranking.standing().iter().for_each(|told| out += &format!("  {told}\n"));
        let _ = writeln!(out, "  {}", ranking.failures());
    }
    out.push_str(
        "\n  M7: thousands of instructions, not cycles: navigation over a second, and the worst minor frame with all in it\n",
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_over_time_ends_when_half_of_the_entries_have() {
        let flight = |error: f64, points: usize| Curve::of(&vec![[error * error; 2]; 1 + (points - 1) * THINNING]);
        let curves = [flight(1.0, 3), flight(1.0, 4), flight(7.0, 4), flight(3.0, 9)];
        let over = over_time(&curves.iter().collect::<Vec<_>>());
        assert_eq!(over.len(), 4);
        assert!((over[0].rmse[0] - 15.0_f64.sqrt()).abs() < 1e-6);
        assert!((over[3].rmse[0] - (59.0_f64 / 3.0).sqrt()).abs() < 1e-6);
        assert!(over_time(&[]).is_empty());
        assert_eq!(over_time(&[&flight(2.0, 5)]).len(), 5);
    }
}
