//! The hard flights in this process, by the wall clock: nanoseconds, and whatever else the machine does among them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use fsw_core::executive::FlightComputer;
use fsw_core::link::framing::DELIMITER;
use fsw_core::link::packet::{Downlink, Mode};
use fsw_core::probe::{FrameMeter, Meter};

use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::{FlightCost, FrameCost};
use super::table::Flown;
use super::target::flown;
use super::uplink::record;
use crate::ends::{BUILD_ID, Nanoseconds};
use crate::error::HostError;
use crate::tap::{Heard, Tap};
use crate::target::TargetError;

/// What the figures are, in words.
pub const GRANULARITY: &str = "nanoseconds of wall time in this process, not instructions: what else the machine does is \
     in the maxima, and no budget applies";

/// Measures flights in this process.
///
/// # Errors
/// A flight cannot be flown, or the user has had enough.
pub fn measure(flights: &[HardFlight], interrupt: &AtomicBool, bar: &Bar) -> Result<Vec<Flown>, HostError> {
    let mut all = Vec::with_capacity(flights.len());
    for flight in flights {
        if interrupt.load(Ordering::Relaxed) {
            return Err(TargetError::Interrupted.into());
        }
        bar.at(all.len(), &flight.name);
        let log = record(flight)?.log;
        all.push(flown(flight, replay(&log, &mut FrameMeter::new(Nanoseconds(Instant::now()))))?);
    }
    Ok(all)
}

/// Flies a log as a board does, one received packet after the other.
pub fn replay(log: &[u8], meter: &mut impl Meter) -> FlightCost {
    let (mut computer, mut cost) = (Box::new(FlightComputer::new(BUILD_ID)), FlightCost::default());
    let (mut tap, mut answer) = (Tap::<Downlink>::default(), Vec::new());
    for packet in log.split_inclusive(|byte| *byte == DELIMITER) {
        answer.clear();
        meter.resume();
        computer.receive_probed(packet, meter, |bytes| answer.extend_from_slice(bytes));
        meter.pause();
        if computer.executive().mode() == Mode::Standby {
            meter.discard();
        }
        tap.feed(&answer, |_, heard| {
            if let Heard::Packet(frame) = heard {
                cost.hear(&frame.packet);
            }
        });
        if let Some(measured) = meter.take() {
            cost.enter(FrameCost::measured(computer.executive().frame(), &measured));
        }
    }
    cost
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::probe::Counter;

    #[test]
    fn a_flight_of_which_no_frame_was_measured_is_an_error() {
        let flight = HardFlight::new("short", "msl", &[]).unwrap();
        let error = flown(&flight, FlightCost::default()).unwrap_err().to_string();
        assert!(error.contains("\"short\" reported its cost; the image was built from other sources"), "{error}");
    }

    /// Counts one at every reading.
    struct Readings(u32);

    impl Counter for Readings {
        fn restart(&mut self) {
            self.0 = 0;
        }

        fn read(&mut self) -> u32 {
            self.0 += 1;
            self.0
        }
    }

    #[test]
    fn every_frame_of_a_replayed_flight_has_its_cost() {
        let flight = HardFlight::new("short", "msl", &["time_limit_s=3"]).unwrap();
        let cost = replay(&record(&flight).unwrap().log, &mut FrameMeter::new(Readings(0)));
        assert!(cost.frames.len() > 140);
        assert!((1u32..).zip(&cost.frames).all(|(index, frame)| frame.frame == index && frame.whole > 10));
        assert!(cost.cycles.is_empty() || cost.cycles[0].cost > 0);
    }
}
