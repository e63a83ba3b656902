//! `campaign`: many dispersed flights of a scenario, and what they show.
//!
//! Run k depends on nothing but the seed and k. [`engine`] flies the runs on all cores, [`folder`] keeps them in whole
//! chunks so that a campaign that was stopped goes on where it was, [`summary`] and [`report`] come from the final table
//! alone. So order, threads, shards and interruptions leave no trace in the results.

pub mod arguments;
mod chunks;
pub mod columns;
pub mod compare;
pub mod direct;
pub mod engine;
pub mod flight;
pub mod folder;
pub mod identity;
mod merge;
pub mod observer;
pub mod progress;
pub mod report;
pub mod runs;
pub mod screen;
pub mod split;
pub mod statistics;
pub mod summary;
pub mod table;

use std::io;
use std::path::Path;
use std::time::Instant;

use hil_sim::scenario::{Scenario, ScenarioError};
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::cli::CampaignArgs;
use crate::error::HostError;
use crate::interrupt;
use crate::output::{json_text, print, print_json};
use crate::record::ScenarioFacts;

use arguments::MOST_RUNS;
use engine::Engine;
use folder::Folder;
use identity::Identity;
use progress::Progress;
use report::Material;
use runs::Runs;
use summary::{Summary, summarise};

/// Folder in which campaign folders are made when none is named.
const CAMPAIGNS: &str = "campaigns";

/// A campaign that is complete: all of its files are there.
pub struct Finished {
    /// Where it is and what it is about.
    pub folder: Folder,
    /// What was flown.
    pub scenario: Scenario,
    /// Its facts.
    pub facts: ScenarioFacts,
    /// Its figures.
    pub summary: Summary,
    /// Its table.
    pub runs: Runs,
}

impl Finished {
    /// Whether every run could be flown.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        !self.summary.outcomes.iter().any(|(word, _)| word == "failed")
    }

    /// Tells the result on standard output, as asked for.
    fn tell(&self, args: &CampaignArgs) -> Result<bool, HostError> {
        if args.common.json {
            print_json(&self.summary)?;
        } else if !args.common.quiet {
            print(&screen::summary(&self.summary, self.folder.path()))?;
        }
        Ok(self.is_whole())
    }
}

/// Runs the command; true when every run could be flown.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &CampaignArgs) -> Result<bool, HostError> {
    if !args.merge.is_empty() {
        return merge::run(args);
    }
    complete(args, "")?.tell(args)
}

/// Flies what is still to be flown of a campaign and writes its files; `name` stands before the progress bar.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn complete(args: &CampaignArgs, name: &str) -> Result<Finished, HostError> {
    let scenario = Scenario::resolve(&args.scenario, &args.selection.sets(&args.common.set))?;
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{}: {e}", args.scenario) })?;
    let identity = identify(args, &scenario)?;
    // A scenario that the flight software refuses is refused before a folder is made.
    let engine = Engine::new(&scenario, args.seed, identity.split);
    hil_sim::session::Conductor::new(&scenario, args.seed, identity.first, false)?;
    let folder = match &args.out {
        Some(path) => Folder::at(path, &identity, args.force)?,
        None => {
            let name = format!("{}-seed{}-{}runs", crate::fly::file_name(&scenario.name), args.seed, identity.runs);
            Folder::fresh(Path::new(CAMPAIGNS), &name, &identity)?
        }
    };
    folder.write(folder::SCENARIO, |out| io::Write::write_all(out, scenario.to_toml().as_bytes()))?;
    let started = Instant::now();
    let flown = fly(args, name, &engine, &folder)?;
    let wall_s = started.elapsed().as_secs_f64();
    conclude(folder, scenario, (flown > 0).then_some((flown, wall_s)))
}

/// What a campaign is about, checked.
///
/// # Errors
/// No number of runs, or one that is out of range.
pub(crate) fn identify(args: &CampaignArgs, scenario: &Scenario) -> Result<Identity, HostError> {
    let bad = |what: String| Err(HostError::Option(what));
    let Some(runs) = args.runs else { return bad("--runs is missing: how many runs shall be flown?".into()) };
    if runs == 0 || runs > MOST_RUNS {
        return bad(format!("--runs {runs}: a campaign has 1 to {MOST_RUNS} runs"));
    }
    if args.first > MOST_RUNS {
        return bad(format!("--first {}: run numbers go from 0 to {MOST_RUNS}", args.first));
    }
    Ok(Identity {
        scenario: scenario.name.clone(),
        scenario_sha256: sha256(scenario.to_toml().as_bytes()),
        seed: args.seed,
        first: args.first,
        runs,
        split: args.split,
        program_sha256: program()?,
        fly: args.selection.fly_arguments(&args.scenario, &args.common.set),
    })
}

