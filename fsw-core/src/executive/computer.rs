//! [`FlightComputer`]: the executive behind a byte stream. Bytes in, at most one burst of frames out; no clock, no
//! waiting. A host, a test and a board run exactly this.

use super::tick::{Executive, Outputs};
use crate::link::framing::{FrameBytes, MAX_FRAME};
use crate::link::packet::{
    Actuator, Command, CommandOutcome, CommandReply, CostTlm, Downlink, Event, EventKind, Frame, Hello, Imu, Injection,
    Mode, Pace, Refusal, RestartReport, Severity, Uplink,
};
use crate::link::parameters::BlockId;
use crate::link::receiver::{Receiver, Sender};
use crate::probe::{Kernel, MeasuredCost, NoProbe, Probe, SlotId};
use crate::sensors::FrameInputs;
use crate::slot::Slot;
use crate::time::MissionTime;

/// Minor frames without an inertial measurement that one packet may make up for. A longer gap is worked off over the
/// packets that follow, so that the cost of a packet stays bounded.
pub const MAX_BRIDGED_FRAMES: u32 = 10;
/// Commands and greetings answered within a minor frame of the flight, at most; more are counted and dropped.
pub const ANSWERS_PER_FRAME: u8 = 4;
/// Events sent with one frame, at most; more wait in the queue.
pub const EVENTS_PER_BURST: usize = 4;
/// Minor frames that may be missing before an inertial measurement without more ado. A larger jump of its time stamp
/// counts as early until the next measurement follows on it: one wrong time stamp must not run the flight ahead of
/// the vehicle, because the frames of the time jumped over would all come late.
pub const MAX_UNCONFIRMED_GAP: u32 = 5;

/// The flight software as seen from its link.
#[derive(Clone, Debug)]
pub struct FlightComputer {
    executive: Executive,
    receiver: Receiver<Uplink>,
    sender: Sender,
    inputs: FrameInputs,
    cost: MeasuredCost,
    build_id: u64,
    peer_refused: bool,
    actuator: Slot<Actuator>,
    /// Minor frame of the last inertial measurement, if it lay too far ahead to be run.
    jumped_to: Option<u32>,
    /// Why the computer runs at all, if it restarted by itself.
    restarted: Slot<RestartReport>,
    restart: Restart,
    reports_cost: bool,
    /// Where packets are encoded.
    out: FrameBytes,
    /// Minor frame of the last answer to a command or greeting, and how many it has had.
    answered: (u32, u8),
}

/// What a minor frame does with the measurements that have come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Gathered {
    /// It takes them.
    Used,
    /// It runs without, in the place of a frame that went missing; they are of a later one.
    Kept,
}

/// A flight computer as it stands in memory that is cleared at boot: all bytes zero, so that the image need not hold its
/// 19 KB. [`Dormant::wake`] makes it a computer.
#[derive(Clone, Debug)]
pub struct Dormant(FlightComputer);

impl Dormant {
    /// For a static.
    #[must_use]
    pub const fn new() -> Self {
        Self(FlightComputer::dormant())
    }

    /// The same as [`FlightComputer::new`], in place.
    pub const fn wake(&mut self, build_id: u64) -> &mut FlightComputer {
        self.0.wake(build_id);
        &mut self.0
    }
}

impl Default for Dormant {
    fn default() -> Self {
        Self::new()
    }
}

/// Whether the computer begins again when told to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Restart {
    /// Never: what flies.
    Refused,
    /// It may be asked to.
    Allowed,
    /// It has been asked to.
    Asked,
}

impl FlightComputer {
    /// A computer in `Standby`.
    #[must_use]
    pub const fn new(build_id: u64) -> Self {
        let mut computer = Self::dormant();
        computer.wake(build_id);
        computer
    }

    /// All zero bytes, to become [`Self::new`] by [`Self::wake`].
    const fn dormant() -> Self {
        Self {
            executive: Executive::dormant(),
            receiver: Receiver::new(),
            sender: Sender::new(),
            inputs: FrameInputs::new(),
            cost: MeasuredCost::NONE,
            build_id: 0,
            peer_refused: false,
            actuator: Slot::Empty,
            jumped_to: None,
            restarted: Slot::Empty,
            restart: Restart::Refused,
            reports_cost: false,
            out: [0; MAX_FRAME],
            answered: (0, 0),
        }
    }

