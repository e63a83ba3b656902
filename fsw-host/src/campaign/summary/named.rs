//! Runs that deserve a look, each with the command that flies it again.

use std::io;

use serde::{Deserialize, Serialize};

use crate::campaign::identity::Identity;
use crate::campaign::runs::Runs;

/// A run that deserves a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Number of the run.
    pub run: u64,
    /// Miss, m.
    pub miss_m: Option<f64>,
    /// Why it is no success.
    pub reason: Option<String>,
    /// The flight software's last word was that the target is out of reach.
    pub unreachable: bool,
    /// The command that flies it again.
    pub command: String,
}

/// Runs named in a list.
const NAMED: usize = 10;

/// The completed runs that missed by most.
pub(super) fn worst(runs: &Runs, identity: &Identity, numbers: &[f64], misses: &[f64]) -> io::Result<Vec<Worst>> {
    let mut order: Vec<usize> = (0..misses.len()).filter(|k| misses[*k].is_finite()).collect();
    order.sort_by(|a, b| misses[*b].total_cmp(&misses[*a]).then(a.cmp(b)));
    order.truncate(NAMED);
    named(runs, identity, numbers, &order)
}

/// The first runs that are no success.
pub(super) fn failed(runs: &Runs, identity: &Identity, numbers: &[f64], success: &[bool]) -> io::Result<Vec<Worst>> {
    let order: Vec<usize> = (0..success.len()).filter(|k| !success[*k]).take(NAMED).collect();
    named(runs, identity, numbers, &order)
}

fn named(runs: &Runs, identity: &Identity, numbers: &[f64], order: &[usize]) -> io::Result<Vec<Worst>> {
    let (misses, reasons) = (runs.numbers("miss_m")?, runs.words("reason")?);
    let unreachable = runs.flags("unreachable_at_end")?;
    let of = |k: &usize| {
        let run = numbers.get(*k).map_or(0, |run| *run as u64);
        Worst {
            run,
            miss_m: misses.get(*k).copied().filter(|m| m.is_finite()),
            reason: reasons.get(*k).cloned().flatten(),
            unreachable: unreachable.get(*k).copied().unwrap_or(false),
            command: identity.refly(run),
        }
    };
    Ok(order.iter().map(of).collect())
}
