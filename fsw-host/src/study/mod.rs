//! `study`: the papers' experiments, repeated, with our figures beside theirs.
//!
//! `study npc` is P4's: its predictor-corrector (`paper`) against the segmented form as it is printed (`segmented`) and as
//! it can be repaired (`segmented-table`). Each mode flies undispersed, timed, and then a whole campaign of its own in a
//! folder of its own, so that a study that was stopped goes on where it was, and `compare` and `fly` can follow up.
//!
//! [`sekf`] is P1's, [`ddf`] P2's, [`mmae`] P3's. The studies of filters share [`papers`]: options, configuration, folder;
//! their engines are in `fsw-study`.

pub mod ddf;
mod figures;
mod folder;
pub mod mmae;
mod nominal;
mod options;
mod page;
pub mod papers;
mod points;
mod published;
pub mod sekf;

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use console::style;
use hil_sim::scenario::{Scenario, ScenarioError};
use serde::Serialize;

pub use options::{StudyArgs, StudyCommand};

use crate::campaign::summary::Summary;
use crate::campaign::{self, Finished};
use crate::cli::{CampaignArgs, Common, GuidanceName, Selection};
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::record::ScenarioFacts;
use crate::runfolder::write_whole;
use nominal::Nominal;
use points::DeployPoint;
use published::Line;

/// Figures of the study.
const JSON: &str = "study.json";
/// Its page.
const PAGE: &str = "study.html";
/// Deploy points of all runs.
const POINTS: &str = "points.csv";

/// Conditions of the comparison: P4's planet neither turns nor bulges, and its guidance knows its state.
const CONDITIONS: [&str; 3] = ["planet.rotation_radps=0.0", "planet.j2=0.0", "navigation.filter=ideal"];

/// A guidance mode of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode(GuidanceName);

/// The modes; the full predictor-corrector, which the others are set against, first.
const MODES: [Mode; 3] = [Mode(GuidanceName::Paper), Mode(GuidanceName::Segmented), Mode(GuidanceName::SegmentedTable)];

impl Mode {
    /// Its name, which is that of its folder too.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.0.field_value()
    }
}

/// What one mode has flown.
pub struct Flown {
    /// Which mode.
    pub mode: Mode,
    /// Undispersed.
    pub nominal: Nominal,
    /// Dispersed: the figures.
    pub summary: Summary,
    /// Dispersed: every run.
    pub points: Vec<DeployPoint>,
    /// The facts of the scenario.
    pub facts: ScenarioFacts,
    /// The command that flies the dispersed runs alone.
    pub command: String,
    /// Whether every run could be flown.
    pub is_whole: bool,
}

impl Flown {
    /// Mean evaluations of the equations of motion in a dispersed flight.
    #[must_use]
    pub fn evaluations_per_flight(&self) -> Option<f64> {
        let all: Vec<f64> = self.points.iter().map(|p| p.cycles * p.evaluations_per_cycle).collect();
        crate::campaign::statistics::mean(&all.into_iter().filter(|v| v.is_finite()).collect::<Vec<_>>())
    }
}

/// Content of `study.json`.
#[derive(Serialize)]
struct Study<'a> {
    study: &'static str,
    paper: &'static str,
    scenario: &'a str,
    conditions: [&'static str; CONDITIONS.len()],
    seed: u64,
    runs: u64,
    comparison: &'a [Line],
    modes: Vec<ModeFigures<'a>>,
}

#[derive(Serialize)]
struct ModeFigures<'a> {
    mode: &'static str,
    nominal: &'a Nominal,
    campaign: &'a Summary,
}

/// Runs the command; true when every run could be flown.
///
/// # Errors
/// Bad input, files that cannot be written, or the user has had enough.
pub fn run(command: &StudyCommand) -> Result<bool, HostError> {
    match command {
        StudyCommand::Npc(args) => npc(args),
        StudyCommand::Sekf(args) => sekf::run(args),
        StudyCommand::Ddf(args) => ddf::run(args),
        StudyCommand::Mmae(args) => mmae::run(args),
    }
}

