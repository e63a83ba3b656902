//! What goes up the link in a flight, kept so that a target can fly it again and report what each frame cost.

use std::io;

use fsw_core::link::framing::MAX_FRAME;
use fsw_core::link::packet::{Command, Hello, Uplink};
use fsw_core::link::receiver::Sender;
use fsw_core::time::MissionTime;

use super::flights::HardFlight;
use crate::ends::{BUILD_ID, LocalComputer};
use crate::error::HostError;
use crate::fly::fly_watched;
use crate::linklog::Direction;
use crate::pump::Watch;
use crate::record::End;

/// A flight as a target flies it again.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Everything that went to the flight computer, asked to report its cost.
    pub log: Vec<u8>,
    /// How the flight ended.
    pub end: End,
}

/// Flies in this process and keeps what went up.
///
/// # Errors
/// The scenario cannot be flown.
pub fn record(flight: &HardFlight) -> Result<Recording, HostError> {
    let mut keeper = Keeper(greeting_and(Command::ReportCost { on: true }));
    let record = fly_watched(&flight.scenario, flight.id, &mut LocalComputer::default(), &mut keeper)?;
    if let End::Failed(reason) = &record.end {
        return Err(HostError::Option(format!("the flight \"{}\" failed: {reason}", flight.name)));
    }
    Ok(Recording { log: keeper.0, end: record.end })
}

/// A greeting and a command, numbered from zero. A log that follows begins with a greeting of its own, which begins the
/// numbering anew, so that nothing in it has to be numbered again.
pub(super) fn greeting_and(command: Command) -> Vec<u8> {
    let (mut sender, mut room) = (Sender::new(), [0; MAX_FRAME]);
    let packets = [Uplink::Hello(Hello::ours(BUILD_ID)), Uplink::Command(command)];
    // Every packet fits its own maximum size.
    let mut bytes = |packet| sender.encode(MissionTime::ZERO, &packet, &mut room).unwrap_or_default().to_vec();
    packets.into_iter().flat_map(&mut bytes).collect()
}

struct Keeper(Vec<u8>);

impl Watch for Keeper {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        if direction == Direction::Up {
            self.0.extend_from_slice(bytes);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tap::{Heard, Tap};
    use fsw_core::executive::FlightComputer;
    use fsw_core::link::packet::Downlink;

    fn short_flight() -> HardFlight {
        HardFlight::new("short", "msl", &["time_limit_s=3"]).unwrap()
    }

    fn heard(bytes: &[u8]) -> Vec<Downlink> {
        let mut packets = Vec::new();
        Tap::<Downlink>::default().feed(bytes, |_, heard| {
            if let Heard::Packet(frame) = heard {
                packets.push(frame.packet);
            }
        });
        packets
    }

    #[test]
    fn a_log_begins_with_the_request_and_is_flown_to_its_end_by_a_fresh_computer() {
        let recording = record(&short_flight()).unwrap();
        assert_eq!(recording.end, End::TimeLimit);
        let (mut computer, mut answer) = (Box::new(FlightComputer::new(1)), Vec::new());
        computer.receive(&recording.log, |bytes| answer.extend_from_slice(bytes));
        let packets = heard(&answer);
        assert!(packets.iter().filter(|packet| matches!(packet, Downlink::Actuator(_))).count() > 140);
        assert_eq!(computer.executive().rejects.lost, 0, "the numbering has no gap");
        // What was asked for is done when a board enters a cost.
        let mut report = Vec::new();
        computer.report_cost(|bytes| report.extend_from_slice(bytes));
        assert!(matches!(heard(&report)[..], [Downlink::CostTlm(_)]));
    }
}
