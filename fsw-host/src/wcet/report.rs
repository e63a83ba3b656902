//! What `wcet` prints and keeps: the table, the worst frame of each flight, and the figures for programs.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use fsw_core::executive::schedule::SCHEDULE;
use serde::Serialize;

use super::args::WcetArgs;
use super::ledger::{FrameCost, evenness};
use super::table::{self, Budgets, Flown, Row};
use crate::error::HostError;
use crate::output::{print, print_json};

/// The figures in an output folder.
const JSON_FILE: &str = "wcet.json";
/// The table there.
const TEXT_FILE: &str = "wcet.txt";

/// What `--json` prints.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// `m7`, `rv64`, `host` or `serial:DEVICE:BAUD`.
    pub target: String,
    /// What a figure is, in words.
    pub unit: String,
    /// SHA-256 of the image's memory; none on the host and on a board.
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
    /// Beside the instructions of the host, its wall time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wall_time: Option<WallTime>,
}

/// The table by the wall clock.
#[derive(Clone, Debug, Serialize)]
pub struct WallTime {
    /// What a figure is, in words.
    pub unit: String,
    /// The table.
    pub rows: Vec<Row>,
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

impl Report {
    /// Of flights on a target, in a unit told in words.
    #[must_use]
    pub fn new(target: &str, unit: &str, budgets: Budgets, flown: &[Flown]) -> Self {
        let rows = table::rows(flown, budgets);
        let metrics = table::metrics(flown, &rows, budgets);
        let flights = flown.iter().map(summary).collect();
        let (target, unit) = (target.to_owned(), unit.to_owned());
        Self { target, unit, image_sha256: None, metrics, rows, flights, cycles: None, wall_time: None }
    }
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
///
/// # Errors
/// The output folder, or a closed standard output.
pub fn publish(args: &WcetArgs, report: &Report) -> Result<(), HostError> {
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
    let (count, plural) = (report.flights.len(), if report.flights.len() == 1 { "" } else { "s" });
    let mut text = format!("Execution cost on {}, {count} flight{plural}\n{}\n\n", report.target, report.unit);
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
    if let Some(WallTime { unit, rows }) = &report.wall_time {
        // Writing into a string cannot fail.
        let _ = write!(text, "\n{unit}\n\n{}", table::text(rows));
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

/// Writes a file of an output folder.
///
/// # Errors
/// The folder or the file.
pub fn keep(folder: &Path, name: &str, text: &str) -> Result<(), HostError> {
    std::fs::create_dir_all(folder).map_err(HostError::file("create", folder))?;
    let path = folder.join(name);
    std::fs::write(&path, text).map_err(HostError::file("write", path))
}
