//! Watchdog of Arm's Cortex-M System Design Kit: counts down, interrupts at the first zero, resets at the second.
//!
//! To the core it is a line: every edge feeds it.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};

use super::Register;

const LOAD: usize = 0x000;
const CONTROL: usize = 0x008;
const INTERRUPT_CLEAR: usize = 0x00C;
const LOCK: usize = 0xC00;

const INTERRUPT_ON: u32 = 1;
const RESET_ON: u32 = 2;
const UNLOCK: u32 = 0x1ACC_E551;

/// The watchdog.
#[derive(Clone, Copy, Debug)]
pub struct CmsdkWatchdog {
    base: usize,
    interrupt_clear: Register<u32>,
}

impl CmsdkWatchdog {
    /// The watchdog whose registers start at `base`.
    ///
    /// # Safety
    /// `base` must be the address of such a watchdog.
    #[must_use]
    pub const unsafe fn at(base: usize) -> Self {
        // SAFETY: a register of the watchdog that the caller vouches for.
        Self { base, interrupt_clear: unsafe { Register::at(base + INTERRUPT_CLEAR) } }
    }

    fn register(&self, offset: usize) -> Register<u32> {
        // SAFETY: a register of the watchdog that the caller of `at` vouched for.
        unsafe { Register::at(self.base + offset) }
    }

    /// Starts it: interrupt after `ticks` of its clock without food, reset after as many more. Left unlocked, because
    /// feeding needs it.
    pub fn start(&mut self, ticks: u32) {
        self.register(LOCK).write(UNLOCK);
        self.register(LOAD).write(ticks);
        self.register(CONTROL).write(INTERRUPT_ON | RESET_ON);
    }

    fn feed(self) {
        // Any value clears the interrupt and reloads the counter.
        self.interrupt_clear.write(1);
    }
}

impl ErrorType for CmsdkWatchdog {
    type Error = Infallible;
}

impl OutputPin for CmsdkWatchdog {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.feed();
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.feed();
        Ok(())
    }
}
