//! The debugger's console as a byte stream: the log channel of a board without a second UART.

use core::convert::Infallible;

use embedded_io::{ErrorType, Write};
use semihosting::sys::arm_compat::sys_writec;

/// The console.
#[derive(Clone, Copy, Debug)]
pub struct SemihostingLog;

impl ErrorType for SemihostingLog {
    type Error = Infallible;
}

impl Write for SemihostingLog {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        bytes.iter().copied().for_each(sys_writec);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}
