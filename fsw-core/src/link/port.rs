//! The byte stream of the hardware behind `embedded-io`: a serial line, a socket, a pseudo-terminal.
//!
//! The provided `write_all` of `embedded-io` panics when a driver takes no byte; this one gives up after
//! [`MAX_IDLE_CALLS`] and says so. No call loops without a bound.

use core::fmt;

use embedded_io::{Error, ErrorKind, Read, Write};

/// Consecutive writes or reads that a driver may leave without effect before the port gives up.
pub const MAX_IDLE_CALLS: u32 = 1_000;

/// Why bytes could not be moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum PortError {
    /// The other end closed the stream.
    Closed,
    /// Reading failed.
    Read(ErrorKind),
    /// Writing failed.
    Write(ErrorKind),
    /// The driver took no byte in [`MAX_IDLE_CALLS`] attempts; so many of the bytes were taken before.
    Stuck {
        /// Bytes that left.
        written: usize,
    },
}

impl fmt::Display for PortError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => f.write_str("the other end closed the link"),
            Self::Read(kind) => write!(f, "reading from the link failed: {kind}"),
            Self::Write(kind) => write!(f, "writing to the link failed: {kind}"),
            Self::Stuck { written } => write!(f, "the link takes no more bytes after {written}"),
        }
    }
}

impl core::error::Error for PortError {}

/// Both directions of the link over one `embedded-io` stream.
#[derive(Clone, Debug)]
pub struct Port<S> {
    stream: S,
}

impl<S: Read + Write> Port<S> {
    /// A port over a stream.
    pub const fn new(stream: S) -> Self {
        Self { stream }
    }

    /// The stream itself, for set-up and counters of the driver.
    pub const fn stream_mut(&mut self) -> &mut S {
        &mut self.stream
    }

