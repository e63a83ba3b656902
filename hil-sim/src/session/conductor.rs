//! The conductor: greets the flight computer, loads and verifies its parameters, arms it and flies it frame by frame.
//!
//! A state machine without threads, clocks or sockets. Its owner moves bytes: [`Conductor::receive`] takes what the
//! flight computer said, [`Conductor::transmit`] gives what it should hear next, [`Conductor::timeout`] says that
//! nothing came in time. The same object flies in-process, over TCP, a pty or a serial line.

use fsw_core::config::Config;
use fsw_core::link::framing::{FrameBytes, MAX_FRAME};
use fsw_core::link::packet::{Actuator, Downlink, Frame, Pace, Refusal, RejectCounters, Uplink};
use fsw_core::link::receiver::{Receiver, Sender};
use fsw_core::time::MissionTime;

use super::SessionError;
use super::plan::Plan;
use super::plant::Plant;
use super::refusal;
use super::uplink::Uplink as Line;
use crate::case::Case;
use crate::scenario::Scenario;
use crate::sensors::SensorFaults;
use crate::truth::Truth;

/// Times that an unanswered command is repeated.
const MAX_REPEATS: u32 = 5;
/// Times that an unanswered greeting is repeated: 30 s of wall time at two a second.
const MAX_GREETINGS: u32 = 60;
/// Frames in a row without an actuator command after which the flight computer counts as lost.
const MAX_SILENT_FRAMES: u32 = 500;

/// How a flight ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// The parachute was fired.
    Deployed,
    /// The surface was reached without a parachute.
    Ground,
    /// The time limit of the scenario was reached.
    TimeLimit,
    /// The session failed.
    Failed(SessionError),
}

/// Where a session stands, in its order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// Greeting sent, no answer yet.
    Greeting,
    /// Parameter blocks are being sent.
    Loading,
    /// Parameter blocks are being read back.
    Verifying,
    /// Arming.
    Arming,
    /// Start command sent.
    Starting,
    /// Frames.
    Flying,
    /// Over.
    Finished,
}

/// A session at a glance.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// Where it stands.
    pub phase: Phase,
    /// Mission time, s.
    pub time_s: f64,
    /// How it ended, if it has.
    pub finished: Option<End>,
}

/// See the [module](self).
pub struct Conductor<P = Truth> {
    plant: P,
    plan: Plan,
    sensor_faults: SensorFaults,
    line: Line,
    config: Box<Config>,
    sender: Sender,
    receiver: Receiver<Downlink>,
    counters: RejectCounters,
    phase: Phase,
    finished: Option<End>,
    /// The block that is being loaded or read back.
    block: usize,
    /// Sequence number of the command that awaits its answer.
    outstanding: Option<u16>,
    /// Times that the greeting, or the outstanding command, was repeated.
    repeats: u32,
    frame: u32,
    command: Actuator,
    /// Frames in a row without a command.
    silent_frames: u32,
    /// The actuator command of the present frame has come, or is not to be waited for.
    go_on: bool,
    pending: Vec<u8>,
    pace: Pace,
}

impl Conductor<Truth> {
    /// The session of one run of a scenario; run `run` of `seed` is always the same, `nominal` turns dispersions off.
    ///
    /// # Errors
    /// The parameters cannot be told to this flight software.
    pub fn new(scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Result<Self, SessionError> {
        Self::for_case(scenario, &Case::draw(scenario, seed, run, nominal))
    }

    /// The session of one case of a scenario.
    ///
    /// # Errors
    /// The parameters cannot be told to this flight software.
    pub fn for_case(scenario: &Scenario, case: &Case) -> Result<Self, SessionError> {
        Self::with_plant(Truth::new(case), Plan::new(scenario, case.knowledge, case.noise.stream("uplink faults")))
    }
}

impl<P: Plant> Conductor<P> {
    /// A session about to greet.
    ///
    /// # Errors
    /// The parameters cannot be told to this flight software.
    pub fn with_plant(plant: P, plan: Plan) -> Result<Self, SessionError> {
        let mut config = Box::new(Config::DEFAULT);
        let refused = |r: Refusal| SessionError::Parameters(refusal::explain(r));
        plan.blocks.iter().try_for_each(|block| config.apply(block)).map_err(refused)?;
        config.validate().map_err(refused)?;
        let mut conductor = Self {
            plant,
            sensor_faults: SensorFaults::new(&plan.faults),
            line: Line::new(&plan.faults, plan.noise.clone()),
            plan,
            config,
            sender: Sender::new(),
            receiver: Receiver::new(),
            counters: RejectCounters::default(),
            phase: Phase::Greeting,
            finished: None,
            block: 0,
            outstanding: None,
            repeats: 0,
            frame: 0,
            command: Actuator::default(),
            silent_frames: 0,
            go_on: true,
            pending: Vec::new(),
            pace: Pace::LockStep,
        };
        conductor.say();
        Ok(conductor)
    }