    /// Becomes [`Self::new`] from [`Self::dormant`], in place: built elsewhere, it would take its size of stack.
    const fn wake(&mut self, build_id: u64) {
        self.executive.wake();
        self.build_id = build_id;
    }

    /// Lets [`Injection::Restart`] be obeyed: for test images that replay several flights in one boot.
    pub fn allow_restart(&mut self) {
        self.restart = Restart::Allowed;
    }

    /// Begins again in `Standby` if it was asked to; true when it did.
    pub fn restart_if_asked(&mut self) -> bool {
        let asked = self.restart == Restart::Asked;
        if asked {
            let build_id = self.build_id;
            *self = const { Self::dormant() };
            self.wake(build_id);
            self.allow_restart();
        }
        asked
    }

    /// Notes that the computer has restarted by itself: told at once, and again after each greeting in `Standby`.
    pub fn note_restart(&mut self, report: RestartReport, mut transmit: impl FnMut(&[u8])) {
        self.restarted.put(report);
        self.tell_restart(&mut transmit);
    }

    fn tell_restart(&mut self, transmit: &mut impl FnMut(&[u8])) {
        if let Some(&report) = self.restarted.get() {
            let (time, severity) = (MissionTime::ZERO, Severity::Fault);
            let event = Event { time, severity, kind: EventKind::Restarted(report) };
            self.send(time, &Downlink::Event(event), &mut NoProbe, transmit);
        }
    }

    /// The executive, for snapshots and inspection.
    #[must_use]
    pub const fn executive(&self) -> &Executive {
        &self.executive
    }

    /// What the last minor frame commanded; none before the first. The same as its last packet, for the discretes.
    #[must_use]
    pub const fn actuator(&self) -> Option<&Actuator> {
        self.actuator.get()
    }

    /// Enters what the frame before cost, in instructions of the reference computer; recorded with the next frame.
    pub fn enter_cost(&mut self, cost: MeasuredCost) {
        self.cost = cost;
    }

    /// Sends the cost last entered as a packet, if that was asked for. Its own cost belongs to no frame.
    pub fn report_cost(&mut self, mut transmit: impl FnMut(&[u8])) {
        if self.reports_cost {
            let frame = self.executive.frame();
            let MeasuredCost { whole, slots, kernels, units, stack_high_water_bytes } = self.cost;
            let packet = CostTlm { frame, whole, slots, kernels, units, stack_high_water_bytes };
            self.send(MissionTime::of_frame(frame), &Downlink::CostTlm(packet), &mut NoProbe, &mut transmit);
        }
    }

    /// Takes received bytes and hands each encoded frame of the answer to `transmit`.
    pub fn receive(&mut self, bytes: &[u8], transmit: impl FnMut(&[u8])) {
        self.receive_probed(bytes, &mut NoProbe, transmit);
    }

    /// As [`Self::receive`], telling `probe` when each slot of a minor frame is done.
    pub fn receive_probed(&mut self, bytes: &[u8], probe: &mut impl Probe, mut transmit: impl FnMut(&[u8])) {
        let mut rest = bytes;
        // Each turn takes a byte or more.
        while !rest.is_empty() {
            self.take_probed(&mut rest, probe, &mut transmit);
        }
    }

    /// Counts what lay between two delimiters and is too short for any packet, as [`Self::receive`] would.
    pub(super) fn count_runt(&mut self, stretch: &[u8]) {
        let rejects = &mut self.executive.rejects;
        rejects.crc = rejects.crc.saturating_add(u32::from(!stretch.is_empty()));
    }

    /// Takes received bytes off the front of `bytes` up to the end of a packet that is to be used, and does what follows
    /// from it; all bytes when there is none in them.
    pub fn take_probed(&mut self, bytes: &mut &[u8], probe: &mut impl Probe, mut transmit: impl FnMut(&[u8])) {
        while !bytes.is_empty() {
            if let Some(frame) = self.receiver.take(bytes, &mut self.executive.rejects) {
                probe.kernel_done(Kernel::Decode, 1);
                probe.slot_done(SlotId::Receive);
                self.handle(frame, probe, &mut transmit);
                break;
            }
        }
        if self.executive.frame() == 0 {
            probe.nothing_done();
        }
    }

