//! The bar of a campaign, and the word about a run that failed while the others go on.

use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

use super::columns::RunResult;
use super::identity::Identity;

/// Failed runs that are told one by one.
const TOLD: u64 = 10;

/// A bar over runs with their rate and the time left.
#[must_use]
pub fn bar_over(runs: u64, visible: bool) -> ProgressBar {
    let template = "  {prefix}{bar:28.cyan/blue} {pos}/{len} runs  {per_sec}  {eta} left  {msg}";
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = if visible { ProgressBar::new(runs) } else { ProgressBar::hidden() };
    bar.set_style(style);
    bar
}

/// Follows a campaign on standard error.
pub struct Progress {
    bar: ProgressBar,
    speaks: bool,
    failed: AtomicU64,
}

impl Progress {
    /// A bar over the runs still to be flown; `name` stands before it, `bar` shows it, `speaks` tells of failed runs.
    #[must_use]
    pub fn new(name: &str, runs: u64, bar: bool, speaks: bool) -> Self {
        let bar = bar_over(runs, bar);
        if !name.is_empty() {
            bar.set_prefix(format!("{name:<16}"));
        }
        Self { bar, speaks, failed: AtomicU64::new(0) }
    }

    /// Hears of a run.
    pub fn flown(&self, result: &RunResult, identity: &Identity) {
        self.bar.inc(1);
        let Some(reason) = &result.flown.reason else { return };
        let failed = self.failed.fetch_add(1, Ordering::Relaxed) + 1;
        self.bar.set_message(format!("{failed} failed"));
        if !self.speaks || failed > TOLD {
            return;
        }
        let more = if failed == TOLD { "; further ones are counted in the summary" } else { "" };
        let command = identity.refly(result.run);
        self.bar.suspend(|| eprintln!("  run {} failed: {reason}\n    {command}{more}", result.run));
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
