//! UART of the 16550 family, polled. Its two auxiliary outputs OUT1 and OUT2 serve as discrete lines.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write};

use super::{Lines, Register};

const DATA: usize = 0;
const INTERRUPT_ENABLE: usize = 1;
const FIFO_CONTROL: usize = 2;
const LINE_CONTROL: usize = 3;
const MODEM_CONTROL: usize = 4;
const LINE_STATUS: usize = 5;

/// FIFO on, told when 14 bytes wait: polling does not care, but QEMU fills the buffer only this way.
const FIFO_DEEP: u8 = 0xC1;
const EIGHT_BITS: u8 = 3;
const DIVISOR_ACCESS: u8 = 0x80;
const DATA_READY: u8 = 1;
const TRANSMITTER_EMPTY: u8 = 0x20;

/// Auxiliary output 1 among [`Ns16550::outputs`].
pub const OUT1: u8 = 4;
/// Auxiliary output 2 among [`Ns16550::outputs`].
pub const OUT2: u8 = 8;

/// The UART.
#[derive(Clone, Copy, Debug)]
pub struct Ns16550 {
    base: usize,
    data: Register<u8>,
    line_status: Register<u8>,
    /// A byte that came before the buffers were switched on, which empties them.
    early: Option<u8>,
}

impl Ns16550 {
    /// The UART whose registers start at `base`, one byte apart.
    ///
    /// # Safety
    /// `base` must be the address of such a UART.
    #[must_use]
    pub const unsafe fn at(base: usize) -> Self {
        // SAFETY: the registers of the UART that the caller vouches for.
        unsafe {
            Self { base, data: Register::at(base + DATA), line_status: Register::at(base + LINE_STATUS), early: None }
        }
    }

    const fn register(&self, offset: usize) -> Register<u8> {
        // SAFETY: the registers of the UART that the caller of `at` vouched for.
        unsafe { Register::at(self.base + offset) }
    }

    /// Sets the speed, eight bits, deep buffers, no interrupts.
    pub fn start(&mut self, clock_hz: u32, baud: u32) {
        let divisor = clock_hz / (16 * baud);
        let [low, high, ..] = if divisor == 0 { [1, 0, 0, 0] } else { divisor.to_le_bytes() };
        // At once after each other, because the switch forgets what comes in between.
        self.early = (self.line_status.read() & DATA_READY != 0).then(|| self.data.read());
        self.register(FIFO_CONTROL).write(FIFO_DEEP);
        self.register(LINE_CONTROL).write(DIVISOR_ACCESS);
        self.register(DATA).write(low);
        self.register(INTERRUPT_ENABLE).write(high);
        self.register(LINE_CONTROL).write(EIGHT_BITS);
        self.register(INTERRUPT_ENABLE).write(0);
    }

    /// The auxiliary outputs, [`OUT1`] and [`OUT2`].
    #[must_use]
    pub const fn outputs(&self) -> Lines<u8> {
        Lines::new(self.register(MODEM_CONTROL))
    }
}

impl ErrorType for Ns16550 {
    type Error = Infallible;
}

impl ReadReady for Ns16550 {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.early.is_some() || self.line_status.read() & DATA_READY != 0)
    }
}

impl Read for Ns16550 {
    /// Waits for the first byte, then takes those that are there.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let mut count = 0;
        for slot in buffer {
            if let Some(byte) = self.early.take() {
                *slot = byte;
                count += 1;
                continue;
            }
            while self.line_status.read() & DATA_READY == 0 {
                if count > 0 {
                    return Ok(count);
                }
            }
            *slot = self.data.read();
            count += 1;
        }
        Ok(count)
    }
}

impl Write for Ns16550 {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            while self.line_status.read() & TRANSMITTER_EMPTY == 0 {}
            self.data.write(*byte);
        }
        Ok(bytes.len())
    }

    /// Waits until the buffer is empty.
    fn flush(&mut self) -> Result<(), Infallible> {
        while self.line_status.read() & TRANSMITTER_EMPTY == 0 {}
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::register::Bank;
    use embedded_hal::digital::OutputPin;

    #[test]
    fn a_byte_that_came_before_the_set_up_is_kept() {
        let bank = Bank::new();
        // SAFETY: the bank stands for the registers.
        let mut uart = unsafe { Ns16550::at(bank.base()) };
        uart.data.write(0x5A);
        uart.line_status.write(DATA_READY);
        uart.start(3_686_400, 115_200);
        uart.line_status.write(0);
        let mut two = [0; 2];
        assert_eq!((uart.read_ready(), uart.read(&mut two), two[0]), (Ok(true), Ok(1), 0x5A));
    }

    #[test]
    fn it_sets_up_deep_buffers_and_drives_its_outputs_without_touching_the_line() {
        let bank = Bank::new();
        // SAFETY: the bank stands for the registers.
        let mut uart = unsafe { Ns16550::at(bank.base()) };
        uart.start(3_686_400, 115_200);
        assert_eq!([uart.register(FIFO_CONTROL).read(), uart.register(LINE_CONTROL).read()], [0xC1, 3]);
        assert_eq!(uart.data.read(), 2, "the divisor went through the data register");
        assert_eq!(uart.read_ready(), Ok(false));
        uart.line_status.write(DATA_READY | TRANSMITTER_EMPTY);
        uart.data.write(0x5A);
        let mut one = [0; 1];
        assert_eq!((uart.read(&mut one), one), (Ok(1), [0x5A]));
        assert_eq!(uart.write(&[1, 2]), Ok(2));
        uart.outputs().line(OUT2).set_high().unwrap();
        assert_eq!(uart.register(MODEM_CONTROL).read(), OUT2);
    }
}
