//! Pseudo-terminals: a serial line without the hardware.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::termios::{SetArg, cfmakeraw, tcgetattr, tcsetattr};

use super::{Stream, ended, is_timeout};
use crate::session::SessionError;

/// One end of a pseudo-terminal, or any terminal device, in raw mode.
pub struct Pty {
    file: File,
}

/// Both ends of a new pseudo-terminal.
pub struct PtyPair {
    /// The end that is kept.
    pub master: Pty,
    /// Path of the end for the peer.
    pub slave_path: PathBuf,
    /// The peer's end held open: while nobody has it open, reading the master fails.
    pub slave: OwnedFd,
}

impl PtyPair {
    /// Opens a pair in raw mode.
    ///
    /// # Errors
    /// The system has none left, or does not allow it.
    pub fn open() -> Result<Self, SessionError> {
        let failed = |e: nix::Error| SessionError::Open { place: "pty".into(), reason: e.to_string() };
        let pair = nix::pty::openpty(None, None).map_err(failed)?;
        make_raw(&pair.slave).map_err(failed)?;
        let slave_path = nix::unistd::ttyname(&pair.slave).map_err(failed)?;
        Ok(Self { master: Pty { file: pair.master.into() }, slave_path, slave: pair.slave })
    }
}

/// Opens a terminal device, as the peer's end of a pseudo-terminal, in raw mode.
///
/// # Errors
/// A sentence with the device.
pub fn open_terminal(path: &Path) -> Result<Pty, SessionError> {
    let failed = |reason: String| SessionError::Open { place: path.display().to_string(), reason };
    let file = OpenOptions::new().read(true).write(true).open(path).map_err(|e| {
        failed(if e.kind() == io::ErrorKind::NotFound { "no such device".into() } else { e.to_string() })
    })?;
    make_raw(&file).map_err(|e| failed(format!("not a terminal: {e}")))?;
    Ok(Pty { file })
}

impl From<OwnedFd> for Pty {
    fn from(fd: OwnedFd) -> Self {
        Self { file: fd.into() }
    }
}

/// No echo, no line editing, no translation: every byte goes through as it is.
fn make_raw(terminal: &impl AsFd) -> nix::Result<()> {
    let mut settings = tcgetattr(terminal)?;
    cfmakeraw(&mut settings);
    tcsetattr(terminal, SetArg::TCSANOW, &settings)
}

impl Stream for Pty {
    fn read_some(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let millis = u16::try_from(patience.as_millis().max(1)).unwrap_or(u16::MAX);
        let mut waiting = [PollFd::new(self.file.as_fd(), PollFlags::POLLIN)];
        match poll(&mut waiting, PollTimeout::from(millis)) {
            Ok(0) | Err(nix::Error::EINTR) => return Ok(0),
            Ok(_) => {}
            Err(e) => return Err(e.into()),
        }
        match self.file.read(buffer) {
            Ok(0) => Err(ended()),
            Ok(n) => Ok(n),
            Err(e) if is_timeout(&e) => Ok(0),
            // The other end of a pseudo-terminal is closed.
            Err(e) if e.raw_os_error() == Some(nix::Error::EIO as i32) => Err(ended()),
            Err(e) => Err(e),
        }
    }

    fn write_all(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)
    }
}
