//! Cycle counter of RISC-V as the counter of execution cost.

use core::num::NonZeroUsize;

use fsw_core::probe::Counter;
use riscv::register::mcycle;

/// The counter.
pub struct CycleCounter {
    began: usize,
    cycles_per_unit: NonZeroUsize,
}

impl CycleCounter {
    /// One unit of cost stands for `cycles_per_unit`: 1 for a table of cycles; in a real-time flight as many as make the
    /// core's budgets, which are instructions, a limit in time.
    #[must_use]
    pub const fn new(cycles_per_unit: NonZeroUsize) -> Self {
        Self { began: 0, cycles_per_unit }
    }
}

impl Counter for CycleCounter {
    fn restart(&mut self) {
        self.began = mcycle::read();
    }

    fn read(&mut self) -> u32 {
        (mcycle::read().wrapping_sub(self.began) / self.cycles_per_unit) as u32
    }
}
