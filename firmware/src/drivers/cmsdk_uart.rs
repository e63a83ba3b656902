//! UART of Arm's Cortex-M System Design Kit: one byte of buffer each way, polled.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write};

use super::Register;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CONTROL: usize = 0x08;
const BAUD_DIVISOR: usize = 0x10;

/// The byte of the transmitter has not left yet.
const TRANSMITTER_FULL: u32 = 1;
/// A byte has come.
const RECEIVER_FULL: u32 = 2;
const TRANSMITTER_ON: u32 = 1;
const RECEIVER_ON: u32 = 2;

/// The UART.
#[derive(Clone, Copy, Debug)]
pub struct CmsdkUart {
    data: Register<u32>,
    state: Register<u32>,
    control: Register<u32>,
    baud_divisor: Register<u32>,
}

impl CmsdkUart {
    /// The UART whose registers start at `base`.
    ///
    /// # Safety
    /// `base` must be the address of such a UART.
    #[must_use]
    pub const unsafe fn at(base: usize) -> Self {
        // SAFETY: the registers of the UART that the caller vouches for.
        unsafe {
            Self {
                data: Register::at(base + DATA),
                state: Register::at(base + STATE),
                control: Register::at(base + CONTROL),
                baud_divisor: Register::at(base + BAUD_DIVISOR),
            }
        }
    }

    /// Sets the speed and switches both directions on.
    pub fn start(&mut self, clock_hz: u32, baud: u32) {
        self.baud_divisor.write(clock_hz / baud);
        self.control.write(TRANSMITTER_ON | RECEIVER_ON);
    }
}

impl ErrorType for CmsdkUart {
    type Error = Infallible;
}

impl ReadReady for CmsdkUart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.state.read() & RECEIVER_FULL != 0)
    }
}

impl Read for CmsdkUart {
    /// Waits for the first byte, then takes those that are there.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        let mut count = 0;
        for slot in buffer {
            while self.state.read() & RECEIVER_FULL == 0 {
                if count > 0 {
                    return Ok(count);
                }
            }
            *slot = self.data.read() as u8;
            count += 1;
        }
        Ok(count)
    }
}

impl Write for CmsdkUart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            while self.state.read() & TRANSMITTER_FULL != 0 {}
            self.data.write(u32::from(*byte));
        }
        Ok(bytes.len())
    }

    /// Waits until the last byte is on the line.
    fn flush(&mut self) -> Result<(), Infallible> {
        while self.state.read() & TRANSMITTER_FULL != 0 {}
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::register::Bank;

    #[test]
    fn it_sets_the_divisor_and_moves_bytes_through_its_data_register() {
        let bank = Bank::new();
        // SAFETY: the bank stands for the registers.
        let mut uart = unsafe { CmsdkUart::at(bank.base()) };
        uart.start(25_000_000, 921_600);
        assert_eq!((bank.register(BAUD_DIVISOR).read(), bank.register(CONTROL).read()), (27, 3));
        assert_eq!(uart.read_ready(), Ok(false));
        bank.register(STATE).write(RECEIVER_FULL);
        bank.register(DATA).write(0x5A);
        assert_eq!(uart.read_ready(), Ok(true));
        let mut two = [0; 2];
        assert_eq!((uart.read(&mut two), two), (Ok(2), [0x5A; 2]));
        assert_eq!(uart.write(&[1, 2, 3]), Ok(3));
        assert_eq!(bank.register(DATA).read(), 3);
    }
}
