//! `wcet --navigation`: what each navigation algorithm costs on a processor, all in one table.

use std::fmt::Write as _;
use std::path::Path;

use clap::ValueEnum;
use fsw_core::executive::schedule::{FRAME_BUDGET, navigation_allowance};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::nav::filter::FRAMES_PER_EPOCH;
use fsw_core::probe::SlotId;
use fsw_core::time::FRAMES_PER_SECOND;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::args::WcetArgs;
use super::bar::Bar;
use super::flights::{HardFlight, NO_BLACKOUT, SOURCES, everything_at_once};
use super::ledger::{FlightCost, FrameCost};
use super::report::keep;
use super::target::flown;
use super::uplink::record;
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::target::bench::Bench;

/// Frames of the window of an epoch.
const PHASES: usize = FRAMES_PER_EPOCH as usize;
/// Logs of one boot.
const LOGS_PER_BOOT: usize = 6;
/// The figures in an output folder.
const JSON_FILE: &str = "wcet-navigation.json";
/// The table there.
const TEXT_FILE: &str = "wcet-navigation.txt";

/// How much is flown in each mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Extent {
    /// Two windows of ten seconds in dense air, with every source of readings in view.
    Short,
    /// Three whole flights.
    Long,
}

/// What a navigation mode costs, instructions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeCost {
    /// Its name.
    pub filter: String,
    /// The worst minor frame, everything in it.
    pub worst_frame: u32,
    /// What a frame may cost in this mode.
    pub frame_budget: u32,
    /// The slot `navigation`: mean of a second.
    pub navigation_per_second: u32,
    /// The worst slot `navigation` in each frame of the window of an epoch, the dearest frame first.
    pub worst_navigation: [u32; PHASES],
    /// The flight with the worst frame.
    pub flight: String,
    /// When it was, s.
    pub time_s: f64,
}

impl ModeCost {
    /// True when a minor frame was beyond its budget.
    #[must_use]
    pub const fn is_over(&self) -> bool {
        self.worst_frame > self.frame_budget
    }

    fn of(mode: NavigationMode, flights: &[(String, FlightCost)]) -> Self {
        let frames = || flights.iter().flat_map(|(name, cost)| cost.frames.iter().map(move |frame| (name, frame)));
        let navigation = |frame: &FrameCost| frame.slots[SlotId::Navigation as usize];
        let worst = frames().rev().max_by_key(|(_, frame)| frame.whole);
        let mut worst_navigation = [0; PHASES];
        for (_, cost) in flights {
            let mut of_flight = [0; PHASES];
            for frame in &cost.frames {
                let phase = &mut of_flight[frame.frame as usize % PHASES];
                *phase = navigation(frame).max(*phase);
            }
            // Windows begin with the frame in which the flight software was armed: another one in each flight.
            of_flight.sort_unstable_by(|a, b| b.cmp(a));
            worst_navigation.iter_mut().zip(of_flight).for_each(|(worst, of)| *worst = of.max(*worst));
        }
        let sum: u64 = frames().map(|(_, frame)| u64::from(navigation(frame))).sum();
        let per_second = sum * u64::from(FRAMES_PER_SECOND) / (frames().count().max(1) as u64);
        Self {
            filter: mode.name().to_owned(),
            worst_frame: worst.map_or(0, |(_, frame)| frame.whole),
            frame_budget: FRAME_BUDGET + navigation_allowance(mode),
            navigation_per_second: u32::try_from(per_second).unwrap_or(u32::MAX),
            worst_navigation,
            flight: worst.map_or_else(String::new, |(name, _)| name.clone()),
            time_s: worst.map_or(0.0, |(_, frame)| frame.time_s()),
        }
    }
}

/// What `--json` prints.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NavigationReport {
    /// `m7` or `rv64`.
    pub target: String,
    /// What a figure is, in words.
    pub unit: String,
    /// By mode, in the order of the command line.
    pub modes: Vec<ModeCost>,
}

/// Flights on which the modes are compared: every reading that can come, comes.
fn flights(extent: Extent, mode: NavigationMode) -> Result<Vec<HardFlight>, HostError> {
    let filter = format!("navigation.filter={}", mode.name());
    let every = ["sensors.pressure.min_dynamic_pressure_pa=0", SOURCES, NO_BLACKOUT, &filter];
    let all = everything_at_once();
    let hard: Vec<&str> = every.into_iter().chain(all.iter().map(String::as_str)).collect();
    let window = |sets: &[&str]| -> Vec<String> {
        let low =
            ["entry.altitude_km=40.0", "entry.longitude_deg=-79.0", "entry.latitude_deg=-42.4", "time_limit_s=10"];
        sets.iter().chain(&low).map(|set| (*set).to_owned()).collect()
    };
    let of = |name: &str, sets: &[String]| -> Result<HardFlight, HostError> {
        let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
        HardFlight::new(name, "msl", &sets)
    };
    let owned = |sets: &[&str]| sets.iter().map(|set| (*set).to_owned()).collect::<Vec<_>>();
    Ok(match extent {
        Extent::Short => {
            vec![of("every source", &window(&every))?, of("everything at once", &window(&hard))?.dispersed(7)]
        }
        Extent::Long => vec![
            of("seed 1", &owned(&[&filter]))?.dispersed(1),
            of("every source", &owned(&every))?,
            of("everything at once", &owned(&hard))?.dispersed(7),
        ],
    })
}

