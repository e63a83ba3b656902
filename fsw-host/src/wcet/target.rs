//! The hard flights on an emulated processor: flown in this process, replayed there.

use std::sync::atomic::AtomicBool;

use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::FlightCost;
use super::table::Flown;
use super::uplink::record;
use crate::error::HostError;
use crate::target::bench::{Bench, PATIENCE};
use crate::target::{Image, Target};

/// Flights of one boot: few enough that the bar moves.
const FLIGHTS_PER_BOOT: usize = 4;

/// Measures flights on a target.
///
/// # Errors
/// A flight cannot be flown, or the target fails.
pub fn measure(
    target: Target,
    image: &Image,
    flights: &[HardFlight],
    interrupt: &AtomicBool,
    bar: &Bar,
) -> Result<Vec<Flown>, HostError> {
    let bench = Bench { target, image, plugin: None, interrupt, patience: PATIENCE };
    let mut flown = Vec::with_capacity(flights.len());
    for batch in flights.chunks(FLIGHTS_PER_BOOT) {
        let names: Vec<_> = batch.iter().map(|flight| flight.name.as_str()).collect();
        bar.at(flown.len(), &names.join(", "));
        let logs = batch.iter().map(|flight| record(flight).map(|recording| recording.log));
        let logs = logs.collect::<Result<Vec<_>, _>>()?;
        let costs = bench.run(&logs)?.into_iter().map(|answer| FlightCost::of_answer(&answer));
        flown.extend(batch.iter().zip(costs).map(|(flight, cost)| {
            let HardFlight { name, default_model, .. } = flight;
            Flown { name: name.clone(), default_model: *default_model, cost }
        }));
    }
    Ok(flown)
}

/// What the figures of a target are, in words.
#[must_use]
pub fn granularity(target: Target) -> &'static str {
    match target {
        Target::M7 => {
            "instructions, not cycles: executed under -icount and read from SysTick, which counts every 40th, so that \
             each figure is within 40 of the true one"
        }
        Target::Rv64 => "instructions, not cycles: executed under -icount and read from minstret, exact",
    }
}
