//! Serial lines: eight bits, no parity, one stop bit, no flow control.

use std::io::{self, Read, Write};
use std::time::Duration;

use super::{Stream, ended, is_timeout};
use crate::session::SessionError;

struct Serial {
    port: Box<dyn serialport::SerialPort>,
}

/// Opens `DEVICE:BAUD`.
///
/// # Errors
/// A sentence with the device.
pub fn open_serial(device_and_baud: &str) -> Result<Box<dyn Stream>, SessionError> {
    let failed = |reason: String| SessionError::Open { place: format!("serial:{device_and_baud}"), reason };
    let (device, baud) = device_and_baud
        .rsplit_once(':')
        .and_then(|(device, baud)| Some((device, baud.parse::<u32>().ok()?)))
        .ok_or_else(|| failed("expected DEVICE:BAUD, as in /dev/ttyUSB0:921600".into()))?;
    let port = serialport::new(device, baud).open().map_err(|e| failed(e.to_string()))?;
    Ok(Box::new(Serial { port }))
}

impl Stream for Serial {
    fn read_some(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        if self.port.timeout() != patience {
            self.port.set_timeout(patience).map_err(io::Error::from)?;
        }
        match self.port.read(buffer) {
            Ok(0) => Err(ended()),
            Ok(n) => Ok(n),
            Err(e) if is_timeout(&e) => Ok(0),
            Err(e) => Err(e),
        }
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.write_all(bytes)
    }
}
