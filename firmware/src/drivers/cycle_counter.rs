//! Cycle counter of the Cortex-M7's trace unit as the counter of execution cost.

use core::num::NonZeroU32;

use cortex_m::peripheral::{DCB, DWT};
use fsw_core::probe::Counter;

/// The counter. It wraps after 2^32 cycles, which no frame lasts.
pub struct CycleCounter {
    began: u32,
    cycles_per_unit: NonZeroU32,
}

impl CycleCounter {
    /// Starts it. One unit of cost stands for `cycles_per_unit`: 1 for a table of cycles; in a real-time flight as many
    /// as make the core's budgets, which are instructions, a limit in time.
    #[must_use]
    pub fn start(debug: &mut DCB, trace: &mut DWT, cycles_per_unit: NonZeroU32) -> Self {
        debug.enable_trace();
        // Some parts lock the unit at power-on.
        DWT::unlock();
        trace.enable_cycle_counter();
        Self { began: 0, cycles_per_unit }
    }
}

impl Counter for CycleCounter {
    fn restart(&mut self) {
        self.began = DWT::cycle_count();
    }

    fn read(&mut self) -> u32 {
        DWT::cycle_count().wrapping_sub(self.began) / self.cycles_per_unit
    }
}
