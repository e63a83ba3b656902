//! The undispersed flights: what guidance had to work, and how long that took.

use std::time::Instant;

use fsw_core::probe::{Kernel, MeasuredCost, SlotId};
use hil_sim::scenario::Scenario;
use serde::Serialize;

use super::Mode;
use crate::ends::{ComputerEnd, ComputerError, LocalComputer};
use crate::error::HostError;
use crate::fly::fly_watched;
use crate::pump::Unwatched;
use crate::record::FlightRecord;
use crate::recorder::FlightId;

/// Flights of each mode for its wall time: the least disturbed one counts.
pub const TIMED_FLIGHTS: u32 = 5;

/// One undispersed flight.
#[derive(Clone, Debug, Serialize)]
pub struct Nominal {
    /// How it ended.
    pub outcome: String,
    /// Miss, m.
    pub miss_m: Option<f64>,
    /// Its part along the arc, m, positive beyond the target.
    pub downrange_error_m: Option<f64>,
    /// Its part across the arc, m, positive to the right.
    pub crossrange_error_m: Option<f64>,
    /// Altitude at deployment, m.
    pub deploy_altitude_m: Option<f64>,
    /// Bank reversals commanded.
    pub reversals: u32,
    /// Guidance cycles that predicted.
    pub cycles: u32,
    /// Predictor calls of the flight.
    pub predictions: u32,
    /// Evaluations of the equations of motion in the flight.
    pub evaluations: u32,
    /// Wall time that guidance took in the flight, s: each frame in the quickest of the timed flights, which do the same
    /// work in it, so that what else the machine does hardly shows.
    pub guidance_wall_s: f64,
    /// Of that the predictor, s, found in the same way.
    pub predictor_wall_s: f64,
    /// The flight.
    #[serde(skip)]
    pub record: FlightRecord,
}

impl Nominal {
    /// Mean evaluations of a cycle that predicted.
    #[must_use]
    pub fn evaluations_per_cycle(&self) -> Option<f64> {
        (self.cycles > 0).then(|| f64::from(self.evaluations) / f64::from(self.cycles))
    }

    /// True planet-relative speed at a time, m/s.
    #[must_use]
    pub fn speed_at_mps(&self, time_s: f64) -> f64 {
        let truth = &self.record.truth;
        let at = truth.partition_point(|sample| sample.time_s < time_s);
        truth.get(at).map_or(f64::NAN, |sample| sample.speed_mps)
    }
}

/// Flies every mode undispersed, several times in turn so that what disturbs the machine disturbs all of them.
///
/// # Errors
/// A scenario cannot be flown.
pub fn fly(scenarios: &[(Mode, Scenario)], seed: u64) -> Result<Vec<Nominal>, HostError> {
    let mut flown = Vec::with_capacity(scenarios.len());
    for (_, scenario) in scenarios {
        flown.push(once(scenario, seed)?);
    }
    for _ in 1..TIMED_FLIGHTS {
        for ((_, quickest), (_, scenario)) in flown.iter_mut().zip(scenarios) {
            let (_, again) = once(scenario, seed)?;
            for (quickest, again) in quickest.iter_mut().zip(again) {
                *quickest = [0, 1].map(|which| quickest[which].min(again[which]));
            }
        }
    }
    let timed = |(nominal, frames): (Nominal, Vec<FrameTime>)| {
        let [guidance_wall_s, predictor_wall_s] =
            [0, 1].map(|which: usize| frames.iter().map(|ns| f64::from(ns[which])).sum::<f64>() * 1e-9);
        Nominal { guidance_wall_s, predictor_wall_s, ..nominal }
    };
    Ok(flown.into_iter().map(timed).collect())
}

/// One flight and the time of each of its frames.
fn once(scenario: &Scenario, seed: u64) -> Result<(Nominal, Vec<FrameTime>), HostError> {
    let mut computer = Timed::default();
    let id = FlightId { seed, run: 0, nominal: true };
    let record = fly_watched(scenario, id, &mut computer, &mut Unwatched)?;
    let sum = |of: fn(&fsw_core::link::packet::GuidanceTlm) -> u32| record.guidance.iter().map(|(_, g)| of(g)).sum();
    let nominal = Nominal {
        outcome: record.summary.outcome.clone(),
        miss_m: record.summary.miss_m,
        downrange_error_m: record.summary.downrange_error_m,
        crossrange_error_m: record.summary.crossrange_error_m,
        deploy_altitude_m: record.summary.deploy.map(|deploy| deploy.altitude_m),
        reversals: record.summary.reversals,
        cycles: sum(|g| u32::from(g.predictions > 0)),
        predictions: sum(|g| u32::from(g.predictions)),
        evaluations: sum(|g| u32::from(g.evaluations)),
        guidance_wall_s: 0.0,
        predictor_wall_s: 0.0,
        record,
    };
    Ok((nominal, computer.frames))
}

/// Nanoseconds of a frame in the guidance slot, and of that in the predictor.
type FrameTime = [u32; 2];

/// A flight computer in this process whose guidance slot is timed in every frame.
#[derive(Default)]
struct Timed {
    computer: LocalComputer,
    frames: Vec<FrameTime>,
}

impl ComputerEnd for Timed {
    fn exchange(
        &mut self,
        to_computer: &[u8],
        from_computer: &mut Vec<u8>,
        until: Option<Instant>,
    ) -> Result<(), ComputerError> {
        self.computer.exchange(to_computer, from_computer, until)
    }

    fn take_cost(&mut self) -> Option<MeasuredCost> {
        let cost = self.computer.take_cost();
        if let Some(MeasuredCost { slots, kernels, .. }) = &cost {
            let ns = |of: &[u32], at: usize| of.get(at).copied().unwrap_or(0);
            self.frames.push([ns(slots, SlotId::Guidance as usize), ns(kernels, Kernel::Predictor as usize)]);
        }
        cost
    }
}
