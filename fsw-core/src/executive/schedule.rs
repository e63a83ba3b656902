//! The schedule: which slot runs in which minor frame and what it may cost. `const` data, checked by the compiler.

use crate::link::parameters::NavigationMode;
use crate::probe::{SLOT_COUNT, SlotId};
use crate::time::FRAMES_PER_SECOND;

/// One row of the schedule.
#[derive(Clone, Copy, Debug)]
pub struct Slot {
    /// Which slot.
    pub id: SlotId,
    /// Its name in reports.
    pub name: &'static str,
    /// It runs every so many minor frames …
    pub every: u32,
    /// … in the frames whose index leaves this remainder.
    pub offset: u32,
    /// Budget of one run, instructions on the reference computer.
    pub budget: u32,
}

/// Minor frames between two navigation telemetry packets (10 Hz).
pub const NAV_TELEMETRY_FRAMES: u32 = 5;
/// … and where they lie: in the frames with the least work of the filter, and away from the beginning of a cycle.
pub const NAV_TELEMETRY_OFFSET: u32 = 4;
/// Minor frames between two health packets (1 Hz) …
pub const HEALTH_FRAMES: u32 = FRAMES_PER_SECOND;
/// … and the frame of the second in which they go down: one in which the filter has little to do and no other packet of
/// telemetry is due.
pub const HEALTH_OFFSET: u32 = 35;
/// Minor frames between two in which a report of guidance may go down …
pub const GUIDANCE_TELEMETRY_FRAMES: u32 = 5;
/// … and where they lie: away from the whole second, when a cycle begins.
pub const GUIDANCE_TELEMETRY_OFFSET: u32 = 0;

/// The schedule, in the order of execution within a minor frame. Filter and guidance slice their own 10 Hz and 1 Hz
/// work evenly over the frames, hence run in each of them.
pub const SCHEDULE: [Slot; SLOT_COUNT] = [
    Slot { id: SlotId::Receive, name: "receive", every: 1, offset: 0, budget: 30_000 },
    Slot { id: SlotId::Sensors, name: "sensors", every: 1, offset: 0, budget: 2_000 },
    Slot { id: SlotId::Navigation, name: "navigation", every: 1, offset: 0, budget: 22_000 },
    Slot { id: SlotId::Guidance, name: "guidance", every: 1, offset: 0, budget: 27_000 },
    Slot { id: SlotId::Control, name: "control", every: 1, offset: 0, budget: 2_000 },
    Slot { id: SlotId::Fault, name: "fault", every: 1, offset: 0, budget: 2_000 },
    Slot { id: SlotId::Telemetry, name: "telemetry", every: 1, offset: 0, budget: 2_000 },
    Slot { id: SlotId::Transmit, name: "transmit", every: 1, offset: 0, budget: 13_000 },
];

/// Bytes received in a minor frame, above which guidance leaves the frame to them if it can: a full frame of every sensor has
/// fewer …
pub const CROWDED_BYTES: usize = 400;
/// … and scalar updates of the filter in it.
pub const CROWDED_UPDATES: usize = 1;

/// Cost that a whole minor frame may have, instructions on the reference computer.
pub const FRAME_BUDGET: u32 = 100_000;

/// What the slot `navigation`, and with it the frame, may cost more in a mode: the filters of the papers over the onboard model
/// are there to be compared, beside the strapdown that goes on as their reserve.
#[must_use]
pub const fn navigation_allowance(mode: NavigationMode) -> u32 {
    match mode {
        NavigationMode::Ekf | NavigationMode::DeadReckoning | NavigationMode::Ideal => 0,
        _ => 100_000,
    }
}

/// True in the minor frames in which something due `every` frames at `offset` runs.
#[must_use]
pub const fn due(frame: u32, every: u32, offset: u32) -> bool {
    every != 0 && frame % every == offset
}

const fn schedule_is_sound() -> bool {
    let mut sum = 0;
    let mut i = 0;
    while i < SLOT_COUNT {
        #[allow(clippy::indexing_slicing)] // i < SLOT_COUNT, the length of the table
        let slot = SCHEDULE[i];
        if slot.every == 0 || slot.offset >= slot.every || slot.id as usize != i {
            return false;
        }
        sum += slot.budget;
        i += 1;
    }
    sum <= FRAME_BUDGET
}

const _: () =
    assert!(schedule_is_sound(), "schedule: rows out of order, offset beyond period, or budgets above the frame's");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_is_due_once_per_period() {
        assert_eq!((0..100).filter(|f| due(*f, 5, 2)).count(), 20);
        assert!(due(7, 5, 2));
        assert!(!due(0, 0, 0));
    }
}
