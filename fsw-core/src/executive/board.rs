//! [`Board`]: the flight computer on its hardware, reached through `embedded-io` and `embedded-hal` only.
//!
//! One [`Board::step`] waits for bytes, collects them until they end a frame of the link, flies what they close, sends
//! the answer and drives the discretes. What it costs is measured between the last byte received and the first byte sent.
//!
//! After everything that received frames caused, the board sends one more delimiter for each: an empty frame, which a
//! receiver skips. A peer in lock-step counts them and so knows, without waiting, when nothing more will come.

use core::fmt;

use embedded_hal::digital::OutputPin;
use embedded_io::{ErrorKind, Read, Write};

use super::computer::FlightComputer;
use crate::link::discretes::{DiscreteError, Discretes};
use crate::link::framing::{DELIMITER, MAX_FRAME, glance};
use crate::link::packet::{Mode, Pace, RestartReport};
use crate::link::port::{Port, PortError};
use crate::probe::Meter;
use crate::time::FRAME;

/// Bytes taken from the stream at a time. A line without hardware buffer gives few; of one that brings much at once, most
/// frames lie whole in what is read, and need not be put together.
const READ_BYTES: usize = 256;
/// A stretch of up to so many bytes is looked at before the meter is begun.
const SHORT_STRETCH: usize = 11;
/// Room for the answer to one packet: the packets of a frame with all telemetry and several events. A longer answer is
/// sent piece by piece.
const ANSWER_BYTES: usize = 2_048;
/// A frame without inertial data for so long has to run without it, microseconds: one and a half frames.
const OVERDUE_US: u32 = FRAME.0 + FRAME.0 / 2;
/// The empty frame that ends an answer.
const ACKNOWLEDGE: [u8; 1] = [0];

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

/// A free-running clock of microseconds, wrapping.
pub trait Clock {
    /// Microseconds since some instant.
    fn now_us(&mut self) -> u32;
}

/// Room for the bytes of one exchange; lent to the board, because it is large and need not stand on the stack.
#[derive(Clone, Debug)]
pub struct Room {
    request: [u8; MAX_FRAME + READ_BYTES],
    answer: [u8; ANSWER_BYTES],
}

impl Room {
    /// Empty room.
    #[must_use]
    pub const fn new() -> Self {
        Self { request: [0; MAX_FRAME + READ_BYTES], answer: [0; ANSWER_BYTES] }
    }
}

impl Default for Room {
    fn default() -> Self {
        Self::new()
    }
}

/// Flight computer, link and output lines. The computer is lent: it is large and stays where it was built.
#[derive(Debug)]
pub struct Board<'c, S, A, F, W> {
    port: Port<S>,
    discretes: Discretes<A, F, W>,
    computer: &'c mut FlightComputer,
    request: Gathered<'c>,
    answer: Gathered<'c>,
    /// The computer has the beginning of a stretch whose end has not come.
    overflowing: bool,
    /// When the last minor frame was closed; before the first, when the last packet came.
    frame_closed_us: u32,
}

impl<'c, S: Read + Write, A: OutputPin, F: OutputPin, W: OutputPin> Board<'c, S, A, F, W> {
    /// A computer in `Standby` on its hardware.
    #[must_use]
    pub fn new(stream: S, discretes: Discretes<A, F, W>, computer: &'c mut FlightComputer, room: &'c mut Room) -> Self {
        Self {
            port: Port::new(stream),
            discretes,
            computer,
            request: Gathered::new(&mut room.request),
            answer: Gathered::new(&mut room.answer),
            overflowing: false,
            frame_closed_us: 0,
        }
    }

    /// The computer, for snapshots.
    pub const fn computer_mut(&mut self) -> &mut FlightComputer {
        self.computer
    }

    /// The byte stream.
    pub const fn stream_mut(&mut self) -> &mut S {
        self.port.stream_mut()
    }

    /// Tells the link why the computer restarted.
    ///
    /// # Errors
    /// The stream.
    pub fn announce(&mut self, report: RestartReport) -> Result<(), BoardError> {
        let Self { port, computer, answer, .. } = self;
        computer.note_restart(report, |frame| answer.push_all(frame, |bytes| port.send(bytes)));
        answer.flush(|bytes| port.send(bytes)).map_err(BoardError::Port)
    }

