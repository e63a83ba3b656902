//! The hard flights on an emulated processor: flown in this process, replayed there.

use std::sync::atomic::Ordering;

use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::FlightCost;
use super::search::{self, ROUND, Search};
use super::table::Flown;
use super::uplink::record;
use crate::error::HostError;
use crate::target::bench::Bench;
use crate::target::{Target, TargetError};

/// Flights of one boot: few enough that the bar moves.
const FLIGHTS_PER_BOOT: usize = 4;

/// Measures flights on a target.
///
/// # Errors
/// A flight cannot be flown, or the target fails.
pub fn measure(bench: &Bench<'_>, flights: &[HardFlight], bar: &Bar) -> Result<Vec<Flown>, HostError> {
    let mut all = Vec::with_capacity(flights.len());
    for batch in flights.chunks(FLIGHTS_PER_BOOT) {
        let names: Vec<_> = batch.iter().map(|flight| flight.name.as_str()).collect();
        bar.at(all.len(), &names.join(", "));
        let logs = batch.iter().map(|flight| record(flight).map(|recording| recording.log));
        let logs = logs.collect::<Result<Vec<_>, _>>()?;
        let costs = bench.run(&logs)?.into_iter().map(|answer| FlightCost::of_answer(&answer));
        for (flight, cost) in batch.iter().zip(costs) {
            all.push(flown(flight, cost)?);
        }
    }
    Ok(all)
}

/// What a flight cost, under its name.
///
/// # Errors
/// No frame reported its cost: the flight computer did not fly, as one that was built from other packets does not.
pub fn flown(flight: &HardFlight, cost: FlightCost) -> Result<Flown, HostError> {
    let HardFlight { name, predicts, .. } = flight;
    if cost.frames.is_empty() {
        let cause = "the image was built from other sources than this program: build both anew, or leave --image out";
        return Err(HostError::Option(format!("no frame of the flight \"{name}\" reported its cost; {cause}")));
    }
    Ok(Flown { name: name.clone(), predicts: *predicts, cost })
}

/// Searches for the worst frame on a target, with about `candidates` flights. An interrupt ends it with what it has found.
///
/// # Errors
/// A candidate cannot be flown, or the target fails.
pub fn search(bench: &Bench<'_>, candidates: usize, seed: u64, bar: &Bar) -> Result<Search, HostError> {
    let (mut search, mut tried) = (Search::new(seed), 0);
    while tried < candidates && !bench.interrupt.load(Ordering::Relaxed) {
        let worst = search.worst.map_or(0, |(_, cost)| cost);
        bar.at(tried, &format!("worst frame so far {worst}"));
        let genomes = search.breed(ROUND.min(candidates - tried));
        tried += genomes.len();
        let logs = genomes.iter().map(|genome| Ok(record(&search::flight(genome)?)?.log));
        let logs = logs.collect::<Result<Vec<_>, HostError>>()?;
        let answers = match bench.run(&logs) {
            Err(TargetError::Interrupted) => break,
            answers => answers?,
        };
        let worst = |answer: &Vec<u8>| FlightCost::of_answer(answer).frames.iter().map(|f| f.whole).max().unwrap_or(0);
        let costs: Vec<_> = genomes.into_iter().zip(answers.iter().map(worst)).collect();
        search.learn(&costs);
    }
    Ok(search)
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
