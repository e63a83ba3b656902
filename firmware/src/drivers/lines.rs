//! Output lines that are bits of one register: a LED port, the auxiliary outputs of a UART.

use core::convert::Infallible;

use embedded_hal::digital::{ErrorType, OutputPin};

use super::Register;

/// Width of a register that can hold lines.
pub trait Bits: Copy {
    /// The register with some bits cleared and some set.
    #[must_use]
    fn change(self, clear: u8, set: u8) -> Self;
}

impl Bits for u8 {
    fn change(self, clear: u8, set: u8) -> Self {
        self & !clear | set
    }
}

impl Bits for u32 {
    fn change(self, clear: u8, set: u8) -> Self {
        self & !u32::from(clear) | u32::from(set)
    }
}

/// A register of output lines.
#[derive(Clone, Copy, Debug)]
pub struct Lines<T> {
    register: Register<T>,
}

impl<T: Bits> Lines<T> {
    /// The lines in `register`. Nothing but these drivers may write it.
    #[must_use]
    pub const fn new(register: Register<T>) -> Self {
        Self { register }
    }

    /// The line in the bits of `mask`.
    #[must_use]
    pub const fn line(self, mask: u8) -> Bit<T> {
        Bit { lines: self, mask }
    }

    /// Drives all lines of `mask` low at once.
    pub fn clear(self, mask: u8) {
        self.register.write(self.register.read().change(mask, 0));
    }
}

/// One output line.
#[derive(Clone, Copy, Debug)]
pub struct Bit<T> {
    lines: Lines<T>,
    mask: u8,
}

impl<T> ErrorType for Bit<T> {
    type Error = Infallible;
}

impl<T: Bits> OutputPin for Bit<T> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.lines.clear(self.mask);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.lines.register.write(self.lines.register.read().change(0, self.mask));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::register::Bank;

    #[test]
    fn a_line_changes_its_own_bit_only() {
        let bank = Bank::new();
        let lines = Lines::new(bank.register(0));
        let (mut arm, mut fire) = (lines.line(1), lines.line(2));
        bank.register(0).write(0x80);
        arm.set_high().unwrap();
        fire.set_high().unwrap();
        assert_eq!(bank.register(0).read(), 0x83);
        arm.set_low().unwrap();
        assert_eq!(bank.register(0).read(), 0x82);
        arm.set_high().unwrap();
        lines.clear(3);
        assert_eq!(bank.register(0).read(), 0x80);
    }
}
