//! `study sekf`: P1's experiment. A vehicle with an unknown input in its equations, estimated by an EKF that ignores it, by
//! P1's self-calibrating filter, and by what else the kernel can be: untuned as P1 flies them, and each tuned by a search.
//!
//! The engine is [`fsw_study::sekf`]; here are its arguments, files, figures and page.

mod figures;
mod page;
mod table;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use console::style;
use fsw_study::sekf::cases::{self, CASES, Flown};
use fsw_study::sekf::config::Config;
use fsw_study::sekf::tuned::TunedFile;
use fsw_study::sekf::{reference, tune};
use serde::Serialize;

use super::papers::{self, Head, PaperArgs};
use crate::columns::aligned;
use crate::error::HostError;
use crate::output::print;

/// Runs when nothing is said: the paper's.
const DEFAULT_RUNS: u64 = 500;
/// The paper.
const PAPER: &str =
    "P1: Fu, Lou, Xiao, J. Deep Space Exploration 2 (3), 224-228, 2015, doi 10.15982/j.issn.2095-7777.2015.03.006";

/// Options of the study.
#[derive(Clone, Debug, Args)]
pub struct SekfArgs {
    /// Options of every study of filters.
    #[command(flatten)]
    pub paper: PaperArgs,
    /// Searches the settings of the tuned cases (minutes) and writes tuned.toml into the folder instead of flying the cases.
    #[arg(long)]
    pub tune: bool,
    /// Tuned settings to fly with, as `--tune` writes them; without it those that come with the program.
    #[arg(long, value_name = "F", conflicts_with = "tune")]
    pub tuned: Option<PathBuf>,
}

/// Content of `study.json`.
#[derive(Serialize)]
struct Study<'a> {
    #[serde(flatten)]
    head: Head,
    paper_says: &'static str,
    config: &'a Config,
    tuned_by: &'a str,
    tuned_for_step_s: f64,
    cases: &'a [Flown],
}

/// Runs the command; true when no covariance of a shipped filter became indefinite.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &SekfArgs) -> Result<bool, HostError> {
    let (config, runs): (Config, u64) = args.paper.begin(DEFAULT_RUNS)?;
    let tuned = match &args.tuned {
        Some(path) => papers::read(path)?,
        None => TunedFile::shipped().map_err(HostError::Option)?,
    };
    let folder = args.paper.open("sekf", runs, &config)?;
    if args.tune {
        return search(args, &config, &folder);
    }
    let numbers = (args.paper.seed, runs);
    let flown = args.paper.on_threads(|| {
        CASES.iter().map(|case| cases::fly(case, (&config, &tuned.tuned), numbers)).collect::<Vec<_>>()
    })?;
    let study = Study {
        head: args.paper.head("sekf", PAPER, runs),
        paper_says: reference::PAPER,
        config: &config,
        tuned_by: &tuned.command,
        tuned_for_step_s: tuned.step_s,
        cases: &flown,
    };
    args.paper.leave(&folder, &study, page::html(&study, &tuned), || screen(&study, &folder))?;
    let mut shipped = flown.iter().flat_map(|case| &case.filters).filter(|outcome| outcome.filter.is_shipped());
    Ok(shipped.all(|outcome| outcome.indefinite_share == 0.0))
}

/// Searches and writes what was found.
fn search(args: &SekfArgs, config: &Config, folder: &Path) -> Result<bool, HostError> {
    let tuned = args.paper.on_threads(|| {
        tune::search(config, |tuned| {
            if !args.paper.quiet {
                let (s, name) = (&tuned.settings, tuned.filter.name());
                eprintln!(
                    "  {} {name}: process {}, accelerometer {}, input {}",
                    tuned.case, s.process, s.accelerometer, s.input
                );
            }
        })
    })?;
    let command = format!("{} --tune", args.paper.command("sekf"));
    let path = folder.join(papers::TUNED);
    papers::write(&TunedFile { command, step_s: config.experiment.step_s, tuned }, &path)?;
    if !args.paper.quiet {
        print(&format!("  {}\n", path.display()))?;
    }
    Ok(true)
}

fn screen(study: &Study<'_>, folder: &Path) -> String {
    let mut out = String::new();
    let head = format!("P1 (Fu et al. 2015): {} runs of seed {} a case", study.head.runs, study.head.seed);
    let _ = writeln!(out, "\n  {}\n  {}\n", style(head).bold(), study.paper_says);
    for case in study.cases {
        let _ = writeln!(out, "  {}", style(case.title).bold());
        let filters = case.filters.iter().map(|outcome| table::cells(case, outcome));
        let rows: Vec<_> = filters.chain(case.limits.iter().map(table::limit_cells)).collect();
        out += &aligned(&table::HEADS.map(str::to_owned), &rows, &[]);
        let _ = writeln!(out);
    }
    let notes = [
        "EKF/filter is the geometric mean over the six states of the ratio of their RMSE: above 1 is better than the EKF.",
        "Reference: an independent implementation at 1 s and 500 runs. NEES of six states: 6 is right.",
        "Bounds are Cramér and Rao's: for who knows input and bias, and for who knows when the input jumps and its size.",
        "Rows of the equations as printed are there to teach; a filter that lost its runs has no figure.",
    ];
    for note in notes.into_iter().chain([table::M7]) {
        let _ = writeln!(out, "  {note}");
    }
    if (study.tuned_for_step_s - study.config.experiment.step_s).abs() > 1e-12 {
        let _ = writeln!(out, "  The tuned settings were found for a step of {} s.", study.tuned_for_step_s);
    }
    let _ = writeln!(out, "  page  {}", style(folder.join(papers::PAGE).display()).cyan().bold());
    out
}