fn npc(args: &StudyArgs) -> Result<bool, HostError> {
    let scenarios =
        MODES.iter().map(|mode| Ok((*mode, scenario(args, *mode)?))).collect::<Result<Vec<_>, HostError>>()?;
    let folder = folder::open(args, &scenarios)?;
    let modes = fly(args, &folder, &scenarios)?;
    let lines = published::compare(&modes);
    let study = Study {
        study: "npc",
        paper: "P4: Xia, Shen, Sun, Zhou, J. Deep Space Exploration 2 (4), 338-344, 2015, doi 10.15982/j.issn.2095-7777.2015.04.007",
        scenario: &args.config,
        conditions: CONDITIONS,
        seed: args.seed,
        runs: args.runs,
        comparison: &lines,
        modes: modes.iter().map(figures_of).collect(),
    };
    write_whole(&folder.join(POINTS), |out| {
        points::write_csv(modes.iter().map(|mode| (mode.mode, mode.points.as_slice())), out)
    })?;
    let page = page::html(args, &modes, &lines).map_err(|e| HostError::Option(e.to_string()))?;
    write_whole(&folder.join(PAGE), |out| io::Write::write_all(out, page.as_bytes()))?;
    write_whole(&folder.join(JSON), |out| campaign::write_json(&study, out))?;
    if args.common.json {
        print_json(&study)?;
    } else if !args.common.quiet {
        print(&screen(args, &lines, &folder))?;
    }
    Ok(modes.iter().all(|mode| mode.is_whole))
}

fn figures_of(flown: &Flown) -> ModeFigures<'_> {
    ModeFigures { mode: flown.mode.name(), nominal: &flown.nominal, campaign: &flown.summary }
}

/// The campaign of one mode.
fn campaign_of(args: &StudyArgs, mode: Mode, out: Option<&Path>) -> CampaignArgs {
    let set = CONDITIONS.iter().map(|field| (*field).to_owned()).chain(args.common.set.iter().cloned()).collect();
    CampaignArgs {
        scenario: args.config.clone(),
        common: Common { set, ..args.common.clone() },
        selection: Selection { guidance: Some(mode.0), ..Selection::default() },
        runs: Some(args.runs),
        seed: args.seed,
        first: 0,
        jobs: args.jobs,
        split: 0,
        merge: Vec::new(),
        out: out.map(|folder| folder.join(mode.name())),
        force: args.force,
    }
}

/// The scenario of one mode, checked.
fn scenario(args: &StudyArgs, mode: Mode) -> Result<Scenario, HostError> {
    let campaign = campaign_of(args, mode, None);
    let scenario = Scenario::resolve(&campaign.scenario, &campaign.selection.sets(&campaign.common.set))?;
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{}: {e}", args.config) })?;
    // What cannot be flown is refused before a folder is made.
    campaign::identify(&campaign, &scenario)?;
    hil_sim::session::Conductor::new(&scenario, args.seed, 0, false)?;
    Ok(scenario)
}

/// Flies every mode, undispersed first.
fn fly(args: &StudyArgs, folder: &Path, scenarios: &[(Mode, Scenario)]) -> Result<Vec<Flown>, HostError> {
    let nominals = nominal::fly(scenarios, args.seed)?;
    let mut modes = Vec::with_capacity(scenarios.len());
    for ((mode, _), nominal) in scenarios.iter().zip(nominals) {
        let finished = campaign::complete(&campaign_of(args, *mode, Some(folder)), mode.name())?;
        let points = points::of(&finished.runs).map_err(HostError::file("read", finished.folder.runs()))?;
        let identity = finished.folder.identity();
        let command = format!(
            "aeroshell campaign {} --seed {} --runs {} --split 0",
            identity.fly.join(" "),
            args.seed,
            args.runs
        );
        let is_whole = finished.is_whole();
        let Finished { summary, facts, .. } = finished;
        modes.push(Flown { mode: *mode, nominal, summary, points, facts, command, is_whole });
    }
    Ok(modes)
}

fn screen(args: &StudyArgs, lines: &[Line], folder: &Path) -> String {
    let mut out = String::new();
    let head = format!(
        "P4 (Xia et al. 2015) and ours: {} without rotation and J2, ideal navigation, {} runs of seed {} a mode",
        args.config, args.runs, args.seed
    );
    let _ = writeln!(out, "\n  {}\n", style(head).bold());
    let names = MODES.map(Mode::name);
    out.push_str(&published::table(lines, &names));
    let _ =
        writeln!(out, "\n  in brackets the 95 % bounds of a share, the range of the runs of an altitude; times are of");
    let _ = writeln!(out, "  this machine, each frame in the quickest of {} flights", nominal::TIMED_FLIGHTS);
    let _ = writeln!(out, "  page  {}", style(folder.join(PAGE).display()).cyan().bold());
    out
}