    /// Waits for bytes and does all that follows from them. A stream that times out lets a real-time flight run the
    /// frames whose measurements did not come.
    ///
    /// # Errors
    /// The first failure of stream or lines; everything else of the step has been done.
    pub fn step(&mut self, meter: &mut impl Meter, clock: &mut impl Clock) -> Result<(), BoardError> {
        let mut buffer = [0; READ_BYTES];
        let outcome = match self.port.receive(&mut buffer) {
            Ok(bytes) => {
                // They always fit: what has room for a frame and a read never keeps more than a frame.
                self.request.append(bytes);
                match self.request.bytes().iter().rposition(|byte| *byte == DELIMITER) {
                    Some(_) if self.drop_noise() => self.port.send(&ACKNOWLEDGE).map_err(BoardError::Port),
                    Some(last) => {
                        self.overflowing = false;
                        self.serve(last + 1, meter, clock)
                    }
                    None if self.request.length >= MAX_FRAME => {
                        self.overflowing = true;
                        self.serve(self.request.length, meter, clock)
                    }
                    None => Ok(()),
                }
            }
            Err(PortError::Read(ErrorKind::TimedOut)) => Ok(()),
            Err(error) => Err(BoardError::Port(error)),
        };
        outcome.and(self.run_overdue(meter, clock))
    }

    /// Throws away a short stretch that is no packet at a glance, as noise on a line without a buffer makes them one by one:
    /// before the meter, which would cost more than the glance.
    fn drop_noise(&mut self) -> bool {
        let [stretch @ .., DELIMITER] = self.request.bytes() else { return false };
        if self.overflowing || stretch.len() > SHORT_STRETCH || stretch.contains(&DELIMITER) {
            return false;
        }
        let Some(reject) = glance(stretch) else { return false };
        self.computer.count_noise(stretch, reject);
        self.request.clear();
        true
    }

    /// Hands the first `end` bytes received to the computer, measured, and sends the answer: all that belongs to a minor
    /// frame as soon as it is closed.
    fn serve(&mut self, end: usize, meter: &mut impl Meter, clock: &mut impl Clock) -> Result<(), BoardError> {
        let (mut taken, mut outcome) = (0, Ok(()));
        // Each turn takes a byte or more.
        while taken < end {
            let Self { port, computer, request, answer, .. } = self;
            let frame_before = computer.executive().frame();
            let mut rest = request.bytes().get(taken..end).unwrap_or_default();
            meter.resume();
            computer.take_probed(&mut rest, meter, |frame| answer.push_all(frame, |bytes| port.send(bytes)));
            meter.pause();
            taken = end - rest.len();
            if computer.executive().mode() == Mode::Standby {
                meter.discard();
            }
            let closed = computer.executive().frame() != frame_before;
            outcome = outcome.and(self.tell(closed, meter, clock));
        }
        if self.computer.executive().frame() == 0 {
            // The board's schedule begins with the flight, not when it was switched on.
            self.frame_closed_us = clock.now_us();
        }
        let served = self.request.bytes().get(..end).unwrap_or_default();
        for _ in served.iter().filter(|byte| **byte == DELIMITER) {
            outcome = outcome.and(self.port.send(&ACKNOWLEDGE).map_err(BoardError::Port));
        }
        self.request.drop_front(end);
        outcome
    }

    /// Runs the frames of a real-time flight whose inertial measurements did not come in time.
    fn run_overdue(&mut self, meter: &mut impl Meter, clock: &mut impl Clock) -> Result<(), BoardError> {
        let is_overdue = clock.now_us().wrapping_sub(self.frame_closed_us) > OVERDUE_US;
        if self.computer.executive().pace() == Pace::LockStep || !is_overdue {
            return Ok(());
        }
        // The schedule goes on from when the frame was due, not from when it was found missing.
        let due_us = self.frame_closed_us.wrapping_add(FRAME.0);
        let Self { port, computer, answer, .. } = self;
        meter.resume();
        let ran = computer.run_overdue_frame(meter, |frame| answer.push_all(frame, |bytes| port.send(bytes)));
        meter.pause();
        let told = self.tell(ran, meter, clock);
        self.frame_closed_us = due_us;
        told
    }

