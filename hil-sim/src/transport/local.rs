//! A pair of connected sockets: a byte stream to a child process, which inherits the other end.

use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use super::{Stream, ended, is_timeout};

/// Our end of a pair.
pub struct Local {
    stream: UnixStream,
    patience: Option<Duration>,
}

impl Local {
    /// Our end, and the one to hand over. The stream ends when nobody holds that one any more.
    ///
    /// # Errors
    /// The system has none left.
    pub fn pair() -> io::Result<(Self, OwnedFd)> {
        let (ours, theirs) = UnixStream::pair()?;
        Ok((Self { stream: ours, patience: None }, theirs.into()))
    }
}

impl Stream for Local {
    fn read_some(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        // The system takes a timeout of zero for "for ever".
        let patience = patience.max(Duration::from_millis(1));
        if self.patience != Some(patience) {
            self.stream.set_read_timeout(Some(patience))?;
            self.patience = Some(patience);
        }
        match self.stream.read(buffer) {
            Ok(0) => Err(ended()),
            Ok(n) => Ok(n),
            Err(e) if is_timeout(&e) => Ok(0),
            Err(e) => Err(e),
        }
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.stream.write_all(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_go_both_ways_and_the_end_shows() {
        let (mut ours, theirs) = Local::pair().unwrap();
        let mut theirs = UnixStream::from(theirs);
        let mut buffer = [0; 4];
        ours.write_all(&[1, 2]).unwrap();
        assert_eq!((theirs.read(&mut buffer).unwrap(), &buffer[..2]), (2, &[1, 2][..]));
        theirs.write_all(&[3]).unwrap();
        assert_eq!(ours.read_some(&mut buffer, Duration::from_secs(5)).unwrap(), 1);
        assert_eq!(ours.read_some(&mut buffer, Duration::from_millis(1)).unwrap(), 0);
        drop(theirs);
        assert_eq!(ours.read_some(&mut buffer, Duration::ZERO).unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
    }
}
