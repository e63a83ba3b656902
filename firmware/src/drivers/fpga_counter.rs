//! Free-running counter of the FPGA system block of Arm's MPS2 boards, as a clock of microseconds.

use fsw_core::executive::Clock;

use super::Register;

const COUNTER: usize = 0x18;
const PRESCALE: usize = 0x1C;

/// The counter.
#[derive(Clone, Copy, Debug)]
pub struct FpgaCounter {
    counter: Register<u32>,
    prescale: Register<u32>,
}

impl FpgaCounter {
    /// The counter in the block whose registers start at `base`.
    ///
    /// # Safety
    /// `base` must be the address of such a block.
    #[must_use]
    pub const unsafe fn at(base: usize) -> Self {
        // SAFETY: registers of the block that the caller vouches for.
        unsafe { Self { counter: Register::at(base + COUNTER), prescale: Register::at(base + PRESCALE) } }
    }

    /// Makes it count microseconds.
    pub fn start(&mut self, clock_hz: u32) {
        self.prescale.write(clock_hz / 1_000_000 - 1);
    }
}

impl Clock for FpgaCounter {
    fn now_us(&mut self) -> u32 {
        self.counter.read()
    }
}
