//! `study ddf`: P2's experiment. An entry through denser air and with more lift than the filters believe, estimated by
//! divided-difference filters, plain, desensitized and of adaptive order, and by EKFs.
//!
//! The engine is [`fsw_study::ddf`]; here are its arguments, files, figures and page, and the counting of instructions.

mod cost;
mod figures;
mod page;
mod table;

use std::fmt::Write as _;
use std::path::Path;

use clap::Args;
use console::style;
use fsw_study::ddf::reference::{Bar, bars};
use fsw_study::ddf::{Config, Filter, Kind, Limit, Outcome, Tuned, fly_all, fly_steps, limits, search};
use serde::Serialize;

use super::papers::{self, Head, PaperArgs};
use crate::columns::aligned;
use crate::error::HostError;
use crate::output::print;

/// Runs when nothing is said: those of the reference figures.
const DEFAULT_RUNS: u64 = 200;
/// The paper.
const PAPER: &str = "P2: Deng, Yu, adaptive desensitized divided-difference filtering for Mars entry navigation, 2018";

/// Options of the study.
#[derive(Clone, Debug, Args)]
pub struct DdfArgs {
    /// Options of every study of filters.
    #[command(flatten)]
    pub paper: PaperArgs,
    /// Searches the noises of the tuned EKFs over the grid of the configuration and prints it instead of flying the filters.
    #[arg(long)]
    pub tune: bool,
    /// Does not count instructions of this machine (which takes a minute and Valgrind).
    #[arg(long)]
    pub no_count: bool,
    /// Flies this filter (its place in the list) and does nothing else: what is run under Valgrind.
    #[arg(long, hide = true, value_name = "I", requires = "steps")]
    pub only: Option<usize>,
    /// For so many steps.
    #[arg(long, hide = true, value_name = "N", requires = "only")]
    pub steps: Option<usize>,
}

/// A filter with its cost.
#[derive(Serialize)]
struct Flown {
    #[serde(flatten)]
    outcome: Outcome,
    /// Instructions of this machine in a step, the mean over a run.
    instructions_per_step: Option<f64>,
}

/// Content of `study.json`.
#[derive(Serialize)]
struct Study<'a> {
    #[serde(flatten)]
    head: Head,
    config: &'a Config,
    bars: &'a [Bar],
    /// Least errors, whatever the filter.
    limits: &'a [Limit],
    filters: &'a [Flown],
}

/// Runs the command; true when no covariance became indefinite and no filter failed.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &DdfArgs) -> Result<bool, HostError> {
    let (config, runs): (Config, u64) = args.paper.begin(DEFAULT_RUNS)?;
    if let (Some(at), Some(steps)) = (args.only, args.steps) {
        let filter = Filter::of(&config).get(at).copied();
        let filter = filter.ok_or_else(|| HostError::Option(format!("--only {at} is out of range")))?;
        fly_steps(&config, filter, steps.min(config.steps()));
        return Ok(true);
    }
    if args.tune {
        return tune(args, &config);
    }
    let folder = args.paper.open("ddf", runs, &config)?;
    let outcomes = args.paper.on_threads(|| {
        fly_all(&config, args.paper.seed, runs, |outcome| {
            if !args.paper.quiet && !args.paper.json {
                eprintln!("  {}", outcome.name);
            }
        })
    })?;
    let limits = args.paper.on_threads(|| limits(&config, args.paper.seed, runs))?;
    let counted = if args.no_count {
        vec![None; outcomes.len()]
    } else {
        args.paper.on_threads(|| cost::count(&folder.join(papers::CONFIG), outcomes.len(), config.steps()))?
    };
    let bars = bars(&outcomes);
    let flown: Vec<Flown> = outcomes
        .into_iter()
        .zip(counted)
        .map(|(outcome, instructions_per_step)| Flown { outcome, instructions_per_step })
        .collect();
    let study = Study {
        head: args.paper.head("ddf", PAPER, runs),
        config: &config,
        bars: &bars,
        limits: &limits,
        filters: &flown,
    };
    args.paper.leave(&folder, &study, page::html(&study), || screen(&study, &folder))?;
    Ok(flown.iter().all(|filter| filter.outcome.indefinite_share == 0.0 && filter.outcome.failed == 0))
}

/// Searches and prints the grid, the best first.
fn tune(args: &DdfArgs, config: &Config) -> Result<bool, HostError> {
    let mut out = String::new();
    for kind in [Kind::EkfTuned, Kind::EkfForces] {
        let found = args.paper.on_threads(|| search(config, kind))?;
        let _ = writeln!(out, "\n  {}, the best first", style(kind.name()).bold());
        for Tuned { process, sensors, rmse: [radius, speed, ..], position_rmse_m } in &found {
            let _ = writeln!(
                out,
                "  process {process:<6} sensors {sensors:<4}  radius {radius:6.0} m  speed {speed:6.2} m/s  position {position_rmse_m:6.0} m"
            );
        }
    }
    print(&out)?;
    Ok(true)
}

fn screen(study: &Study<'_>, folder: &Path) -> String {
    let mut out = String::new();
    let head = format!("P2 (Deng, Yu 2018): {} runs of seed {}", study.head.runs, study.head.seed);
    let _ = writeln!(out, "\n  {}\n", style(head).bold());
    let rows: Vec<_> = study.limits.iter().map(table::limit_row).chain(table::rows(study.filters)).collect();
    out += &aligned(&table::HEADS.map(str::to_owned), &rows, &[]);
    let _ = writeln!(out);
    for bar in study.bars {
        let _ = writeln!(out, "  {}", table::said(bar));
    }
    let _ = writeln!(out);
    for note in table::NOTES {
        let _ = writeln!(out, "  {note}");
    }
    let _ = writeln!(out, "  page  {}", style(folder.join(papers::PAGE).display()).cyan().bold());
    out
}
