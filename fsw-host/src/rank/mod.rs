//! `rank`: all navigation filters on the same recorded link logs, and each in closed loop over the same dispersed entries,
//! beside the physical limit.

mod cases;
mod navigate;
mod page;
mod table;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Args;
use fsw_core::link::parameters::NavigationMode;
use hil_sim::case::Case;
use hil_sim::scenario::{Scenario, ScenarioError};
use indicatif::ProgressBar;
use rayon::prelude::*;

pub use cases::CaseName;
pub use navigate::{Track, navigate};
pub use table::{Limit, Placed, Ranking};

use crate::bound::{self, Least};
use crate::campaign::arguments::{threads, whole};
use crate::campaign::flight::Flyer;
use crate::campaign::observer::Flown;
use crate::campaign::progress::bar_over;
use crate::campaign::write_json;
use crate::cli::{Common, navigation_name};
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::record::ScenarioFacts;
use crate::recorded::Recorded;
use crate::runfolder::write_whole;

/// Folder in which ranking folders are made when none is named.
const RANKINGS: &str = "rankings";
/// Most entries.
const MOST_RUNS: u64 = 100_000;

/// Options of `rank`.
#[derive(Clone, Debug, Args)]
pub struct RankArgs {
    /// Built-in scenario or TOML file; its own navigation flies the recorded entries.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options; --out names the folder.
    #[command(flatten)]
    pub common: Common,
    /// Dispersed entries.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole(1, MOST_RUNS), allow_negative_numbers = true)]
    pub runs: u64,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, value_parser = whole(0, u64::MAX), allow_negative_numbers = true)]
    pub seed: u64,
    /// Filters, separated by commas; all but `ideal` when left out.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = navigation_name())]
    pub filters: Vec<NavigationMode>,
    /// What goes wrong; may be given several times, or as `all`.
    #[arg(long = "case", value_name = "CASE", value_delimiter = ',', value_enum)]
    pub cases: Vec<CaseName>,
    /// All cases.
    #[arg(long, conflicts_with = "cases")]
    pub all_cases: bool,
    /// Compares on the recorded logs alone: no miss.
    #[arg(long)]
    pub open_loop: bool,
    /// Threads; as many as there are cores when left out. Results do not depend on it.
    #[arg(long, value_name = "J", value_parser = threads, allow_negative_numbers = true)]
    pub jobs: Option<NonZeroUsize>,
    /// Folder of the ranking; without it rankings/SCENARIO-seedS-Nruns. Files of a ranking in it are replaced.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// What one entry gave.
struct Entry {
    /// Least variances on its log.
    bound: Vec<[f64; 2]>,
    /// Of each filter: on the log, and in closed loop.
    flown: Vec<(Track, Option<Flown>)>,
}

/// Runs the command; true when no filter but the teaching baselines failed.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &RankArgs) -> Result<bool, HostError> {
    use clap::ValueEnum;
    let cases: Vec<CaseName> = match (&args.cases[..], args.all_cases) {
        (_, true) => CaseName::value_variants().to_vec(),
        ([], false) => vec![CaseName::Plain],
        (cases, false) => cases.to_vec(),
    };
    let filters = filters(args);
    // Every case is checked before the first flight.
    let scenarios =
        cases.iter().map(|case| Ok((*case, scenario(args, *case)?))).collect::<Result<Vec<_>, HostError>>()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, NonZeroUsize::get)).build();
    let pool = pool.map_err(|e| HostError::Option(format!("the threads cannot be started: {e}")))?;
    let bar = bar_over(args.runs * cases.len() as u64, !args.common.quiet && !args.common.json);
    let rank = |(case, scenario): &(CaseName, Scenario)| -> Result<Ranking, HostError> {
        let entries = pool.install(|| fly(args, scenario, &filters, &bar))?;
        Ok(Ranking::of(case.name(), &filters, &entries))
    };
    let rankings = scenarios.iter().map(rank).collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();
    let folder = folder(args)?;
    write_whole(&folder.join("rank.json"), |file| write_json(&rankings, file))?;
    let page = page::page(args, &rankings).map_err(|e| HostError::Option(e.to_string()))?;
    write_whole(&folder.join("rank.html"), |file| std::io::Write::write_all(file, page.as_bytes()))?;
    if args.common.json {
        print_json(&rankings)?;
    } else if !args.common.quiet {
        print(&table::text(args, &rankings))?;
        print(&format!("  page    {}\n", folder.join("rank.html").display()))?;
    }
    Ok(rankings.iter().all(Ranking::is_sound))
}

fn filters(args: &RankArgs) -> Vec<NavigationMode> {
    if args.filters.is_empty() {
        NavigationMode::ALL.iter().copied().filter(|mode| *mode != NavigationMode::Ideal).collect()
    } else {
        args.filters.clone()
    }
}

fn scenario(args: &RankArgs, case: CaseName) -> Result<Scenario, HostError> {
    let sets: Vec<String> = case.sets().into_iter().chain(args.common.set.iter().cloned()).collect();
    let scenario = Scenario::resolve(&args.scenario, &sets)?;
    let place = format!("{} in case {}", args.scenario, case.name());
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{place}: {e}") })?;
    if scenario.navigation.filter == NavigationMode::Ideal {
        return Err(HostError::Option(format!(
            "{place}: navigation.filter is ideal, which leaves filters nothing to do"
        )));
    }
    Ok(scenario)
}

fn fly(
    args: &RankArgs,
    scenario: &Scenario,
    filters: &[NavigationMode],
    bar: &ProgressBar,
) -> Result<Vec<Entry>, HostError> {
    let facts = ScenarioFacts::of(scenario);
    (0..args.runs)
        .into_par_iter()
        .map_init(Flyer::default, |flyer, run| {
            let recorded = Recorded::fly(scenario, args.seed, run)?;
            let case = Case::draw(scenario, args.seed, run, false);
            let flown = filters
                .iter()
                .map(|mode| {
                    let track = navigate(&recorded, *mode);
                    let mut scenario = scenario.clone();
                    scenario.navigation.filter = *mode;
                    let flown = (!args.open_loop).then(|| flyer.fly(&scenario, &facts, &case, &[])).transpose()?;
                    Ok((track, flown))
                })
                .collect::<Result<_, HostError>>()?;
            bar.inc(1);
            Ok(Entry { bound: least(&recorded), flown })
        })
        .collect()
}

/// Least variances on a log, at the instants at which filters are judged.
fn least(recorded: &Recorded) -> Vec<[f64; 2]> {
    bound::along(recorded, navigate::is_judged).iter().map(Least::variances).collect()
}

fn folder(args: &RankArgs) -> Result<PathBuf, HostError> {
    let name = Path::new(&args.scenario).file_stem().map_or_else(|| "scenario".into(), |stem| stem.to_string_lossy());
    let own = || Path::new(RANKINGS).join(format!("{name}-seed{}-{}runs", args.seed, args.runs));
    let path = args.out.clone().unwrap_or_else(own);
    if path.exists() && !path.is_dir() {
        return Err(HostError::NotAFolder(path));
    }
    std::fs::create_dir_all(&path).map_err(HostError::file("create", &path))?;
    Ok(path)
}
