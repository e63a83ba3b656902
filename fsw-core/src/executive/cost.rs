//! Execution cost: measured by the caller, entered as an input of the next tick, kept as worst values.
//!
//! What a [`Probe`](crate::probe::Probe) measured comes back as [`MeasuredCost`] with the next frame, so that a replay
//! sees the same numbers. A measured overrun is always counted, but only a real-time flight logs it and acts on it: what a
//! lock-step flight sends must not depend on the machine. An injected overrun is logged and acted on in any flight.

use super::schedule::{FRAME_BUDGET, SCHEDULE, Slot};
use crate::fault::EventLog;
use crate::link::packet::{EventKind, Pace, Severity};
use crate::probe::{MeasuredCost, SLOT_COUNT, SlotId};
use crate::time::{FRAMES_PER_SECOND, MissionTime};

/// Slot number that stands for the whole frame in the event of an overrun.
pub const WHOLE_FRAME: u8 = SLOT_COUNT as u8;

/// Worst costs and overruns so far.
#[derive(Clone, Copy, Debug, Default)]
pub struct CostLedger {
    /// Worst cost per slot.
    pub worst: [u32; SLOT_COUNT],
    /// Worst cost of a whole frame.
    pub worst_frame: u32,
    /// Frames in which a slot, or the frame, exceeded its budget.
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
        Self {
            worst: [0; SLOT_COUNT],
            worst_frame: 0,
            slips: 0,
            stack_high_water_bytes: 0,
            last_event_frame: None,
            injected_frames: 0,
        }
    }

    /// Makes the next `frames` frames count as overrun, for tests of the response.
    pub fn inject_overrun(&mut self, frames: u16) {
        self.injected_frames = frames;
    }

    /// Enters the cost of the frame before; an overrun is counted each time and, unless it was measured in lock-step, logged
    /// once a second at most. True when guidance has to shed its work of this frame.
    ///
    /// `allowance` is what the mode lets the slot `navigation` cost beyond the schedule.
    pub fn enter(
        &mut self,
        now: MissionTime,
        pace: Pace,
        cost: &MeasuredCost,
        allowance: u32,
        log: &mut EventLog,
    ) -> bool {
        let frame = now.frame_index();
        let injected = self.injected_frames > 0;
        self.injected_frames = self.injected_frames.saturating_sub(1);
        raise(&mut self.stack_high_water_bytes, cost.stack_high_water_bytes);
        raise(&mut self.worst_frame, cost.whole);
        for (spent, worst) in cost.slots.iter().zip(self.worst.iter_mut()) {
            raise(worst, *spent);
        }
        let Some((slot, cost, budget)) = overrun(cost, injected, allowance) else { return false };
        self.slips = self.slips.saturating_add(1);
        if !injected && pace == Pace::LockStep {
            return false;
        }
        if self.last_event_frame.is_none_or(|last| frame.wrapping_sub(last) >= FRAMES_PER_SECOND) {
            log.record(now, Severity::Warning, EventKind::FrameOverrun { slot, cost, budget });
            self.last_event_frame = Some(frame);
        }
        true
    }
}

fn raise(worst: &mut u32, spent: u32) {
    if spent > *worst {
        *worst = spent;
    }
}

/// The first slot beyond its budget, or the frame beyond its own: which, cost, budget. An injected overrun is one of
/// guidance, by as much again as its budget.
fn overrun(cost: &MeasuredCost, injected: bool, allowance: u32) -> Option<(u8, u32, u32)> {
    let frame_budget = FRAME_BUDGET.saturating_add(allowance);
    let spent = |id: SlotId, measured: u32, budget: u32| {
        if injected && id == SlotId::Guidance { budget.saturating_mul(2) } else { measured }
    };
    let budget = |slot: &Slot| match slot.id {
        SlotId::Navigation => slot.budget.saturating_add(allowance),
        _ => slot.budget,
    };
    let mut slots =
        SCHEDULE.iter().zip(cost.slots).map(|(slot, c)| (slot.id as u8, spent(slot.id, c, slot.budget), budget(slot)));
    let slot = slots.find(|(_, cost, budget)| cost > budget);
    slot.or_else(|| (cost.whole > frame_budget).then_some((WHOLE_FRAME, cost.whole, frame_budget)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn enter(ledger: &mut CostLedger, log: &mut EventLog, frame: u32, pace: Pace, cost: &MeasuredCost) -> bool {
        ledger.enter(MissionTime::of_frame(frame), pace, cost, 0, log)
    }

    #[test]
    fn an_injected_overrun_is_counted_each_frame_logged_once_a_second_and_sheds_guidance() {
        let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
        ledger.inject_overrun(60);
        let shed = (0..100).filter(|f| enter(&mut ledger, &mut log, *f, Pace::LockStep, &MeasuredCost::NONE)).count();
        assert_eq!((shed, ledger.slips), (60, 60));
        assert_eq!(log.last().count(), 2);
        assert_eq!(ledger.worst, [0; SLOT_COUNT], "an injected overrun is no measurement");
    }

    #[test]
    fn what_a_mode_allows_its_navigation_is_no_overrun() {
        let mut cost = MeasuredCost { whole: 200_000, ..MeasuredCost::NONE };
        cost.slots[SlotId::Navigation as usize] = 120_000;
        let slips = |allowance| {
            let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
            ledger.enter(MissionTime::of_frame(1), Pace::RealTime, &cost, allowance, &mut log);
            ledger.slips
        };
        assert_eq!((slips(0), slips(100_000)), (1, 0));
    }

    #[test]
    fn a_measured_overrun_is_always_counted_and_logged_and_acted_on_only_in_real_time() {
        let mut slot = MeasuredCost::NONE;
        slot.slots[SlotId::Control as usize] = 2_001;
        let whole = MeasuredCost { whole: FRAME_BUDGET + 1, ..MeasuredCost::NONE };
        for (cost, name) in [(slot, SlotId::Control as u8), (whole, WHOLE_FRAME)] {
            let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
            assert!(!enter(&mut ledger, &mut log, 1, Pace::LockStep, &cost));
            assert_eq!((ledger.slips, log.last().count()), (1, 0));
            assert!(enter(&mut ledger, &mut log, 2, Pace::RealTime, &cost));
            assert_eq!(ledger.slips, 2);
            let events: std::vec::Vec<_> = log.last().collect();
            assert!(
                matches!(events[..], [e] if matches!(e.kind, EventKind::FrameOverrun { slot, .. } if slot == name))
            );
        }
    }

    #[test]
    fn the_worst_cost_of_slots_and_frame_is_kept() {
        let (mut ledger, mut log) = (CostLedger::new(), EventLog::new());
        for cost in [3, 9, 5] {
            let mut measured = MeasuredCost { whole: 10 * cost, ..MeasuredCost::NONE };
            measured.slots[1] = cost;
            enter(&mut ledger, &mut log, 0, Pace::LockStep, &measured);
        }
        assert_eq!((ledger.worst[1], ledger.worst_frame, ledger.slips), (9, 90, 0));
    }
}