    /// In a real-time flight runs the next minor frame without an inertial measurement, because none came in time; true
    /// when it did. In lock-step a frame waits.
    pub fn run_overdue_frame(&mut self, probe: &mut impl Probe, mut transmit: impl FnMut(&[u8])) -> bool {
        let overdue = self.executive.pace() == Pace::RealTime && self.executive.mode() != Mode::Standby;
        if overdue {
            let rejects = &mut self.executive.rejects;
            rejects.missed_frames = rejects.missed_frames.saturating_add(1);
            let now = MissionTime::of_frame(self.executive.frame().saturating_add(1));
            self.run_frame(now, Gathered::Used, probe, &mut transmit);
        }
        overdue
    }

    // Inlined into the loop over received bytes, the addresses of all that a minor frame touches would be found anew for
    // every few bytes of noise.
    #[inline(never)]
    fn handle(&mut self, frame: Frame<Uplink>, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        let Frame { sequence, time, packet } = frame;
        if self.peer_refused && !matches!(packet, Uplink::Hello(_)) {
            self.executive.rejects.decode = self.executive.rejects.decode.saturating_add(1);
            return;
        }
        match packet {
            Uplink::Hello(_) | Uplink::Command(_) if self.is_flooded() => {
                self.executive.rejects.flooded = self.executive.rejects.flooded.saturating_add(1);
            }
            Uplink::Hello(hello) => self.greet(&hello, probe, transmit),
            Uplink::Command(command) => {
                let outcome = self.obey(command, time);
                let reply = CommandReply { to_sequence: sequence, outcome };
                self.send(time, &Downlink::CommandReply(reply), probe, transmit);
                self.send_events(probe, transmit);
            }
            // Simulation only: the truth of a frame already closed (the entry epoch) tells nothing new.
            Uplink::Truth(_) if time.frame_index() <= self.executive.frame() => {}
            Uplink::Pressure(_) | Uplink::Radio(_) | Uplink::Truth(_) => {
                self.inputs.put(time, &packet, &mut self.executive.rejects);
            }
            Uplink::Imu(imu) => self.close_frame(time, imu, probe, transmit),
        }
    }

    /// Whether this minor frame of the flight has answered as many commands and greetings as it may; counts this one.
    fn is_flooded(&mut self) -> bool {
        if self.executive.mode() == Mode::Standby {
            return false;
        }
        let frame = self.executive.frame();
        let (of_frame, answered) = self.answered;
        let answered = if of_frame == frame { answered } else { 0 };
        self.answered = (frame, answered.saturating_add(1));
        answered >= ANSWERS_PER_FRAME
    }

    /// The answer to a Hello is ours, whatever theirs says, so that the peer can tell its user what differs. Nothing
    /// else of a peer that does not match is listened to: bytes that happen to decode would mean something else to it.
    /// In flight a greeting changes nothing: a stray one must not cut the vehicle off from its sensors.
    #[inline(never)] // its stack shall not lie under every minor frame
    fn greet(&mut self, theirs: &Hello, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        if self.executive.mode() == Mode::Standby {
            self.peer_refused = theirs.check().is_err();
        }
        let ours = Hello::ours(self.build_id);
        self.send(MissionTime::ZERO, &Downlink::Hello(ours), probe, transmit);
        if self.executive.mode() == Mode::Standby {
            self.tell_restart(transmit);
        }
    }

    #[inline(never)] // its stack shall not lie under every minor frame
    fn obey(&mut self, command: Command, now: MissionTime) -> CommandOutcome {
        let result = match command {
            Command::Load(_) if self.executive.is_armed() => Err(Refusal::AlreadyArmed),
            Command::Load(block) => self.executive.config.apply(&block),
            Command::ReadBack(id) => return self.read_back(id),
            Command::Arm { digest } => self.arm(digest, now),
            Command::Go { .. } if !self.executive.is_armed() => Err(Refusal::NotArmed),
            Command::Go { pace } => self.executive.go(pace).then_some(()).ok_or(Refusal::WrongMode),
            Command::Inject(Injection::Overrun { frames }) => {
                self.executive.cost.inject_overrun(frames);
                Ok(())
            }
            Command::Inject(Injection::Restart) if self.restart == Restart::Refused => Err(Refusal::WrongMode),
            Command::Inject(Injection::Restart) => {
                self.restart = Restart::Asked;
                Ok(())
            }
            Command::ReportCost { on } => {
                self.reports_cost = on;
                Ok(())
            }
        };
        match result {
            Ok(()) => CommandOutcome::Accepted,
            Err(refusal) => CommandOutcome::Refused(refusal),
        }
    }