    /// After a span: sends the answer, enters and reports what a closed frame cost, drives the lines. The watchdog is
    /// kicked once for each.
    fn tell(&mut self, closed: bool, meter: &mut impl Meter, clock: &mut impl Clock) -> Result<(), BoardError> {
        let Self { port, computer, answer, discretes, .. } = self;
        if let Some(cost) = meter.take() {
            computer.enter_cost(cost);
            computer.report_cost(|frame| answer.push_all(frame, |bytes| port.send(bytes)));
        }
        let sent = answer.flush(|bytes| port.send(bytes)).map_err(BoardError::Port);
        let driven = match computer.actuator() {
            Some(actuator) if closed => discretes.apply(actuator).and(discretes.kick_watchdog()),
            _ => Ok(()),
        };
        if closed {
            self.frame_closed_us = clock.now_us();
        }
        sent.and(driven.map_err(BoardError::Discrete))
    }
}

/// Bytes gathered until they are passed on together.
#[derive(Debug)]
struct Gathered<'c> {
    room: &'c mut [u8],
    length: usize,
    failure: Option<PortError>,
}

impl<'c> Gathered<'c> {
    const fn new(room: &'c mut [u8]) -> Self {
        Self { room, length: 0, failure: None }
    }

    fn bytes(&self) -> &[u8] {
        self.room.get(..self.length).unwrap_or(&[])
    }

    fn clear(&mut self) {
        self.length = 0;
    }

    /// Forgets the first `count` bytes.
    fn drop_front(&mut self, count: usize) {
        self.length = self.length.saturating_sub(count);
        for k in 0..self.length {
            let moved = self.room.get(k + count).copied();
            if let (Some(byte), Some(slot)) = (moved, self.room.get_mut(k)) {
                *slot = byte;
            }
        }
    }

