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
    let port = serialport::new(device, baud).open().map_err(|e| failed(reason(&e)))?;
    // What came before anybody listened belongs to nobody.
    port.clear(serialport::ClearBuffer::Input).map_err(|e| failed(reason(&e)))?;
    Ok(Box::new(Serial { port }))
}

/// An error of the library in the words of a user.
fn reason(e: &serialport::Error) -> String {
    let text = e.description.to_lowercase();
    if text.contains("busy") || text.contains("exclusive lock") {
        "the port is busy: another program has it open".into()
    } else if text.contains("no such file") {
        "no such device".into()
    } else if text.contains("permission denied") {
        "permission denied: on Debian the group `dialout` may use serial lines".into()
    } else if text.contains("inappropriate ioctl") || text.contains("not a typewriter") {
        "it is no serial line".into()
    } else {
        e.description.clone()
    }
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

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::transport::PtyPair;

    fn refusal(place: &str) -> String {
        open_serial(place).err().map(|e| e.to_string()).unwrap_or_default()
    }

    #[test]
    fn a_line_is_ours_alone_and_says_so() {
        let pair = PtyPair::open().unwrap();
        let place = format!("{}:115200", pair.slave_path.display());
        let line = open_serial(&place).unwrap();
        assert_eq!(refusal(&place), format!("serial:{place}: the port is busy: another program has it open"));
        drop(line);
        open_serial(&place).unwrap();
    }

    #[test]
    fn what_is_no_serial_line_is_refused_by_name() {
        assert_eq!(refusal("/dev/nonexistent:9600"), "serial:/dev/nonexistent:9600: no such device");
        assert_eq!(refusal("/dev/null:9600"), "serial:/dev/null:9600: it is no serial line");
        assert!(refusal("/dev/null").contains("expected DEVICE:BAUD"));
    }
}