    fn read_back(&self, id: BlockId) -> CommandOutcome {
        match self.executive.config.read_back(id) {
            Some(block) => CommandOutcome::Block(block),
            None => CommandOutcome::Refused(Refusal::BadTable { block: id }),
        }
    }

    fn arm(&mut self, digest: u32, now: MissionTime) -> Result<(), Refusal> {
        if self.executive.is_armed() {
            return Err(Refusal::AlreadyArmed);
        }
        let held = self.executive.config.digest();
        if held != digest {
            return Err(Refusal::DigestMismatch { held });
        }
        self.executive.config.validate()?;
        self.executive.arm().map_err(|_| Refusal::BadTable { block: BlockId::AtmosphereRows(0) })?;
        self.executive.log.record(now, Severity::Activity, EventKind::Armed { digest });
        Ok(())
    }

    /// An inertial measurement closes its minor frame. Frames that went missing before it are run first, without one.
    fn close_frame(&mut self, time: MissionTime, imu: Imu, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        if self.executive.mode() == Mode::Standby {
            return;
        }
        let present = self.executive.frame();
        let wanted = time.frame_index();
        let rejects = &mut self.executive.rejects;
        if MissionTime::of_frame(wanted) != time {
            rejects.range = rejects.range.saturating_add(1);
            return;
        }
        if wanted <= present {
            rejects.late = rejects.late.saturating_add(1);
            return;
        }
        let missing = wanted - present - 1;
        if missing > MAX_UNCONFIRMED_GAP && !self.jump_is_confirmed(wanted) {
            let rejects = &mut self.executive.rejects;
            rejects.early = rejects.early.saturating_add(1);
            return;
        }
        probe.frames_passed(missing + 1);
        let rejects = &mut self.executive.rejects;
        let bridged = if missing > MAX_BRIDGED_FRAMES { MAX_BRIDGED_FRAMES } else { missing };
        rejects.missed_frames = rejects.missed_frames.saturating_add(bridged);
        for index in 1..=bridged {
            self.run_frame(MissionTime::of_frame(present.saturating_add(index)), Gathered::Kept, probe, transmit);
        }
        if bridged < missing {
            let rejects = &mut self.executive.rejects;
            rejects.early = rejects.early.saturating_add(1);
            return;
        }
        self.jumped_to = None;
        self.inputs.imu = Some((time, imu));
        self.run_frame(time, Gathered::Used, probe, transmit);
    }

    /// Whether this measurement, far ahead, follows on the one before, which was far ahead too.
    fn jump_is_confirmed(&mut self, wanted: u32) -> bool {
        let before = self.jumped_to.replace(wanted);
        before.and_then(|before| wanted.checked_sub(before)).is_some_and(|step| step > 0 && step <= MAX_UNCONFIRMED_GAP)
    }

    fn run_frame(
        &mut self,
        now: MissionTime,
        gathered: Gathered,
        probe: &mut impl Probe,
        transmit: &mut impl FnMut(&[u8]),
    ) {
        let inputs = if gathered == Gathered::Used { &self.inputs } else { const { &FrameInputs::new() } };
        let Outputs { actuator, navigation, guidance, health } = self.executive.tick(now, inputs, &self.cost, probe);
        if gathered == Gathered::Used {
            self.inputs.clear();
        }
        if let Some(tlm) = navigation {
            self.send(now, &Downlink::NavTlm(tlm), probe, transmit);
        }
        if let Some(tlm) = guidance {
            self.send(now, &Downlink::GuidanceTlm(tlm), probe, transmit);
        }
        if let Some(tlm) = health {
            self.send(now, &Downlink::HealthTlm(tlm), probe, transmit);
        }
        self.send_events(probe, transmit);
        self.send(now, &Downlink::Actuator(actuator), probe, transmit);
        self.actuator.put(actuator);
        probe.slot_done(SlotId::Transmit);
        probe.frame_done();
    }

    fn send_events(&mut self, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        for _ in 0..EVENTS_PER_BURST {
            let Some(event) = self.executive.log.next_pending() else { return };
            self.send(event.time, &Downlink::Event(event), probe, transmit);
        }
    }

    fn send(&mut self, time: MissionTime, packet: &Downlink, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        // A packet always fits: the room is sized by the largest one.
        if let Ok(bytes) = self.sender.encode(time, packet, &mut self.out) {
            transmit(bytes);
        }
        probe.kernel_done(Kernel::Encode, 1);
    }
}

#[cfg(test)]
#[path = "computer_tests.rs"]
mod tests;
