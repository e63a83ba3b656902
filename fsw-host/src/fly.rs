//! `fly`: one closed-loop entry, from a scenario to a run folder.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use fsw_core::link::schema::SCHEMA_HASH;
use hil_sim::scenario::{Scenario, ScenarioError};
use hil_sim::session::{Conductor, RemoteTruth, TruthEnd};

use crate::bound;
use crate::cli::{ComputerPlace, FlyArgs, TruthPlace};
use crate::ends::{ComputerEnd, LocalComputer};
use crate::error::HostError;
use crate::linklog::{Direction, LinkLogWriter};
use crate::output::{print, print_json};
use crate::progress::Progress;
use crate::pump::{self, Pace, Unwatched, Watch};
use crate::realtime::ask_for_real_time;
use crate::record::{FlightRecord, ScenarioFacts};
use crate::recorder::{FlightId, Recorder};
use crate::replay::read_log;
use crate::runfolder::{BOARD_LOG, RunFolder};
use crate::screen;
use crate::target::{BoardLog, LogStream, Opening, Remote, TargetError};

/// Folder in which run folders are made when none is named.
const RUNS: &str = "runs";
/// The link log reaches the disk at least this often, in records.
const RECORDS_PER_FLUSH: u32 = 500;

/// Set by the first Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Never set.
static UNDISTURBED: AtomicBool = AtomicBool::new(false);