/// Measures the modes on an emulated processor.
///
/// # Errors
/// A flight cannot be flown, or the target fails.
pub fn measure(
    bench: &Bench<'_>,
    extent: Extent,
    modes: &[NavigationMode],
    bar: &Bar,
) -> Result<Vec<ModeCost>, HostError> {
    let planned =
        modes.iter().map(|mode| Ok((*mode, flights(extent, *mode)?))).collect::<Result<Vec<_>, HostError>>()?;
    let planned: Vec<(NavigationMode, HardFlight)> =
        planned.into_iter().flat_map(|(mode, flights)| flights.into_iter().map(move |flight| (mode, flight))).collect();
    let mut measured: Vec<(NavigationMode, (String, FlightCost))> = Vec::with_capacity(planned.len());
    for batch in planned.chunks(LOGS_PER_BOOT) {
        bar.at(measured.len(), batch.first().map_or("", |(mode, _)| mode.name()));
        let logs = batch.par_iter().map(|(_, flight)| record(flight).map(|recording| recording.log));
        let logs = logs.collect::<Result<Vec<_>, _>>()?;
        for ((mode, flight), answer) in batch.iter().zip(bench.run(&logs)?) {
            let flown = flown(flight, FlightCost::of_answer(&answer))?;
            measured.push((*mode, (flown.name, flown.cost)));
        }
    }
    let of = |mode: NavigationMode| -> Vec<(String, FlightCost)> {
        measured.iter().filter(|(of, _)| *of == mode).map(|(_, flown)| flown.clone()).collect()
    };
    Ok(modes.iter().map(|mode| ModeCost::of(*mode, &of(*mode))).collect())
}

/// Steps of the progress bar.
#[must_use]
pub const fn logs(extent: Extent, modes: usize) -> usize {
    modes
        * match extent {
            Extent::Short => 2,
            Extent::Long => 3,
        }
}

/// Shows the report where it was asked for and keeps it in the output folder.
///
/// # Errors
/// The output folder, or a closed standard output.
pub fn publish(args: &WcetArgs, report: &NavigationReport) -> Result<(), HostError> {
    let text = text(report);
    if let Some(folder) = &args.out {
        keep(Path::new(folder), TEXT_FILE, &text)?;
        keep(Path::new(folder), JSON_FILE, &serde_json::to_string_pretty(report).unwrap_or_default())?;
    }
    if args.json {
        print_json(report)?;
    } else if !args.quiet {
        print(&text)?;
    }
    for mode in report.modes.iter().filter(|mode| mode.is_over()) {
        let ModeCost { filter, worst_frame, frame_budget, flight, time_s, .. } = mode;
        eprintln!(
            "aeroshell: {filter}: a frame of {worst_frame} is above the budget of {frame_budget} in {flight}, {time_s:.2} s"
        );
    }
    Ok(())
}

fn text(report: &NavigationReport) -> String {
    let mut text = format!("Execution cost of navigation on {}\n{}\n\n", report.target, report.unit);
    // Writing into a string cannot fail.
    let _ = writeln!(
        text,
        "{:<16} {:>11} {:>8} {:>12}   {:<38}  worst frame in",
        "filter", "worst frame", "budget", "navigation/s", "worst navigation by frame of a window"
    );
    for mode in &report.modes {
        let by_phase: Vec<_> = mode.worst_navigation.iter().map(|cost| format!("{cost:>7}")).collect();
        let _ = writeln!(
            text,
            "{:<16} {:>11} {:>8} {:>12}   {:<38}  {}, {:.2} s",
            mode.filter,
            mode.worst_frame,
            mode.frame_budget,
            mode.navigation_per_second,
            by_phase.join(" "),
            mode.flight,
            mode.time_s
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(index: u32, navigation: u32) -> FrameCost {
        let mut frame = FrameCost { frame: index, whole: 2 * navigation, ..FrameCost::default() };
        frame.slots[SlotId::Navigation as usize] = navigation;
        frame
    }

    #[test]
    fn a_mode_is_told_by_its_worst_frame_its_mean_and_its_frames_of_a_window() {
        let mut cost = FlightCost::default();
        [10, 20, 30, 40, 50, 60, 20, 30, 40, 51_000]
            .iter()
            .zip(1..)
            .for_each(|(c, index)| cost.enter(frame(index, *c)));
        let told = ModeCost::of(NavigationMode::Ekf, &[("a".to_owned(), cost)]);
        assert_eq!((told.worst_frame, told.flight.as_str(), told.time_s), (102_000, "a", 0.2));
        assert_eq!(told.worst_navigation, [51_000, 60, 40, 30, 20]);
        assert_eq!(told.navigation_per_second, 51_300 * 5);
        assert!(told.is_over());
        let wide = ModeCost { frame_budget: FRAME_BUDGET + navigation_allowance(NavigationMode::Imm), ..told };
        assert!(!wide.is_over());
    }

    #[test]
    fn every_mode_has_flights_of_both_extents() {
        for extent in [Extent::Short, Extent::Long] {
            for mode in NavigationMode::ALL {
                let flights = flights(extent, *mode).unwrap();
                assert_eq!(flights.len(), logs(extent, 1));
                assert!(flights.iter().all(|flight| flight.scenario.navigation.filter == *mode));
            }
        }
    }
}
