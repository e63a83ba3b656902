//! Core-local timer of RISC-V as a watchdog: its interrupt comes when it was not moved on in time.
//!
//! To the core it is a line: every edge feeds it.

use core::convert::Infallible;
use core::num::NonZeroU64;

use embedded_hal::digital::{ErrorType, OutputPin};

use fsw_core::executive::Clock;

use super::Register;

const COMPARE: usize = 0x4000;
const TIME: usize = 0xBFF8;

/// The timer of hart 0.
#[derive(Clone, Copy, Debug)]
pub struct ClintWatchdog {
    compare: Register<u64>,
    time: Register<u64>,
    ticks: u64,
}

impl ClintWatchdog {
    /// The timer in the core-local interruptor at `base`; as a watchdog it waits `ticks` of its clock for food.
    ///
    /// # Safety
    /// `base` must be the address of a core-local interruptor.
    #[must_use]
    pub const unsafe fn at(base: usize, ticks: u64) -> Self {
        // SAFETY: registers of the device that the caller vouches for.
        unsafe { Self { compare: Register::at(base + COMPARE), time: Register::at(base + TIME), ticks } }
    }

    /// Puts the interrupt off once more: `ticks` from now.
    pub fn feed(&mut self) {
        self.compare.write(self.time.read().wrapping_add(self.ticks));
    }
}

impl ErrorType for ClintWatchdog {
    type Error = Infallible;
}

impl OutputPin for ClintWatchdog {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.feed();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.feed();
        Ok(())
    }
}

/// The time of the interruptor as a clock of microseconds.
#[derive(Clone, Copy, Debug)]
pub struct ClintClock {
    time: Register<u64>,
    ticks_per_us: NonZeroU64,
}

impl ClintClock {
    /// The time in the core-local interruptor at `base`, which counts `ticks_per_us` in a microsecond.
    ///
    /// # Safety
    /// `base` must be the address of a core-local interruptor.
    #[must_use]
    pub const unsafe fn at(base: usize, ticks_per_us: NonZeroU64) -> Self {
        // SAFETY: a register of the device that the caller vouches for.
        Self { time: unsafe { Register::at(base + TIME) }, ticks_per_us }
    }
}

impl Clock for ClintClock {
    fn now_us(&mut self) -> u32 {
        (self.time.read() / self.ticks_per_us) as u32
    }
}