/// Flies inside this process without files; the record holds everything that was heard.
///
/// # Errors
/// The scenario cannot be flown.
pub fn fly_in_process(scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Result<FlightRecord, HostError> {
    fly_watched(scenario, FlightId { seed, run, nominal }, &mut LocalComputer::default(), &mut Unwatched)
}

/// The same on a given computer, with somebody who watches its link.
///
/// # Errors
/// The scenario cannot be flown.
pub fn fly_watched(
    scenario: &Scenario,
    id: FlightId,
    computer: &mut dyn ComputerEnd,
    watch: &mut dyn Watch,
) -> Result<FlightRecord, HostError> {
    let mut truth = Conductor::new(scenario, id.seed, id.run, id.nominal)?;
    let pace = Pace { realtime: false, interrupt: &UNDISTURBED };
    Ok(pump::fly(&mut truth, computer, recorder(scenario, id), watch, pace))
}

/// The same, keeping only the summary, the events and the consistency of the navigation: for many flights.
///
/// # Errors
/// The scenario cannot be flown.
pub fn fly_light(scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Result<FlightRecord, HostError> {
    let mut record = fly_in_process(scenario, seed, run, nominal)?;
    record.truth = Vec::new();
    record.actuators = Vec::new();
    record.nav = Vec::new();
    record.guidance = Vec::new();
    record.health = Vec::new();
    record.frame_cost_us = Vec::new();
    Ok(record)
}

fn recorder(scenario: &Scenario, id: FlightId) -> Recorder {
    Recorder::new(ScenarioFacts::of(scenario), id, scenario.time_limit_s)
}

/// Runs the command; true when the flight was a success.
///
/// # Errors
/// Bad input, or files that cannot be written.
pub fn run(args: &FlyArgs) -> Result<bool, HostError> {
    let scenario = Scenario::resolve(&args.scenario, &args.selection.sets(&args.common.set))?;
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{}: {e}", args.scenario) })?;
    let id = FlightId { seed: args.seed, run: args.run, nominal: args.nominal };
    // Both ends stand before the folder is made: bad input leaves nothing behind.
    let mut truth = truth_end(args, &scenario, id)?;
    let progress = Progress::new(!args.common.quiet && !args.common.json);
    let computer = Computer::open(args, &progress)?;
    let folder = match &args.out {
        Some(path) => RunFolder::at(path, args.force)?,
        None => RunFolder::fresh(Path::new(RUNS), &format!("{}-seed{}", file_name(&scenario.name), args.seed))?,
    };
    folder.write_scenario(&scenario.to_toml())?;
    let Computer { mut end, facts, log } = computer;
    let board_log = log.map(|log| start_log(log, &folder, args, &progress)).transpose()?;
    progress.fly();
    let mut watch = Recording { log: folder.link_log(SCHEMA_HASH)?, unflushed: 0, progress };
    catch_interrupt()?;
    let grant = args.rt.then(ask_for_real_time);
    let pace = Pace { realtime: args.realtime, interrupt: &INTERRUPTED };
    let recorder = recorder(&scenario, id).on(facts);
    let mut record = pump::fly(truth.as_mut(), end.as_mut(), recorder, &mut watch, pace);
    if let Some(kept) = &mut record.summary.realtime {
        kept.grant = grant;
    }
    // The board is switched off first: with that its log is complete.
    drop(end);
    let board_log = board_log.map_or(Ok(()), BoardLog::finish);
    // A log that could not be finished does not keep the rest from being written.
    let log = watch.finish().map_err(HostError::file("write", folder.path().join("link.bin")));
    // Nor does a log that tells too little for a bound: the report says that there is none.
    let bound = read_log(folder.path()).and_then(|log| bound::of(&log, &record));
    record.set_bound(bound.unwrap_or_default());
    let files = folder.write_record(&record, args.csv);
    log?;
    board_log.map_err(HostError::file("write", folder.path().join(BOARD_LOG)))?;
    files?;
    say(args, &record, folder.path())?;
    Ok(record.summary.success)
}

/// The flight computer as the user asked for it.
struct Computer {
    end: Box<dyn ComputerEnd>,
    facts: crate::record::Computer,
    log: Option<LogStream>,
}

impl Computer {
    fn open(args: &FlyArgs, progress: &Progress) -> Result<Self, HostError> {
        let place = args.computer.to_string();
        let emulated = matches!(args.computer, ComputerPlace::Qemu(_));
        if args.image.is_some() && !emulated {
            return Err(TargetError::ImageNotTaken(place).into());
        }
        if args.verbose && !emulated {
            let no_log = "--verbose shows the log of an emulated board; --computer";
            return Err(HostError::Option(format!("{no_log} {place} has none here")));
        }
        let say = |what: &str| progress.say(what);
        let opening = Opening { image: args.image.as_deref(), interrupt: &INTERRUPTED, say: &say };
        let Remote { end, facts, log } = match &args.computer {
            ComputerPlace::InProcess => {
                let facts = crate::record::Computer { place, ..Default::default() };
                return Ok(Self { end: Box::new(LocalComputer::default()), facts, log: None });
            }
            ComputerPlace::Qemu(target) => opening.emulator(*target)?,
            ComputerPlace::Serial(line) => opening.serial(line)?,
        };
        Ok(Self { end: Box::new(end), facts, log })
    }
}

fn start_log(log: LogStream, folder: &RunFolder, args: &FlyArgs, progress: &Progress) -> Result<BoardLog, HostError> {
    let show = args.verbose.then(|| -> Box<dyn Fn(&str) + Send> { Box::new(progress.lines()) });
    Ok(log.write_to(&folder.path().join(BOARD_LOG), show)?)
}

fn truth_end(args: &FlyArgs, scenario: &Scenario, id: FlightId) -> Result<Box<dyn TruthEnd>, HostError> {
    let open = |place: &str| RemoteTruth::open(place, scenario, id.seed, id.run, id.nominal);
    Ok(match &args.truth {
        TruthPlace::InProcess => {
            let mut conductor = Conductor::new(scenario, id.seed, id.run, id.nominal)?;
            // A real board has a clock of its own that goes as ours does; an emulated one has none.
            if args.realtime && matches!(args.computer, ComputerPlace::Serial(_)) {
                conductor.set_pace(fsw_core::link::packet::Pace::RealTime);
            }
            Box::new(conductor)
        }
        TruthPlace::Tcp(address) => Box::new(open(&format!("tcp:{address}"))?),
        TruthPlace::Pty => Box::new(open("pty")?),
    })
}

/// The name of a scenario as part of a path: letters, digits, `-`, `_` and `.` stay.
pub(crate) fn file_name(name: &str) -> String {
    let keep = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    name.chars().map(|c| if keep(c) { c } else { '-' }).collect()
}

/// The first Ctrl-C ends the flight and keeps it; a second one ends the program.
fn catch_interrupt() -> Result<(), HostError> {
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| HostError::Option(format!("Ctrl-C cannot be caught: {e}")))
}

fn say(args: &FlyArgs, record: &FlightRecord, folder: &Path) -> Result<(), HostError> {
    if args.common.json {
        print_json(&record.summary)?;
    } else if !args.common.quiet {
        print(&screen::summary(record, Some(folder)))?;
    }
    if let Some(reason) = &record.summary.reason {
        eprintln!("aeroshell: {reason}; what was recorded is in {}", folder.display());
    }
    Ok(())
}

/// Keeps `link.bin` and moves the bar.
struct Recording {
    log: LinkLogWriter<BufWriter<File>>,
    unflushed: u32,
    progress: Progress,
}

impl Recording {
    fn finish(&mut self) -> io::Result<()> {
        self.progress.finish();
        self.log.flush()
    }
}

impl Watch for Recording {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.log.record(direction, bytes)?;
        self.unflushed += 1;
        if self.unflushed >= RECORDS_PER_FLUSH {
            self.unflushed = 0;
            self.log.flush()?;
        }
        Ok(())
    }

    fn progress(&mut self, recorder: &Recorder) {
        self.progress.update(recorder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scenario_name_makes_a_harmless_folder_name() {
        assert_eq!(file_name("msl-beacon_2.1"), "msl-beacon_2.1");
        assert_eq!(file_name("../my entry"), "..-my-entry");
    }
}
