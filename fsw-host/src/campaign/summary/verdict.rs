//! What the flight software said of its target, and how the runs did of which it did not say that it is out of reach.

use std::io;

use serde::{Deserialize, Serialize};

use super::distribution::{Distribution, Spread, Within};
use crate::campaign::runs::Runs;

/// Verdicts of the flight software on its target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unreachable {
    /// Runs in which it said at some time that the target is out of reach.
    pub ever: u64,
    /// Runs in which that was its last word.
    pub at_end: u64,
    /// Miss of those runs, m.
    pub miss_m: Option<Spread>,
    /// Shares within a distance of the runs in which it was not its last word.
    pub others_within_pct: Within,
    /// Miss of these, m.
    pub others_miss_m: Option<Distribution>,
    /// Largest miss of these with the number of the run.
    pub others_worst: Option<(u64, f64)>,
}

impl Unreachable {
    /// Of a table, its run numbers and misses.
    pub(super) fn of(runs: &Runs, numbers: &[f64], misses: &[f64]) -> io::Result<Self> {
        let called = runs.flags("unreachable_at_end")?;
        let all = || numbers.iter().copied().zip(misses.iter().copied()).zip(called.iter().copied());
        let (named, others): (Vec<_>, Vec<_>) = all().partition(|(_, called)| *called);
        let missed = |runs: &[((f64, f64), bool)]| runs.iter().map(|((_, miss), _)| *miss).collect::<Vec<f64>>();
        let finite = others.iter().map(|(run, _)| *run).filter(|(_, miss)| miss.is_finite());
        let worst = finite.max_by(|a, b| a.1.total_cmp(&b.1));
        let (named, others) = (missed(&named), missed(&others));
        Ok(Self {
            ever: runs.numbers("unreachable_events")?.iter().filter(|n| **n > 0.0).count() as u64,
            at_end: named.len() as u64,
            miss_m: Spread::of(&named),
            others_within_pct: Within::of(&others),
            others_miss_m: Distribution::of(&others),
            others_worst: worst.map(|(run, miss)| (run as u64, miss)),
        })
    }
}
