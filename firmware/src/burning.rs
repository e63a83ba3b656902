//! [`Burning`]: a cost meter that burns processor time inside the guidance slot, for the image whose frames overrun.

use fsw_core::executive::schedule::SCHEDULE;
use fsw_core::probe::{Kernel, MeasuredCost, Meter, Probe, SlotId};

/// The minor frames that overrun, counted from the start of the flight.
pub const BURNING_FRAMES: core::ops::Range<u32> = 100..110;

/// The board's meter with the burning before it.
#[derive(Clone, Debug)]
pub struct Burning<M> {
    meter: M,
    frames: u32,
}

impl<M: Meter> Burning<M> {
    /// Burns before what `meter` measures.
    pub const fn new(meter: M) -> Self {
        Self { meter, frames: 0 }
    }
}

/// Takes at least `instructions` of them.
fn burn(instructions: u32) {
    for turn in 0..instructions {
        core::hint::black_box(turn);
    }
}

impl<M: Meter> Probe for Burning<M> {
    fn slot_done(&mut self, slot: SlotId) {
        self.meter.slot_done(slot);
        // What comes after navigation is charged to guidance.
        if slot == SlotId::Navigation && BURNING_FRAMES.contains(&self.frames) {
            burn(SCHEDULE.iter().find(|row| row.id == SlotId::Guidance).map_or(0, |row| row.budget));
        }
    }

    fn kernel_done(&mut self, kernel: Kernel, units: u32) {
        self.meter.kernel_done(kernel, units);
    }

    fn frame_done(&mut self) {
        self.frames = self.frames.wrapping_add(1);
        self.meter.frame_done();
    }

    fn nothing_done(&mut self) {
        self.meter.nothing_done();
    }

    fn frames_passed(&mut self, frames: u32) {
        self.meter.frames_passed(frames);
    }
}

impl<M: Meter> Meter for Burning<M> {
    fn resume(&mut self) {
        self.meter.resume();
    }

    fn pause(&mut self) {
        self.meter.pause();
    }

    fn discard(&mut self) {
        self.meter.discard();
    }

    fn take(&mut self) -> Option<MeasuredCost> {
        self.meter.take()
    }

    fn note_stack(&mut self, high_water_bytes: u32) {
        self.meter.note_stack(high_water_bytes);
    }
}