    /// Takes bytes; false when there is no room for all of them, and then none.
    fn append(&mut self, bytes: &[u8]) -> bool {
        let end = self.length.saturating_add(bytes.len());
        let Some(room) = self.room.get_mut(self.length..end) else { return false };
        // Both are as long; `copy_from_slice` would keep a panic for the case that they are not.
        room.iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = *byte);
        self.length = end;
        true
    }

    /// Takes bytes; what was gathered before is passed on when they do not fit.
    fn push_all(&mut self, bytes: &[u8], mut pass: impl FnMut(&[u8]) -> Result<(), PortError>) {
        if bytes.len() > self.room.len().saturating_sub(self.length) {
            let passed = pass(self.bytes());
            self.fail(passed);
            self.clear();
        }
        if !self.append(bytes) {
            let passed = pass(bytes);
            self.fail(passed);
        }
    }

    /// Passes on what was gathered; the first failure since the last flush.
    fn flush(&mut self, mut pass: impl FnMut(&[u8]) -> Result<(), PortError>) -> Result<(), PortError> {
        let passed = if self.length > 0 { pass(self.bytes()) } else { Ok(()) };
        self.fail(passed);
        self.clear();
        self.failure.take().map_or(Ok(()), Err)
    }

    fn fail(&mut self, passed: Result<(), PortError>) {
        if let Err(error) = passed {
            self.failure.get_or_insert(error);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::link::framing::MAX_FRAME;
    use crate::link::packet::RejectCounters;
    use crate::link::packet::{Actuator, Command, Downlink, EventKind, Hello, Imu, RestartReason, Uplink};
    use crate::link::receiver::{Receiver, Sender};
    use crate::probe::{Counter, FrameMeter};
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
        /// With nothing left to read it times out; else it is closed.
        silent: bool,
    }

    impl embedded_io::ErrorType for Line {
        type Error = embedded_io::ErrorKind;
    }

    impl Read for Line {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
            let count = buffer.len().min(7).min(self.inbound.len());
            if count == 0 && self.silent {
                return Err(embedded_io::ErrorKind::TimedOut);
            }
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
            bytes.extend(sender.encode(MissionTime::of_frame(*frame), packet, &mut out).unwrap());
        }
        bytes
    }

    fn flight(frames: u32, pace: Pace) -> Vec<(u32, Uplink)> {
        let mut packets = std::vec![
            (0, Uplink::Hello(Hello::ours(1))),
            (0, Uplink::Command(Command::Arm { digest: Config::DEFAULT.digest() })),
            (0, Uplink::Command(Command::Go { pace })),
        ];
        packets.extend((1..=frames).map(|frame| (frame, Uplink::Imu(Imu::default()))));
        packets
    }

    /// Counts a hundred at every reading.
    #[derive(Default)]
    struct Hundreds(u32);

    impl Counter for Hundreds {
        fn restart(&mut self) {
            self.0 = 0;
        }

        fn read(&mut self) -> u32 {
            self.0 += 100;
            self.0
        }
    }

    /// A clock that is set from outside.
    #[derive(Clone, Default)]
    struct Hand(Rc<Cell<u32>>);

    impl Clock for Hand {
        fn now_us(&mut self) -> u32 {
            self.0.get()
        }
    }

    fn run(board: &mut Board<'_, Line, Pin, Pin, Pin>) -> Vec<BoardError> {
        let (mut errors, mut meter) = (Vec::new(), FrameMeter::new(Hundreds::default()));
        loop {
            match board.step(&mut meter, &mut Hand::default()) {
                Err(BoardError::Port(PortError::Closed)) => return errors,
                Err(error) => errors.push(error),
                Ok(()) => {}
            }
        }
    }

    fn packets(bytes: &[u8]) -> Vec<Downlink> {
        let (mut receiver, mut counters) = (Receiver::<Downlink>::new(), RejectCounters::default());
        bytes.iter().filter_map(|b| receiver.push(*b, &mut counters)).map(|f| f.packet).collect()
    }

    fn actuators(bytes: &[u8]) -> Vec<Actuator> {
        packets(bytes).into_iter().filter_map(|p| if let Downlink::Actuator(a) = p { Some(a) } else { None }).collect()
    }

    fn lines() -> Discretes<Pin, Pin, Pin> {
        Discretes::new(Pin::default(), Pin::default(), Pin::default()).unwrap()
    }

    #[test]
    fn a_board_flies_the_frames_it_reads_and_kicks_the_watchdog_for_each() {
        let line = Line { inbound: script(&flight(40, Pace::LockStep)), outbound: Vec::new(), silent: false };
        let (arm, fire, watchdog) = (Pin::default(), Pin::default(), Pin::default());
        let lines = Discretes::new(arm.clone(), fire.clone(), watchdog.clone()).unwrap();
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board = Board::new(line, lines, &mut computer, &mut room);
        assert!(run(&mut board).is_empty());
        let frames: Vec<u32> = actuators(&board.port.stream_mut().outbound).iter().map(|a| a.frame).collect();
        assert_eq!(frames, (1..=40).collect::<Vec<_>>());
        // Low at the start, then one edge a frame.
        assert_eq!(watchdog.levels.borrow().len(), 41);
        assert!(!fire.levels.borrow().contains(&true) && !arm.levels.borrow().contains(&true));
    }

    #[test]
    fn every_delimiter_received_is_acknowledged_by_one_empty_frame_behind_the_answer() {
        let mut inbound = script(&flight(20, Pace::LockStep));
        inbound.extend([0, 17, 33, 0]); // an empty frame and a damaged one, to which nothing is answered
        let received = inbound.iter().filter(|b| **b == 0).count();
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board =
            Board::new(Line { inbound, outbound: Vec::new(), silent: false }, lines(), &mut computer, &mut room);
        assert!(run(&mut board).is_empty());
        let sent = core::mem::take(&mut board.port.stream_mut().outbound);
        let empty =
            sent.iter().scan(0, |before, b| Some((core::mem::replace(before, *b), *b))).filter(|p| *p == (0, 0));
        assert_eq!(empty.count(), received);
        assert_eq!(sent.last(), Some(&0));
        assert_eq!(actuators(&sent).len(), 20);
    }

    #[test]
    fn the_cost_of_each_frame_is_entered_with_the_next_and_reported_when_asked() {
        let mut packets_up = flight(30, Pace::LockStep);
        packets_up.insert(1, (0, Uplink::Command(Command::ReportCost { on: true })));
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let line = Line { inbound: script(&packets_up), outbound: Vec::new(), silent: false };
        let mut board = Board::new(line, lines(), &mut computer, &mut room);
        assert!(run(&mut board).is_empty());
        let costs: Vec<_> = packets(&board.port.stream_mut().outbound)
            .into_iter()
            .filter_map(|p| if let Downlink::CostTlm(c) = p { Some(c) } else { None })
            .collect();
        assert_eq!(costs.iter().map(|c| c.frame).collect::<Vec<_>>(), (1..=30).collect::<Vec<_>>());
        assert!(costs.iter().all(|c| c.slots.iter().all(|s| *s >= 100) && c.whole >= c.slots.iter().sum()));
        assert_eq!(computer.executive().cost.worst_frame, costs.iter().take(29).map(|c| c.whole).max().unwrap());
    }

    #[test]
    fn a_board_that_restarted_by_itself_says_why_at_once_and_after_each_greeting() {
        let report = RestartReport { reason: RestartReason::Watchdog, frame: 123, address: 0x2000_0010 };
        let inbound = script(&[(0, Uplink::Hello(Hello::ours(1)))]);
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board =
            Board::new(Line { inbound, outbound: Vec::new(), silent: false }, lines(), &mut computer, &mut room);
        board.announce(report).unwrap();
        let told = |bytes: &[u8]| {
            packets(bytes)
                .iter()
                .filter(|p| matches!(p, Downlink::Event(e) if e.kind == EventKind::Restarted(report)))
                .count()
        };
        assert_eq!(told(&board.port.stream_mut().outbound), 1);
        assert!(run(&mut board).is_empty());
        assert_eq!(told(&board.port.stream_mut().outbound), 2);
    }

    #[test]
    fn a_broken_line_is_told_and_the_flight_goes_on() {
        let line = Line { inbound: script(&flight(10, Pace::LockStep)), outbound: Vec::new(), silent: false };
        let watchdog = Pin::default();
        let lines = Discretes::new(Pin::default(), Pin::default(), watchdog.clone()).unwrap();
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board = Board::new(line, lines, &mut computer, &mut room);
        watchdog.broken.set(true);
        let errors = run(&mut board);
        assert_eq!(errors, [BoardError::Discrete(DiscreteError::Watchdog(ErrorKind::Other)); 10]);
        assert_eq!(board.computer_mut().executive().frame(), 10);
    }

    /// What a board does whose sensors fall silent after `frames` frames, while its clock goes on for 40 frames.
    fn silence(pace: Pace, frames: u32) -> (u32, u32) {
        let line = Line { inbound: script(&flight(frames, pace)), outbound: Vec::new(), silent: true };
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board = Board::new(line, lines(), &mut computer, &mut room);
        let (mut meter, clock) = (FrameMeter::new(Hundreds::default()), Hand::default());
        while !board.port.stream_mut().inbound.is_empty() {
            board.step(&mut meter, &mut clock.clone()).unwrap();
        }
        for _ in 0..80 {
            clock.0.set(clock.0.get() + FRAME.0 / 2);
            board.step(&mut meter, &mut clock.clone()).unwrap();
        }
        (board.computer_mut().executive().frame(), board.computer_mut().executive().rejects.missed_frames)
    }

    #[test]
    fn a_real_time_flight_begins_when_it_is_told_to_however_long_the_board_has_been_on() {
        let line = Line { inbound: script(&flight(5, Pace::RealTime)), outbound: Vec::new(), silent: true };
        let (mut computer, mut room) = (FlightComputer::new(7), Room::new());
        let mut board = Board::new(line, lines(), &mut computer, &mut room);
        let (mut meter, clock) = (FrameMeter::new(Hundreds::default()), Hand::default());
        clock.0.set(3_600_000_000);
        while !board.port.stream_mut().inbound.is_empty() {
            board.step(&mut meter, &mut clock.clone()).unwrap();
        }
        let executive = board.computer_mut().executive();
        assert_eq!((executive.frame(), executive.rejects.missed_frames, executive.rejects.late), (5, 0, 0));
    }

    #[test]
    fn in_real_time_frames_without_measurements_run_on_the_boards_clock_and_in_lock_step_they_wait() {
        let (frame, missed) = silence(Pace::RealTime, 5);
        assert!((43..=45).contains(&frame), "frame {frame} after 40 frames of silence");
        assert_eq!(missed, frame - 5);
        assert_eq!(silence(Pace::LockStep, 5), (5, 0));
    }
}
