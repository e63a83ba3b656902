//! SysTick as the counter of execution cost: instructions under QEMU's `-icount`, cycles on silicon.

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use fsw_core::probe::Counter;

/// It counts down from here, 24 bits.
const TOP: u32 = 0x00FF_FFFF;

/// The counter.
pub struct SysTick {
    timer: SYST,
    units_per_count: u32,
}

impl SysTick {
    /// Starts it. One count stands for `units_per_count` units of cost, which is the granularity.
    #[must_use]
    pub fn start(mut timer: SYST, units_per_count: u32) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(TOP);
        timer.clear_current();
        timer.enable_counter();
        Self { timer, units_per_count }
    }
}

impl Counter for SysTick {
    /// Writing the counter also restarts the division of its clock: equal work gives equal counts.
    fn restart(&mut self) {
        self.timer.clear_current();
    }

    fn read(&mut self) -> u32 {
        // Zero until the first count after a restart, then down from the top.
        let counts = match SYST::get_current() {
            0 => 0,
            left => TOP - left,
        };
        counts.wrapping_mul(self.units_per_count)
    }
}
