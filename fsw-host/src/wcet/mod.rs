//! `wcet`: what the flight software costs, per slot of the schedule and per algorithm, over a set of hard flights.
//!
//! For an emulated processor the flights are flown in this process; what went up their links is replayed on the target,
//! which reports the cost of each of its minor frames as it goes. A board flies them itself, at the end of its line.

pub mod args;
pub mod bar;
pub mod callgrind;
mod cycles;
pub mod flights;
pub mod host;
pub mod ledger;
pub mod line;
pub mod navigation;
pub mod report;
pub mod search;
pub mod table;
pub mod target;
pub mod uplink;

use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

use crate::error::HostError;
use crate::interrupt;
use crate::target::bench::{BENCH_IMAGE, Bench, PATIENCE};
use crate::target::{Image, Opening, Target};
use args::{WcetArgs, WcetPlace};
use bar::Bar;
use flights::{HardFlight, hard_flights};
use fsw_core::link::parameters::NavigationMode;
use navigation::{Extent, ModeCost, NavigationReport};
use report::{Report, WallTime, keep, publish};
use table::{Budgets, Row};

/// The worst flight of a search in an output folder.
const WORST_FILE: &str = "worst-frame.toml";

/// Runs the command; true when every budget is kept.
///
/// # Errors
/// Bad input, a missing emulator, an image that does not run, a board that cannot be reached.
pub fn run(args: &WcetArgs) -> Result<bool, HostError> {
    args.check()?;
    interrupt::catch()?;
    let visible = !args.quiet && !args.json;
    if let (Some(extent), WcetPlace::Emulated(target)) = (args.navigation, &args.target) {
        return by_navigation(args, extent, *target, visible);
    }
    let mut flights = hard_flights()?;
    flights.truncate(args.flights.map_or(usize::MAX, NonZeroUsize::get));
    let report = match &args.target {
        WcetPlace::Emulated(target) => emulated(args, *target, flights, visible)?,
        WcetPlace::Host => on_host(&flights, visible)?,
        WcetPlace::Serial(line) => on_board(args, line, &flights, visible)?,
    };
    publish(args, &report)?;
    Ok(!report.rows.iter().any(Row::is_over))
}

/// Instructions, and where asked for cycles, on an emulated processor.
fn emulated(args: &WcetArgs, target: Target, mut flights: Vec<HardFlight>, visible: bool) -> Result<Report, HostError> {
    let image = image(args, target, visible)?;
    let bench = Bench { target, image: &image, plugin: None, interrupt: interrupt::asked(), patience: PATIENCE };
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
    let budgets = Budgets::Instructions(Some(target));
    let mut report = Report::new(target.name(), target::granularity(target), budgets, &flown);
    report.image_sha256 = Some(image.sha256);
    if let Some(estimate) = estimate {
        estimate.enter(&mut report);
    }
    Ok(report)
}

/// Every navigation algorithm on an emulated processor; true when each keeps the budget of its frames.
fn by_navigation(args: &WcetArgs, extent: Extent, target: Target, visible: bool) -> Result<bool, HostError> {
    let image = image(args, target, visible)?;
    let bench = Bench { target, image: &image, plugin: None, interrupt: interrupt::asked(), patience: PATIENCE };
    let modes = if args.filters.is_empty() { NavigationMode::ALL } else { &args.filters };
    let bar = Bar::new(visible, navigation::logs(extent, modes.len()));
    let modes = navigation::measure(&bench, extent, modes, &bar)?;
    drop(bar);
    let unit = target::granularity(target).to_owned();
    let report = NavigationReport { target: target.name().to_owned(), unit, modes };
    navigation::publish(args, &report)?;
    Ok(!report.modes.iter().any(ModeCost::is_over))
}

/// Instructions counted by Callgrind, where it is installed, and wall time in this process.
fn on_host(flights: &[HardFlight], visible: bool) -> Result<Report, HostError> {
    if visible {
        eprintln!("  building the bench for this machine");
    }
    let bench = callgrind::Bench::build().inspect_err(|missing| eprintln!("aeroshell: {missing}"));
    let bar = Bar::new(visible, flights.len());
    let counted = bench.map(|bench| bench.measure(flights, interrupt::asked(), &bar)).ok().transpose()?;
    let timed = host::measure(flights, interrupt::asked(), &bar)?;
    let wall = Report::new("host", host::GRANULARITY, Budgets::None, &timed);
    Ok(match counted {
        None => wall,
        Some(counted) => Report {
            wall_time: Some(WallTime { unit: wall.unit, rows: wall.rows }),
            ..Report::new("host", callgrind::GRANULARITY, Budgets::None, &counted)
        },
    })
}

/// What the counter of a board on a serial line counts.
fn on_board(args: &WcetArgs, line: &str, flights: &[HardFlight], visible: bool) -> Result<Report, HostError> {
    let opening = Opening { image: None, interrupt: interrupt::asked(), say: &|_| {} };
    let board = opening.serial(line)?;
    let bar = Bar::new(visible, flights.len());
    let place = args.target.to_string();
    let flown = line::Line::new(board.end, &place, interrupt::asked()).measure(flights, &bar)?;
    Ok(Report::new(&place, line::granularity(args.unit), line::budgets(args.unit), &flown))
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
    interrupt::asked().store(false, Ordering::Relaxed);
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
