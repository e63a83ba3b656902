//! `study mmae`: P3's experiment. A bank of EKFs, each with a density of its own, under the paper's gating and its rivals,
//! against filters that estimate the density and against the bound that none can pass.

mod figures;
mod page;
mod table;

use std::fmt::Write as _;
use std::path::Path;

use clap::Args;
use console::style;
use fsw_study::mmae::bars::{Bar, bars};
use fsw_study::mmae::config::Config;
use fsw_study::mmae::{Study as Flown, cases};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::papers::{self, Head, PaperArgs};
use crate::columns::aligned;
use crate::error::HostError;

/// Runs when nothing is said: the paper's.
const DEFAULT_RUNS: u64 = 1_000;
/// Where the paper is.
const PAPER: &str =
    "P3: Deng, Gao, Cui, J. Deep Space Exploration 4 (6), 535-543, 2017, doi 10.15982/j.issn.2095-7777.2017.06.006";

/// Options of the study.
#[derive(Clone, Debug, Args)]
pub struct MmaeArgs {
    /// Options of every study of filters.
    #[command(flatten)]
    pub paper: PaperArgs,
}

/// Content of `study.json`.
#[derive(Serialize)]
struct Study<'a> {
    #[serde(flatten)]
    head: Head,
    config: &'a Config,
    bars: &'a [Bar],
    cases: &'a Flown,
}

/// Runs the command; true when no covariance became indefinite.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &MmaeArgs) -> Result<bool, HostError> {
    let (config, runs): (Config, u64) = args.paper.begin(DEFAULT_RUNS)?;
    let folder = args.paper.open("mmae", runs, &config)?;
    let bar = progress(args, &config, runs);
    let flown = args.paper.on_threads(|| {
        Flown::fly(&config, args.paper.seed, runs, |case, _| {
            bar.set_message(format!("{}, scenario {}", case.name, case.scenario.number()));
            bar.inc(1);
        })
    })?;
    bar.finish_and_clear();
    let bars = bars(&flown);
    let study = Study { head: args.paper.head("mmae", PAPER, runs), config: &config, bars: &bars, cases: &flown };
    args.paper.leave(&folder, &study, page::html(&study), || screen(&study, &folder))?;
    Ok(flown.all().flat_map(|case| &case.filters).all(|filter| filter.indefinite_share == 0.0))
}

/// A bar over all entries of all cases.
fn progress(args: &MmaeArgs, config: &Config, runs: u64) -> ProgressBar {
    let all = cases(config, runs).iter().map(|case| case.runs).sum();
    let bar = if args.paper.quiet || args.paper.json { ProgressBar::hidden() } else { ProgressBar::new(all) };
    let style = ProgressStyle::with_template("  {bar:28.cyan/blue} {pos}/{len}  {msg}");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn screen(study: &Study<'_>, folder: &Path) -> String {
    let mut out = String::new();
    let head = format!("P3 (Deng et al. 2017): {} runs of seed {} a case", study.head.runs, study.head.seed);
    let _ = writeln!(out, "\n  {}\n", style(head).bold());
    for case in study.cases.all() {
        let _ = writeln!(out, "  {}", style(table::title(case)).bold());
        if let Some((head, rows)) = table::rows(case).split_first() {
            out += &aligned(head, rows, &[]);
        }
        let _ = writeln!(out);
    }
    let _ = writeln!(out, "  {}", style("What is asked of the figures").bold());
    for bar in study.bars {
        let mark = match bar.value {
            None => style("none  ").dim(),
            Some(_) if bar.is_met => style("met   ").green(),
            Some(_) => style("missed").red(),
        };
        let _ = writeln!(out, "  {mark} {:<75} {:>9}   {}", bar.what, table::bar_value(bar), table::bar_limits(bar));
    }
    let uncertainty = table::uncertainty_pct(study.head.runs);
    let _ = writeln!(
        out,
        "  one root mean square over {} runs is uncertain by up to {uncertainty} % (1 σ)",
        study.head.runs
    );
    let _ = writeln!(out, "  {}", table::ATTAINED);
    let _ = writeln!(out, "\n  RMSE at the parachute's opening; NEES of six states: 6 is right. An EKF's cost is 1.");
    let _ = writeln!(out, "  {}", table::M7);
    let _ = writeln!(out, "  page  {}", style(folder.join(papers::PAGE).display()).cyan().bold());
    out
}