    /// Waits for bytes and returns those that came, at least one. An interrupted read is repeated.
    ///
    /// # Errors
    /// [`PortError::Closed`] when the stream has ended, [`PortError::Read`] when the driver fails.
    pub fn receive<'b>(&mut self, buffer: &'b mut [u8]) -> Result<&'b [u8], PortError> {
        for _ in 0..MAX_IDLE_CALLS {
            match self.stream.read(buffer) {
                // A driver that claims more than the buffer holds has filled the buffer.
                Ok(count) if count > 0 => return Ok(buffer.get(..count).unwrap_or(&[])),
                Ok(_) => return Err(PortError::Closed),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(PortError::Read(error.kind())),
            }
        }
        Err(PortError::Read(ErrorKind::Interrupted))
    }

    /// Sends all bytes and flushes. A write that takes only a part is continued, an interrupted one repeated.
    ///
    /// # Errors
    /// [`PortError::Write`] when the driver fails, [`PortError::Stuck`] when it takes nothing. Part of the bytes may
    /// have left: the receiver finds its way at the next delimiter.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), PortError> {
        let mut rest = bytes;
        let mut idle = 0;
        // Every turn either shortens the rest or counts as idle.
        while !rest.is_empty() {
            match self.stream.write(rest) {
                Ok(count) if count > 0 => {
                    rest = rest.get(count..).unwrap_or(&[]);
                    idle = 0;
                }
                Err(error) if error.kind() != ErrorKind::Interrupted => return Err(PortError::Write(error.kind())),
                Ok(_) | Err(_) => idle += 1,
            }
            if idle >= MAX_IDLE_CALLS {
                return Err(PortError::Stuck { written: bytes.len() - rest.len() });
            }
        }
        self.stream.flush().map_err(|error| PortError::Write(error.kind()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embedded_io::ErrorType;
    use std::collections::VecDeque;
    use std::vec::Vec;

    /// A driver that follows a script, one step per call, and then does all that is asked.
    #[derive(Default)]
    struct Driver {
        incoming: VecDeque<u8>,
        script: VecDeque<Step>,
        sent: Vec<u8>,
        flushes: u32,
    }

    #[derive(Clone, Copy)]
    enum Step {
        /// Move at most this many bytes.
        AtMost(usize),
        /// Fail.
        Fail(ErrorKind),
    }

    impl Driver {
        fn scripted(steps: &[Step]) -> Self {
            Self { script: steps.iter().copied().collect(), ..Self::default() }
        }

        fn limit(&mut self) -> Result<usize, ErrorKind> {
            match self.script.pop_front() {
                Some(Step::AtMost(count)) => Ok(count),
                Some(Step::Fail(kind)) => Err(kind),
                None => Ok(usize::MAX),
            }
        }
    }

    impl ErrorType for Driver {
        type Error = ErrorKind;
    }

    impl Read for Driver {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
            let count = self.limit()?.min(buffer.len()).min(self.incoming.len());
            buffer.iter_mut().zip(self.incoming.drain(..count)).for_each(|(slot, byte)| *slot = byte);
            Ok(count)
        }
    }

    impl Write for Driver {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            let count = self.limit()?.min(bytes.len());
            self.sent.extend_from_slice(&bytes[..count]);
            Ok(count)
        }

        fn flush(&mut self) -> Result<(), ErrorKind> {
            self.flushes += 1;
            Ok(())
        }
    }

    #[test]
    fn the_mock_moves_what_its_script_allows() {
        let mut driver = Driver::scripted(&[Step::AtMost(2), Step::Fail(ErrorKind::TimedOut), Step::AtMost(0)]);
        assert_eq!(driver.write(b"abc"), Ok(2));
        assert_eq!(driver.write(b"c"), Err(ErrorKind::TimedOut));
        assert_eq!(driver.write(b"c"), Ok(0));
        assert_eq!(driver.write(b"c"), Ok(1));
        assert_eq!(driver.sent, b"abc");
        driver.incoming.extend(b"xyz");
        let mut buffer = [0; 2];
        assert_eq!((driver.read(&mut buffer), buffer), (Ok(2), *b"xy"));
        assert_eq!((driver.read(&mut buffer), buffer[0]), (Ok(1), b'z'));
        assert_eq!(driver.read(&mut buffer), Ok(0));
    }

    #[test]
    fn partial_and_interrupted_writes_lose_and_double_nothing() {
        let mut port = Port::new(Driver::scripted(&[
            Step::AtMost(1),
            Step::Fail(ErrorKind::Interrupted),
            Step::AtMost(0),
            Step::AtMost(3),
        ]));
        assert_eq!(port.send(b"aeroshell"), Ok(()));
        assert_eq!(port.stream_mut().sent, b"aeroshell");
        assert_eq!(port.stream_mut().flushes, 1);
    }

    #[test]
    fn partial_and_interrupted_reads_deliver_every_byte_in_order() {
        let mut driver = Driver::scripted(&[Step::Fail(ErrorKind::Interrupted), Step::AtMost(2), Step::AtMost(1)]);
        driver.incoming.extend(b"aeroshell");
        let mut port = Port::new(driver);
        let (mut got, mut buffer) = (Vec::new(), [0; 4]);
        while let Ok(bytes) = port.receive(&mut buffer) {
            got.extend_from_slice(bytes);
        }
        assert_eq!(got, b"aeroshell");
        assert_eq!(port.receive(&mut buffer), Err(PortError::Closed));
    }

    #[test]
    fn failures_of_the_driver_are_passed_on_by_kind() {
        let mut port = Port::new(Driver::scripted(&[Step::Fail(ErrorKind::BrokenPipe), Step::Fail(ErrorKind::Other)]));
        assert_eq!(port.send(b"x"), Err(PortError::Write(ErrorKind::BrokenPipe)));
        assert_eq!(port.receive(&mut [0; 4]), Err(PortError::Read(ErrorKind::Other)));
    }

    #[test]
    fn a_driver_that_takes_nothing_does_not_hang_the_loop() {
        let mut steps = std::vec![Step::AtMost(2)];
        steps.extend([Step::AtMost(0)].repeat(MAX_IDLE_CALLS as usize));
        let mut port = Port::new(Driver::scripted(&steps));
        assert_eq!(port.send(b"abc"), Err(PortError::Stuck { written: 2 }));
        let endless = [Step::Fail(ErrorKind::Interrupted)].repeat(MAX_IDLE_CALLS as usize);
        let mut port = Port::new(Driver::scripted(&endless));
        assert_eq!(port.receive(&mut [0; 4]), Err(PortError::Read(ErrorKind::Interrupted)));
    }
}
