//! Execution cost: measured by the caller, entered as an input of the next tick, kept as worst values.
//!
//! The core owns no clock. A [`Probe`] is told when a slot is done; what it measured comes back as [`MeasuredCost`]
//! with the next frame, so that a replay sees the same numbers, and no verdict of a lock-step flight depends on them.

use super::schedule::{SCHEDULE, SlotId};
use crate::fault::EventLog;
use crate::link::packet::{EventKind, SLOT_COUNT, Severity};
use crate::time::{FRAMES_PER_SECOND, MissionTime};

/// Told when each slot of a frame is done.
pub trait Probe {
    /// The slot has just ended.
    fn slot_done(&mut self, slot: SlotId);
}

/// A probe that measures nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProbe;

impl Probe for NoProbe {
    fn slot_done(&mut self, _slot: SlotId) {}
}

/// Cost of the frame before, in the caller's unit (instructions on target); zero where not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeasuredCost {
    /// Per slot.
    pub slots: [u32; SLOT_COUNT],
    /// Deepest stack use so far, bytes.
    pub stack_high_water_bytes: u32,
}

/// Worst costs and overruns so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct CostLedger {
    /// Worst cost per slot.
    pub worst: [u32; SLOT_COUNT],
    /// Frames in which a slot exceeded its budget.
    pub slips: u16,
    /// Deepest stack use, bytes.
    pub stack_high_water_bytes: u32,
    last_event_frame: Option<u32>,
    injected_frames: u16,
}

impl CostLedger {
    /// A ledger that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { worst: [0; SLOT_COUNT], slips: 0, stack_high_water_bytes: 0, last_event_frame: None, injected_frames: 0 }
    }

    /// Makes the next `frames` frames count as overrun, for tests of the response.
    pub fn inject_overrun(&mut self, frames: u16) {
        self.injected_frames = frames;
    }

    /// Enters the cost of the frame before; an overrun is counted each time and logged once a second at most.
    pub fn enter(&mut self, now: MissionTime, frame: u32, cost: &MeasuredCost, log: &mut EventLog) {
        if cost.stack_high_water_bytes > self.stack_high_water_bytes {
            self.stack_high_water_bytes = cost.stack_high_water_bytes;
        }
        let mut over: Option<(u8, u32, u32)> = None;
        for ((slot, spent), worst) in SCHEDULE.iter().zip(cost.slots).zip(self.worst.iter_mut()) {
            let injected = self.injected_frames > 0 && slot.id == SlotId::Guidance;
            let spent = if injected { slot.budget.saturating_mul(2) } else { spent };
            if spent > *worst {
                *worst = spent;
            }
            if spent > slot.budget && over.is_none() {
                over = Some((slot.id as u8, spent, slot.budget));
            }
        }
        self.injected_frames = self.injected_frames.saturating_sub(1);
        let Some((slot, cost, budget)) = over else { return };
        self.slips = self.slips.saturating_add(1);
        if self.last_event_frame.is_none_or(|last| frame.wrapping_sub(last) >= FRAMES_PER_SECOND) {
            log.record(now, Severity::Warning, EventKind::FrameOverrun { slot, cost, budget });
            self.last_event_frame = Some(frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_injected_overrun_is_counted_each_frame_and_logged_once_a_second() {
        let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
        ledger.inject_overrun(60);
        for frame in 0..100 {
            ledger.enter(MissionTime::of_frame(frame), frame, &MeasuredCost::default(), &mut log);
        }
        assert_eq!(ledger.slips, 60);
        assert_eq!(log.last().count(), 2);
    }

    #[test]
    fn the_worst_cost_of_a_slot_is_kept() {
        let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
        for cost in [3, 9, 5] {
            let mut measured = MeasuredCost::default();
            measured.slots[1] = cost;
            ledger.enter(MissionTime::ZERO, 0, &measured, &mut log);
        }
        assert_eq!(ledger.worst[1], 9);
        assert_eq!(ledger.slips, 0);
    }
}
