//! Byte streams to a peer: TCP, pty, serial line, child process. All block for at most a given time.

#[cfg(unix)]
mod local;
#[cfg(unix)]
mod pty;
mod serial;
mod tcp;

use std::io;
use std::time::Duration;

#[cfg(unix)]
pub use local::Local;
#[cfg(unix)]
pub use pty::{Pty, PtyPair, open_terminal};
pub use serial::open_serial;
pub use tcp::{Listener, Tcp};

/// A byte stream in both directions.
pub trait Stream: Send {
    /// Reads what is there, waiting for the first byte for at most `patience`. 0 when nothing came.
    ///
    /// # Errors
    /// The stream has ended ([`io::ErrorKind::UnexpectedEof`]) or failed.
    fn read_some(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize>;

    /// Writes all bytes.
    ///
    /// # Errors
    /// The stream has ended or failed.
    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()>;
}

/// Whether an error only says that no byte came in time.
fn is_timeout(e: &io::Error) -> bool {
    matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

/// The error of a stream whose other end is gone.
fn ended() -> io::Error {
    io::Error::new(io::ErrorKind::UnexpectedEof, "the other end closed it")
}