/// Identity of the program that flies: the flight software is part of it.
pub(crate) fn program() -> Result<String, HostError> {
    let read = || std::fs::read(std::env::current_exe()?);
    read().map(|bytes| sha256(&bytes)).map_err(HostError::file("read", "this program"))
}

pub(crate) fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Flies what is still to be flown; the number of runs.
fn fly(args: &CampaignArgs, name: &str, engine: &Engine<'_>, folder: &Folder) -> Result<u64, HostError> {
    let chunks = folder.open_chunks()?;
    let left: u64 = chunks.iter().map(|chunk| chunk.end - chunk.start).sum();
    let identity = folder.identity();
    if left > 0 && left < identity.runs && !args.common.quiet {
        eprintln!(
            "  goes on in {}: {} of {} runs are there",
            folder.path().display(),
            identity.runs - left,
            identity.runs
        );
    }
    if left > 0 {
        interrupt::catch()?;
        let progress =
            Progress::new(name, left, !args.common.quiet && !args.common.json, !args.common.quiet && name.is_empty());
        let jobs = args.jobs.map_or_else(cores, std::num::NonZeroUsize::get);
        let flown =
            engine.fly_all(folder, &chunks, jobs, interrupt::asked(), &|result| progress.flown(result, identity));
        progress.finish();
        if matches!(flown, Err(HostError::Interrupted)) {
            let open: u64 = folder.open_chunks()?.iter().map(|chunk| chunk.end - chunk.start).sum();
            let (kept, runs, path) = (identity.runs - open, identity.runs, folder.path().display());
            let what =
                format!("interrupted: {kept} of {runs} runs are kept in {path}, and the same command goes on there");
            return Err(HostError::Option(what));
        }
        flown?;
    }
    folder.gather(&engine.columns.headings())?;
    Ok(left)
}

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get)
}

/// Everything that follows from the table of all runs; `sitting` are the runs flown just now and their wall time.
fn conclude(folder: Folder, scenario: Scenario, sitting: Option<(u64, f64)>) -> Result<Finished, HostError> {
    let table = folder.runs();
    let facts = ScenarioFacts::of(&scenario);
    let unreadable = |e| HostError::file("read", &table)(e);
    let runs = Runs::open(&table, folder.identity())?;
    let plain = summarise(&runs, folder.identity(), &facts).map_err(unreadable)?;
    let (wall_s, runs_per_s) = match sitting {
        Some((flown, wall_s)) => (wall_s, (wall_s > 0.0).then(|| flown as f64 / wall_s)),
        None => earlier_sitting(&folder),
    };
    let summary = Summary { wall_s, runs_per_s, ..plain };
    // The shortest and most telling file first.
    folder.write(folder::SUMMARY, |out| write_json(&summary, out))?;
    let identity = folder.identity();
    let page = report::html(&Material { runs: &runs, summary: &summary, scenario: &scenario, facts: &facts, identity });
    let page = page.map_err(|e| HostError::Option(format!("{}: {e}", table.display())))?;
    folder.write(folder::REPORT, |out| io::Write::write_all(out, page.as_bytes()))?;
    Ok(Finished { folder, scenario, facts, summary, runs })
}

/// Wall time and rate of the sitting that flew the last runs: what is only looked at again keeps them.
fn earlier_sitting(folder: &Folder) -> (f64, Option<f64>) {
    let text = std::fs::read_to_string(folder.path().join(folder::SUMMARY)).unwrap_or_default();
    serde_json::from_str::<Summary>(&text).map_or((0.0, None), |summary| (summary.wall_s, summary.runs_per_s))
}

pub(crate) fn write_json(value: &impl Serialize, out: &mut impl io::Write) -> io::Result<()> {
    out.write_all(json_text(value)?.as_bytes())
}
