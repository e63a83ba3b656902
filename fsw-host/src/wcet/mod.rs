//! `wcet`: what the flight software costs, per slot of the schedule and per algorithm, over a set of hard flights.
//!
//! The flights are flown in this process; what went up their links is replayed on the target, which reports the cost of
//! each of its minor frames as it goes.

mod bar;
mod cycles;
pub mod flights;
pub mod host;
pub mod ledger;
pub mod search;
pub mod table;
pub mod target;
pub mod uplink;

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use crate::cli::{WcetArgs, WcetPlace};
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::target::bench::{BENCH_IMAGE, Bench, PATIENCE};
use crate::target::{Image, Target};
use bar::Bar;
use flights::{HardFlight, hard_flights};
use fsw_core::executive::schedule::SCHEDULE;
use ledger::{FrameCost, evenness};
use table::{Flown, Row};

/// Set by the first Ctrl-C.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// The figures in an output folder.
const JSON_FILE: &str = "wcet.json";
/// The worst flight of a search there.
const WORST_FILE: &str = "worst-frame.toml";
/// The table there.
const TEXT_FILE: &str = "wcet.txt";

/// What `--json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// `m7`, `rv64` or `host`.
    pub target: String,
    /// What a figure is, in words.
    pub unit: String,
    /// SHA-256 of the image's memory; none on the host.
    pub image_sha256: Option<String>,
    /// Figures by the names of `firmware/budgets.toml`.
    pub metrics: BTreeMap<String, f64>,
    /// The table.
    pub rows: Vec<Row>,
    /// The flights.
    pub flights: Vec<FlightSummary>,
    /// Tables of the estimate of cycles, for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cycles: Option<String>,
}

/// A flight of the report.
#[derive(Clone, Debug, Serialize)]
pub struct FlightSummary {
    /// Its name.
    pub name: String,
    /// Minor frames that reported their cost.
    pub frames: usize,
    /// Its worst frame.
    pub worst_frame: u32,
    /// When that was, s.
    pub time_s: f64,
    /// Slots of that frame by name.
    pub slots: BTreeMap<&'static str, u32>,
    /// The least even of its seconds.
    pub uneven: Option<Uneven>,
}

/// A second whose worst frame stands out.
#[derive(Clone, Debug, Serialize)]
pub struct Uneven {
    /// Worst frame over mean frame.
    pub ratio: f64,
    /// The worst frame.
    pub worst_frame: u32,
    /// When that was, s.
    pub time_s: f64,
    /// Its slots by name.
    pub slots: BTreeMap<&'static str, u32>,
}

/// Runs the command; true when every budget is kept.
///
/// # Errors
/// Bad input, a missing emulator, an image that does not run.
pub fn run(args: &WcetArgs) -> Result<bool, HostError> {
    catch_interrupt()?;
    let visible = !args.quiet && !args.json;
    let target = match args.target {
        WcetPlace::Emulated(target) => target,
        WcetPlace::Host => return on_host(args, visible),
    };
    let image = image(args, target, visible)?;
    let bench = Bench { target, image: &image, plugin: None, interrupt: &INTERRUPTED, patience: PATIENCE };
    let mut flights = hard_flights()?;
    if let Some(candidates) = args.search {
        flights.extend(search_for_worse(args, &bench, candidates, visible)?);
    }
    let bar = Bar::new(visible, flights.len());
    let (flown, estimate) = if args.cycles {
        let (flown, estimate) = cycles::measure(&bench, &flights, &bar)?;
        (flown, Some(estimate))
    } else {
        (target::measure(&bench, &flights, &bar)?, None)
    };
    drop(bar);
    let mut report = report(Some(target), target::granularity(target), Some(image.sha256.clone()), &flown);
    if let Some(estimate) = estimate {
        estimate.enter(&mut report);
    }
    publish(args, &report)?;
    Ok(!report.rows.iter().any(Row::is_over))
}

/// Wall time in this process.
fn on_host(args: &WcetArgs, visible: bool) -> Result<bool, HostError> {
    if args.image.is_some() || args.cycles || args.search.is_some() {
        return Err(HostError::Option("--image, --cycles and --search are for --target m7 or rv64".into()));
    }
    let flights = hard_flights()?;
    let bar = Bar::new(visible, flights.len());
    let flown = host::measure(&flights, &INTERRUPTED, &bar)?;
    drop(bar);
    publish(args, &report(None, host::GRANULARITY, None, &flown))?;
    Ok(true)
}

/// The worst flight that a search finds, written as a scenario file; none when it found none.
fn search_for_worse(
    args: &WcetArgs,
    bench: &Bench<'_>,
    candidates: usize,
    visible: bool,
) -> Result<Option<HardFlight>, HostError> {
    let bar = Bar::new(visible, candidates);
    let found = target::search(bench, candidates, args.seed, &bar)?;
    drop(bar);
    let (Some((genome, cost)), Some(folder)) = (found.worst, &args.out) else { return Ok(None) };
    let (target, seed) = (bench.target.name(), args.seed);
    let comment = [
        "The default scenario with the entry, air, sources and faults of the worst minor frame that a search found:"
            .into(),
        format!("{cost} instructions on {target}, by"),
        format!("  aeroshell wcet --target {target} --search {candidates} --seed {seed} --out DIR"),
    ];
    keep(folder, WORST_FILE, &search::scenario_file(&genome, &comment))?;
    INTERRUPTED.store(false, Ordering::Relaxed);
    let found = search::flight(&genome)?;
    Ok(Some(HardFlight { name: "found by this search".into(), ..found }))
}

