//! [`Board`]: the flight computer on its hardware, reached through `embedded-io` and `embedded-hal` only.
//!
//! One [`Board::step`] waits for bytes, flies the frames they close, sends the answer and drives the discretes. The loop
//! around it, the clock and the reset are the firmware's.

use core::fmt;

use embedded_hal::digital::OutputPin;
use embedded_io::{Read, Write};

use super::computer::FlightComputer;
use super::cost::Probe;
use crate::link::discretes::{DiscreteError, Discretes};
use crate::link::port::{Port, PortError};

/// Bytes taken from the stream at a time; a whole inertial frame fits.
const READ_BYTES: usize = 64;

/// What went wrong in a step. The flight goes on: the caller counts, reports and steps again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BoardError {
    /// The byte stream.
    Port(PortError),
    /// An output line.
    Discrete(DiscreteError),
}

impl fmt::Display for BoardError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port(error) => error.fmt(f),
            Self::Discrete(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for BoardError {}

/// Flight computer, link and output lines.
#[derive(Clone, Debug)]
pub struct Board<S, A, F, W> {
    port: Port<S>,
    discretes: Discretes<A, F, W>,
    computer: FlightComputer,
}

impl<S: Read + Write, A: OutputPin, F: OutputPin, W: OutputPin> Board<S, A, F, W> {
    /// A computer in `Standby` on its hardware.
    #[must_use]
    pub fn new(stream: S, discretes: Discretes<A, F, W>, build_id: u64) -> Self {
        Self { port: Port::new(stream), discretes, computer: FlightComputer::new(build_id) }
    }

    /// The computer, for snapshots and for entering measured cost.
    pub const fn computer_mut(&mut self) -> &mut FlightComputer {
        &mut self.computer
    }

    /// Waits for bytes and does all that follows from them. The watchdog is kicked once for each step that closed a
    /// minor frame.
    ///
    /// # Errors
    /// The first failure of stream or lines; everything else of the step has been done.
    pub fn step(&mut self, probe: &mut impl Probe) -> Result<(), BoardError> {
        let mut buffer = [0; READ_BYTES];
        let bytes = self.port.receive(&mut buffer).map_err(BoardError::Port)?;
        let frame_before = self.computer.executive().frame();
        let mut sent = Ok(());
        let port = &mut self.port;
        self.computer.receive_probed(bytes, probe, |frame| sent = sent.and(port.send(frame)));
        let driven = match self.computer.actuator() {
            Some(actuator) if self.computer.executive().frame() != frame_before => {
                let driven = self.discretes.apply(actuator);
                driven.and(self.discretes.kick_watchdog())
            }
            _ => Ok(()),
        };
        sent.map_err(BoardError::Port).and(driven.map_err(BoardError::Discrete))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::executive::NoProbe;
    use crate::link::framing::MAX_FRAME;
    use crate::link::packet::RejectCounters;
    use crate::link::packet::{Actuator, Command, Downlink, Hello, Imu, Uplink};
    use crate::link::receiver::{Receiver, Sender};
    use crate::time::MissionTime;
    use embedded_hal::digital::{ErrorKind, ErrorType, PinState};
    use std::cell::{Cell, RefCell};
    use std::collections::VecDeque;
    use std::rc::Rc;
    use std::vec::Vec;

    /// A serial line: what the ground wrote comes out in small pieces, what the board writes is kept.
    #[derive(Default)]
    struct Line {
        inbound: VecDeque<u8>,
        outbound: Vec<u8>,
    }

    impl embedded_io::ErrorType for Line {
        type Error = embedded_io::ErrorKind;
    }

    impl Read for Line {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
            let count = buffer.len().min(7).min(self.inbound.len());
            for slot in buffer.iter_mut().take(count) {
                *slot = self.inbound.pop_front().unwrap();
            }
            Ok(count)
        }
    }

    impl Write for Line {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
            self.outbound.extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> Result<(), Self::Error> {
            Ok(())
        }
    }

    /// An output line that remembers every level it was driven to, or fails.
    #[derive(Clone, Default)]
    struct Pin {
        levels: Rc<RefCell<Vec<bool>>>,
        broken: Rc<Cell<bool>>,
    }

    #[derive(Debug)]
    struct Broken;

    impl embedded_hal::digital::Error for Broken {
        fn kind(&self) -> ErrorKind {
            ErrorKind::Other
        }
    }

    impl ErrorType for Pin {
        type Error = Broken;
    }

    impl OutputPin for Pin {
        fn set_low(&mut self) -> Result<(), Broken> {
            self.set_state(PinState::Low)
        }

        fn set_high(&mut self) -> Result<(), Broken> {
            self.set_state(PinState::High)
        }

        fn set_state(&mut self, state: PinState) -> Result<(), Broken> {
            self.levels.borrow_mut().push(state == PinState::High);
            if self.broken.get() { Err(Broken) } else { Ok(()) }
        }
    }

    fn script(packets: &[(u32, Uplink)]) -> VecDeque<u8> {
        let (mut sender, mut out, mut bytes) = (Sender::new(), [0; MAX_FRAME], VecDeque::new());
        for (frame, packet) in packets {
            bytes.extend(sender.encode(MissionTime::of_frame(*frame), packet.clone(), &mut out).unwrap());
        }
        bytes
    }

    fn flight(frames: u32) -> Vec<(u32, Uplink)> {
        let mut packets = std::vec![
            (0, Uplink::Hello(Hello::ours(1))),
            (0, Uplink::Command(Command::Arm { digest: Config::DEFAULT.digest() })),
            (0, Uplink::Command(Command::Go)),
        ];
        packets.extend((1..=frames).map(|frame| (frame, Uplink::Imu(Imu::default()))));
        packets
    }

    fn run(board: &mut Board<Line, Pin, Pin, Pin>) -> Vec<BoardError> {
        let mut errors = Vec::new();
        loop {
            match board.step(&mut NoProbe) {
                Err(BoardError::Port(PortError::Closed)) => return errors,
                Err(error) => errors.push(error),
                Ok(()) => {}
            }
        }
    }

    fn actuators(bytes: &[u8]) -> Vec<Actuator> {
        let (mut receiver, mut counters) = (Receiver::<Downlink>::new(), RejectCounters::default());
        let packets = bytes.iter().filter_map(|b| receiver.push(*b, &mut counters));
        packets.filter_map(|f| if let Downlink::Actuator(a) = f.packet { Some(a) } else { None }).collect()
    }

    #[test]
    fn a_board_flies_the_frames_it_reads_and_kicks_the_watchdog_for_each() {
        let line = Line { inbound: script(&flight(40)), outbound: Vec::new() };
        let (arm, fire, watchdog) = (Pin::default(), Pin::default(), Pin::default());
        let lines = Discretes::new(arm.clone(), fire.clone(), watchdog.clone()).unwrap();
        let mut board = Board::new(line, lines, 7);
        assert!(run(&mut board).is_empty());
        let frames: Vec<u32> = actuators(&board.port.stream_mut().outbound).iter().map(|a| a.frame).collect();
        assert_eq!(frames, (1..=40).collect::<Vec<_>>());
        // Low at the start, then one edge a frame.
        assert_eq!(watchdog.levels.borrow().len(), 41);
        assert!(!fire.levels.borrow().contains(&true) && !arm.levels.borrow().contains(&true));
    }

    #[test]
    fn a_broken_line_is_told_and_the_flight_goes_on() {
        let line = Line { inbound: script(&flight(10)), outbound: Vec::new() };
        let watchdog = Pin::default();
        let lines = Discretes::new(Pin::default(), Pin::default(), watchdog.clone()).unwrap();
        let mut board = Board::new(line, lines, 7);
        watchdog.broken.set(true);
        let errors = run(&mut board);
        assert_eq!(errors, [BoardError::Discrete(DiscreteError::Watchdog(ErrorKind::Other)); 10]);
        assert_eq!(board.computer_mut().executive().frame(), 10);
    }
}