    /// Has the minor frames paced by the board's clock instead of by the inertial packets; before the start only.
    pub fn set_pace(&mut self, pace: Pace) {
        self.pace = pace;
    }

    /// Where the session stands.
    #[must_use]
    pub fn status(&self) -> Status {
        Status { phase: self.phase, time_s: self.now().as_s(), finished: self.finished.clone() }
    }

    /// How the session ended, if it has.
    #[must_use]
    pub fn finished(&self) -> Option<&End> {
        self.finished.as_ref()
    }

    /// What came from the flight computer, rejected packets by cause.
    #[must_use]
    pub fn counters(&self) -> &RejectCounters {
        &self.counters
    }

    /// What is flown.
    #[must_use]
    pub fn plant(&self) -> &P {
        &self.plant
    }

    /// Takes bytes from the flight computer.
    pub fn receive(&mut self, bytes: &[u8]) {
        self.receive_heard(bytes, |_, _| {});
    }

    /// As [`Self::receive`], showing every packet to `each` before it acts, with what is flown as it was when the packet
    /// was sent: for an observer who does not want to decode the line a second time.
    pub fn receive_heard(&mut self, bytes: &[u8], mut each: impl FnMut(&Frame<Downlink>, &P)) {
        let mut rest = bytes;
        while !rest.is_empty() && self.finished.is_none() {
            if let Some(frame) = self.receiver.take(&mut rest, &mut self.counters) {
                each(&frame, &self.plant);
                self.hear(frame.packet);
            }
        }
    }

    /// Appends what the flight computer should hear now; nothing when it is its turn to speak.
    pub fn transmit(&mut self, out: &mut Vec<u8>) {
        if self.phase == Phase::Flying && self.go_on && self.finished.is_none() {
            self.fly_one_frame();
        }
        out.append(&mut self.pending);
    }

    /// Nothing came in time: repeats what was said, or in flight goes on with the last command.
    pub fn timeout(&mut self) {
        if self.finished.is_some() {
            return;
        }
        if self.phase == Phase::Flying {
            self.silent_frames += 1;
            self.go_on = true;
            if self.silent_frames > MAX_SILENT_FRAMES {
                let what = format!("the frames since t = {:.2} s", self.now().as_s());
                self.no_answer(what, f64::from(MAX_SILENT_FRAMES) * 0.02);
            }
            return;
        }
        self.repeats += 1;
        let (allowed, what) = match self.phase {
            Phase::Greeting => (MAX_GREETINGS, "the greeting".into()),
            _ => (MAX_REPEATS, self.what_is_asked()),
        };
        if self.repeats > allowed {
            self.no_answer(what, f64::from(allowed) * 0.5);
        } else {
            self.say();
        }
    }

    /// Ends the session from outside, as when the stream breaks.
    pub fn fail(&mut self, error: SessionError) {
        self.finish(End::Failed(error));
    }

    fn no_answer(&mut self, what: String, waited_s: f64) {
        self.fail(SessionError::NoAnswer { peer: "flight computer", what, waited_s });
    }

    fn finish(&mut self, end: End) {
        if self.finished.is_none() {
            self.finished = Some(end);
            self.phase = Phase::Finished;
            self.outstanding = None;
        }
    }

    fn now(&self) -> MissionTime {
        MissionTime::of_frame(self.frame)
    }

    fn send(&mut self, packet: Uplink) {
        let mut room: FrameBytes = [0; MAX_FRAME];
        if let Ok(bytes) = self.sender.encode(self.now(), &packet, &mut room) {
            self.pending.extend_from_slice(bytes);
        }
    }
}

mod flight;
mod handshake;

#[cfg(test)]
#[path = "conductor_tests.rs"]
mod tests;
