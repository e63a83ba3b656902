//! What an inertial measurement closes: its own minor frame and those that went missing before it.

use super::FlightComputer;
use crate::executive::tick::Outputs;
use crate::link::packet::{Downlink, Imu, Mode};
use crate::probe::{Probe, SlotId};
use crate::sensors::FrameInputs;
use crate::time::MissionTime;

/// Minor frames without an inertial measurement that one packet may make up for. A longer gap is worked off over the
/// packets that follow, so that the cost of a packet stays bounded.
pub const MAX_BRIDGED_FRAMES: u32 = 10;
/// Events sent with one frame, at most; more wait in the queue.
pub const EVENTS_PER_BURST: usize = 4;
/// Minor frames that may be missing before an inertial measurement without more ado. A larger jump of its time stamp
/// counts as early until the next measurement follows on it: one wrong time stamp must not run the flight ahead of
/// the vehicle, because the frames of the time jumped over would all come late.
pub const MAX_UNCONFIRMED_GAP: u32 = 5;

/// What a minor frame does with the measurements that have come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gathered {
    /// It takes them.
    Used,
    /// It runs without, in the place of a frame that went missing; they are of a later one.
    Kept,
}

impl FlightComputer {
    /// An inertial measurement closes its minor frame. Frames that went missing before it are run first, without one.
    pub(super) fn close_frame(
        &mut self,
        time: MissionTime,
        imu: Imu,
        probe: &mut impl Probe,
        transmit: &mut impl FnMut(&[u8]),
    ) {
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

    pub(super) fn run_frame(
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

    pub(super) fn send_events(&mut self, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        for _ in 0..EVENTS_PER_BURST {
            let Some(event) = self.executive.log.next_pending() else { return };
            self.send(event.time, &Downlink::Event(event), probe, transmit);
        }
    }
}