fn image(args: &WcetArgs, target: Target, visible: bool) -> Result<Image, HostError> {
    match &args.image {
        Some(path) => Ok(Image::open(target, path)?),
        None => {
            if visible {
                eprintln!("  building the image {BENCH_IMAGE} for {}", target.title());
            }
            Ok(Image::build(target, BENCH_IMAGE)?)
        }
    }
}

fn report(place: Option<Target>, unit: &str, image_sha256: Option<String>, flown: &[Flown]) -> Report {
    let rows = table::rows(flown, place);
    // The names are those of instructions.
    let metrics = if place.is_some() { table::metrics(flown, &rows) } else { BTreeMap::new() };
    let flights = flown.iter().map(summary).collect();
    let target = place.map_or("host", |target| target.name()).to_owned();
    Report { target, unit: unit.to_owned(), image_sha256, metrics, rows, flights, cycles: None }
}

fn summary(flown: &Flown) -> FlightSummary {
    let dearest =
        |frames: &[FrameCost]| frames.iter().rev().max_by_key(|frame| frame.whole).copied().unwrap_or_default();
    let worst = dearest(&flown.cost.frames);
    let seconds = flown.cost.seconds().filter_map(|second| evenness(second).map(|ratio| (ratio, dearest(second))));
    let uneven = seconds.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(ratio, worst)| Uneven {
        ratio,
        worst_frame: worst.whole,
        time_s: worst.time_s(),
        slots: by_name(&worst),
    });
    FlightSummary {
        name: flown.name.clone(),
        frames: flown.cost.frames.len(),
        worst_frame: worst.whole,
        time_s: worst.time_s(),
        slots: by_name(&worst),
        uneven,
    }
}

fn by_name(frame: &FrameCost) -> BTreeMap<&'static str, u32> {
    SCHEDULE.iter().map(|slot| slot.name).zip(frame.slots).collect()
}

/// Shows the report where it was asked for, and keeps it in the output folder.
fn publish(args: &WcetArgs, report: &Report) -> Result<(), HostError> {
    let text = text_of(report);
    if let Some(folder) = &args.out {
        keep(folder, TEXT_FILE, &text)?;
        keep(folder, JSON_FILE, &serde_json::to_string_pretty(report).unwrap_or_default())?;
    }
    if args.json {
        print_json(report)?;
    } else if !args.quiet {
        print(&text)?;
    }
    for row in report.rows.iter().filter(|row| row.is_over()) {
        let (name, maximum, budget) = (&row.name, row.maximum, row.budget.unwrap_or_default());
        eprintln!(
            "aeroshell: {name}: {maximum:.2} is above the budget of {budget} in {}, {:.2} s",
            row.flight, row.time_s
        );
    }
    Ok(())
}

fn text_of(report: &Report) -> String {
    let mut text =
        format!("Execution cost on {}, {} flights\n{}\n\n", report.target, report.flights.len(), report.unit);
    text.push_str(&table::text(&report.rows));
    text.push_str("\nworst frame of each flight\n");
    for flight in &report.flights {
        frame_line(&mut text, &flight.name, flight.worst_frame, flight.time_s, &flight.slots);
    }
    text.push_str("\nworst frame of the least even second of each flight, and its ratio to the mean of that second\n");
    for flight in &report.flights {
        if let Some(Uneven { ratio, worst_frame, time_s, slots }) = &flight.uneven {
            frame_line(&mut text, &format!("{:<22} {ratio:.2}", flight.name), *worst_frame, *time_s, slots);
        }
    }
    if let Some(cycles) = &report.cycles {
        text.push('\n');
        text.push_str(cycles);
    }
    text
}

fn frame_line(text: &mut String, name: &str, whole: u32, time_s: f64, slots: &BTreeMap<&'static str, u32>) {
    let slots: Vec<_> = slots.iter().map(|(name, cost)| format!("{name} {cost}")).collect();
    // Writing into a string cannot fail.
    let _ = writeln!(text, "{name:<22} {whole:>7} at {time_s:>7.2} s: {}", slots.join(", "));
}

fn keep(folder: &Path, name: &str, text: &str) -> Result<(), HostError> {
    std::fs::create_dir_all(folder).map_err(HostError::file("create", folder))?;
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(HostError::file("write", path))
}

/// The first Ctrl-C ends the measurement in good order; a second one ends the program.
fn catch_interrupt() -> Result<(), HostError> {
    ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| HostError::Option(format!("Ctrl-C cannot be caught: {e}")))
}
