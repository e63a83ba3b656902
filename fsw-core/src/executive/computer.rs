//! [`FlightComputer`]: the executive behind a byte stream. Bytes in, at most one burst of frames out; no clock, no
//! waiting. A host, a test and a board run exactly this.

mod commands;
mod frames;

pub use commands::ANSWERS_PER_FRAME;
pub use frames::{EVENTS_PER_BURST, MAX_BRIDGED_FRAMES, MAX_UNCONFIRMED_GAP};

use frames::Gathered;

use super::tick::Executive;
use crate::link::framing::{FrameBytes, MAX_FRAME, Reject};
use crate::link::packet::{
    Actuator, CommandReply, CostTlm, Downlink, Event, EventKind, Frame, Mode, Pace, RestartReport, Severity, Uplink,
};
use crate::link::receiver::{Receiver, Sender};
use crate::probe::{Kernel, MeasuredCost, NoProbe, Probe, SlotId};
use crate::sensors::FrameInputs;
use crate::slot::Slot;
use crate::time::MissionTime;

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

    /// Lets [`Injection::Restart`](crate::link::packet::Injection::Restart) be obeyed: for test images that replay several flights in one boot.
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

    /// Counts what lay between two delimiters and is no packet at a glance, as [`Self::receive`] would.
    pub(super) fn count_noise(&mut self, stretch: &[u8], reject: Reject) {
        self.executive.received += stretch.len() + 1;
        if !stretch.is_empty() {
            self.executive.rejects.count(reject);
        }
    }

    /// Takes received bytes off the front of `bytes` up to the end of a packet that is to be used, and does what follows
    /// from it; all bytes when there is none in them.
    pub fn take_probed(&mut self, bytes: &mut &[u8], probe: &mut impl Probe, mut transmit: impl FnMut(&[u8])) {
        while !bytes.is_empty() {
            let before = bytes.len();
            let taken = self.receiver.take(bytes, &mut self.executive.rejects);
            self.executive.received += before - bytes.len();
            if let Some(frame) = taken {
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
