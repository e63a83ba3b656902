//! `rank`: all navigation filters on the same recorded link logs, and each in closed loop over the same dispersed entries,
//! beside the physical limit.

mod cases;
mod cost;
mod entry;
mod kept;
mod navigate;
mod page;
mod table;

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use clap::Args;
use fsw_core::link::parameters::NavigationMode;
use hil_sim::case::Case;
use hil_sim::scenario::{Scenario, ScenarioError};
use indicatif::ProgressBar;
use rayon::prelude::*;

pub use cases::CaseName;
pub use cost::OnTarget;
pub use navigate::{Track, navigate};
pub use table::{Limit, Placed, Ranking};

use entry::{Curve, Entry, Judged};
use kept::{Identity, Kept};

use crate::bound::{self, Least};
use crate::campaign::arguments::{threads, whole};
use crate::campaign::flight::Flyer;
use crate::campaign::progress::bar_over;
use crate::campaign::{program, sha256, write_json};
use crate::cli::{Common, navigation_name};
use crate::error::HostError;
use crate::interrupt;
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
    /// What goes wrong that the flight software is not told of; may be given several times.
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
    let filters = filters(args)?;
    // Every case is checked before the first flight.
    let scenarios =
        cases.iter().map(|case| Ok((*case, scenario(args, *case)?))).collect::<Result<Vec<_>, HostError>>()?;
    let folder = folder(args)?;
    let kept = Kept::open(&folder, &identity(args, &filters, &scenarios)?)?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, NonZeroUsize::get)).build();
    let pool = pool.map_err(|e| HostError::Option(format!("the threads cannot be started: {e}")))?;
    let all = args.runs * cases.len() as u64;
    if kept.len() > 0 && !args.common.quiet {
        eprintln!("  goes on in {}: {} of {all} entries are there", folder.display(), kept.len());
    }
    interrupt::catch()?;
    let bar = bar_over(all, !args.common.quiet && !args.common.json);
    let work = Work { args, filters: &filters, kept: &kept, bar: &bar };
    let rank = |(case, scenario): &(CaseName, Scenario)| -> Result<Ranking, HostError> {
        let entries = pool.install(|| work.entries(&case.name(), scenario))?;
        Ok(Ranking::of(case.name(), &filters, &entries))
    };
    let rankings = scenarios.iter().map(rank).collect::<Result<Vec<_>, _>>();
    bar.finish_and_clear();
    if matches!(rankings, Err(HostError::Interrupted)) {
        let path = folder.display();
        let what =
            format!("interrupted: the entries that were done are kept in {path}, and the same command goes on there");
        return Err(HostError::Option(what));
    }
    let rankings = rankings?;
    write_whole(&folder.join("rank.json"), |file| write_json(&rankings, file))?;
    let page = page::page(args, &rankings).map_err(|e| HostError::Option(e.to_string()))?;
    write_whole(&folder.join("rank.html"), |file| std::io::Write::write_all(file, page.as_bytes()))?;
    kept.finish()?;
    if args.common.json {
        print_json(&rankings)?;
    } else if !args.common.quiet {
        print(&table::text(args, &rankings))?;
        print(&format!("  page    {}\n", folder.join("rank.html").display()))?;
    }
    Ok(rankings.iter().all(Ranking::is_sound))
}

fn filters(args: &RankArgs) -> Result<Vec<NavigationMode>, HostError> {
    let chosen = &args.filters;
    if let Some((_, twice)) = chosen.iter().enumerate().find(|(at, mode)| chosen.iter().take(*at).any(|m| m == *mode)) {
        return Err(HostError::Option(format!("--filters names {} twice", twice.name())));
    }
    let all = NavigationMode::ALL.iter().copied().filter(|mode| *mode != NavigationMode::Ideal);
    Ok(if chosen.is_empty() { all.collect() } else { chosen.clone() })
}

fn scenario(args: &RankArgs, case: CaseName) -> Result<Scenario, HostError> {
    let mut scenario = Scenario::resolve(&args.scenario, &args.common.set)?;
    let place = format!("{} in case {}", args.scenario, case.name());
    case.apply(&mut scenario);
    // Its ranges are those of a file.
    let scenario = Scenario::from_text(&place, &scenario.to_toml(), Path::new(""), &[])?;
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{place}: {e}") })?;
    if scenario.navigation.filter == NavigationMode::Ideal {
        return Err(HostError::Option(format!(
            "{place}: navigation.filter is ideal, which leaves filters nothing to do"
        )));
    }
    Ok(scenario)
}

/// What the entries of this ranking have in common.
fn identity(
    args: &RankArgs,
    filters: &[NavigationMode],
    scenarios: &[(CaseName, Scenario)],
) -> Result<Identity, HostError> {
    let digest = |(case, scenario): &(CaseName, Scenario)| (case.name(), sha256(scenario.to_toml().as_bytes()));
    Ok(Identity {
        cases: scenarios.iter().map(digest).collect(),
        seed: args.seed,
        filters: filters.iter().map(|mode| mode.name().to_owned()).collect(),
        open_loop: args.open_loop,
        program_sha256: program()?,
    })
}

/// What the entries of all cases share.
struct Work<'a> {
    args: &'a RankArgs,
    filters: &'a [NavigationMode],
    kept: &'a Kept,
    bar: &'a ProgressBar,
}

impl Work<'_> {
    /// All entries of a case: those that were kept, and the others flown and kept.
    fn entries(&self, case: &str, scenario: &Scenario) -> Result<Vec<Entry>, HostError> {
        let facts = ScenarioFacts::of(scenario);
        (0..self.args.runs)
            .into_par_iter()
            .map_init(Flyer::default, |flyer, run| {
                let entry = match self.kept.find(case, run) {
                    Some(entry) => entry.clone(),
                    None if interrupt::asked().load(Ordering::Relaxed) => return Err(HostError::Interrupted),
                    None => {
                        let entry = self.fly(flyer, scenario, &facts, run)?;
                        self.kept.keep(case, run, &entry)?;
                        entry
                    }
                };
                self.bar.inc(1);
                Ok(entry)
            })
            .collect()
    }

    fn fly(&self, flyer: &mut Flyer, scenario: &Scenario, facts: &ScenarioFacts, run: u64) -> Result<Entry, HostError> {
        let recorded = Recorded::fly(scenario, self.args.seed, run)?;
        let case = Case::draw(scenario, self.args.seed, run, false);
        let mut flown = Vec::with_capacity(self.filters.len());
        for mode in self.filters {
            let track = navigate(&recorded, *mode);
            let mut scenario = scenario.clone();
            scenario.navigation.filter = *mode;
            let closed = (!self.args.open_loop).then(|| flyer.fly(&scenario, facts, &case, &[])).transpose()?;
            flown.push(Judged::of(&track, closed.as_ref()));
        }
        Ok(Entry { bound: Curve::of(&least(&recorded)), flown })
    }
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
