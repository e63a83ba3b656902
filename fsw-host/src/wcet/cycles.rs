//! The same flights with an estimate of cycles: the emulator counts executed blocks, and each block has its cycles.

use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

use fsw_core::time::{FRAME, FRAMES_PER_SECOND};

use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::FlightCost;
use super::report::Report;
use super::table::{FRAME_CYCLES, Flown, Row};
use super::target::flown;
use super::uplink::record;
use crate::cycles::{CycleReport, Estimator, tools};
use crate::error::HostError;
use crate::target::Target;
use crate::target::bench::Bench;

/// Frames that are none of the flight: what went before the first one is in it.
const SET_UP_FRAMES: usize = 1;
/// Functions shown of the worst frame.
const FUNCTIONS: usize = 15;

/// The estimate over a set of flights.
pub struct Estimate {
    /// The flight with the worst frame, and its report.
    worst: Option<(String, CycleReport)>,
    /// Cycles of every measured frame.
    frames: Vec<u64>,
}

/// Measures flights as [`super::target::measure`] does, and estimates their cycles.
///
/// # Errors
/// A flight cannot be flown, the target fails, or a tool of the estimate is missing.
pub fn measure(bench: &Bench<'_>, flights: &[HardFlight], bar: &Bar) -> Result<(Vec<Flown>, Estimate), HostError> {
    if bench.target != Target::M7 {
        return Err(HostError::Option("--cycles is for --target m7: the models are of the Cortex-M7".into()));
    }
    let refused = |e: crate::cycles::CycleError| HostError::Option(e.to_string());
    tools::check_qemu(bench.target.emulator()).map_err(refused)?;
    let (estimator, plugin) = (Estimator::new(&bench.image.path).map_err(refused)?, tools::plugin().map_err(refused)?);
    let (mut all, mut estimate) = (Vec::new(), Estimate { worst: None, frames: Vec::new() });
    for flight in flights {
        bar.at(all.len(), &flight.name);
        let counts = Counts::new();
        let argument = estimator.plugin_argument(&plugin, &counts.0);
        let counted = Bench { plugin: Some(&argument), ..*bench };
        let answers = counted.run(&[record(flight)?.log])?;
        for answer in &answers {
            all.push(flown(flight, FlightCost::of_answer(answer))?);
        }
        estimate.take(&flight.name, estimator.report_after(&counts.0, SET_UP_FRAMES).map_err(refused)?);
    }
    Ok((all, estimate))
}

impl Estimate {
    fn take(&mut self, name: &str, report: CycleReport) {
        self.frames.extend(report.frames.iter().map(|frame| frame.cycles));
        if self.worst.as_ref().is_none_or(|(_, worst)| report.worst().cycles > worst.worst().cycles) {
            self.worst = Some((name.to_owned(), report));
        }
    }

    /// Puts the estimate into a report.
    pub fn enter(mut self, report: &mut Report) {
        let Some((flight, worst)) = self.worst.as_ref().filter(|_| !self.frames.is_empty()) else { return };
        let middle = self.frames.len() / 2;
        let median = *self.frames.select_nth_unstable(middle).1 as f64;
        let (maximum, budget) = (worst.worst().cycles as f64, f64::from(FRAME_CYCLES));
        let frame = worst.worst_frame.unwrap_or_default();
        report.metrics.insert("worst_frame_cycles".into(), maximum);
        report.rows.push(Row {
            name: "whole frame, est. cycles".into(),
            count: self.frames.len(),
            median,
            maximum,
            budget: Some(budget),
            margin: Some(1.0 - maximum / budget),
            flight: flight.clone(),
            // Measured frames follow each other; where some were bridged this is early by them.
            time_s: (frame + SET_UP_FRAMES + 1) as f64 * FRAME.as_s(),
        });
        let load = maximum / (100e6 / f64::from(FRAMES_PER_SECOND));
        let text = worst.text(FUNCTIONS);
        report.cycles = Some(format!(
            "Estimated cycles, flight \"{flight}\" (its worst frame fills {:.1} % of 20 ms at 100 MHz)\n{text}",
            100.0 * load
        ));
    }
}

/// A file for the counts, removed in the end.
struct Counts(PathBuf);

impl Counts {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("aeroshell-wcet-{}-{number}.counts", std::process::id())))
    }
}

impl Drop for Counts {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
