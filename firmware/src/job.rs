//! [`Job`]: the link's byte stream as two files of the host, reached by semihosting. What comes up the link is read from
//! the one, what goes down is written to the other, in large pieces: the computer runs as fast as it is emulated.

use core::mem::MaybeUninit;

use embedded_hal::digital::OutputPin;
use embedded_io::{ErrorKind, ErrorType, Read, Write};
use semihosting::fs::File;
use semihosting::io::{Read as _, Write as _};
use semihosting::sys::arm_compat::sys_get_cmdline_uninit;
use static_cell::ConstStaticCell;

use crate::command_line::word;

/// Bytes moved at a time.
const PIECE: usize = 16 * 1024;
/// Longest command line.
const LINE: usize = 1_024;

/// Status of a job that was done.
pub const DONE: u8 = 0;
/// Status of a job during which the computer restarted.
pub const RESTARTED: u8 = 20;

/// Ends the emulator with this status.
pub fn exit(status: u8) -> ! {
    semihosting::process::exit(status.into())
}

/// What can go wrong with the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum JobError {
    /// The command line does not name two files.
    Usage = 10,
    /// The job file cannot be opened.
    OpenJob = 11,
    /// The answer file cannot be created.
    OpenAnswer = 12,
    /// Reading failed.
    Read = 13,
    /// Writing failed.
    Write = 14,
}

impl core::fmt::Display for JobError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Usage => "the command line does not name a job file and an answer file",
            Self::OpenJob => "the job file cannot be opened",
            Self::OpenAnswer => "the answer file cannot be created",
            Self::Read => "the job file cannot be read",
            Self::Write => "the answer file cannot be written",
        })
    }
}

impl core::error::Error for JobError {}

impl embedded_io::Error for JobError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

/// Room for a piece of each file; too large for the stack.
struct Pieces {
    coming: [u8; PIECE],
    going: [u8; PIECE],
    line: [MaybeUninit<u8>; LINE],
}

static PIECES: ConstStaticCell<Pieces> =
    ConstStaticCell::new(Pieces { coming: [0; PIECE], going: [0; PIECE], line: [MaybeUninit::new(0); LINE] });

/// The two files.
pub struct Job<W> {
    job: File,
    answer: File,
    watchdog: W,
    pieces: &'static mut Pieces,
    /// Bytes in the piece that is coming, and how many of them have been taken.
    came: usize,
    taken: usize,
    /// Bytes in the piece that is going.
    going: usize,
}

impl<W: OutputPin> Job<W> {
    /// Opens the files that the command line names; ends the emulator when that fails. Called once.
    pub fn open(watchdog: W) -> Self {
        let Some(pieces) = PIECES.try_take() else { exit(RESTARTED) };
        match open(&mut pieces.line) {
            Ok((job, answer)) => Self { job, answer, watchdog, pieces, came: 0, taken: 0, going: 0 },
            Err(error) => exit(error as u8),
        }
    }

    /// Writes what is left.
    ///
    /// # Errors
    /// The answer file.
    pub fn finish(&mut self) -> Result<(), JobError> {
        let rest = self.pieces.going.get(..self.going).unwrap_or(&[]);
        self.going = 0;
        let _ = self.watchdog.set_high();
        self.answer.write_all(rest).map_err(|_| JobError::Write)
    }
}

fn open(line: &mut [MaybeUninit<u8>; LINE]) -> Result<(File, File), JobError> {
    let length = sys_get_cmdline_uninit(line).map_err(|_| JobError::Usage)?.len();
    line.get_mut(length).ok_or(JobError::Usage)?.write(0);
    let line = line.get_mut(..=length).ok_or(JobError::Usage)?;
    // SAFETY: the call has written the bytes before `length`, and the terminator stands at it.
    let line = unsafe { line.assume_init_mut() };
    let job = File::open(word(line, 1).ok_or(JobError::Usage)?).map_err(|_| JobError::OpenJob)?;
    let answer = File::create(word(line, 2).ok_or(JobError::Usage)?).map_err(|_| JobError::OpenAnswer)?;
    Ok((job, answer))
}

impl<W> ErrorType for Job<W> {
    type Error = JobError;
}

impl<W: OutputPin> Read for Job<W> {
    /// Bytes up to the next delimiter: a board loop then serves one frame of the link in a step.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, JobError> {
        if self.taken == self.came {
            let _ = self.watchdog.set_high();
            self.came = self.job.read(&mut self.pieces.coming).map_err(|_| JobError::Read)?;
            self.taken = 0;
        }
        let rest = self.pieces.coming.get(self.taken..self.came).unwrap_or(&[]);
        let frame = rest.split_inclusive(|byte| *byte == 0).next().unwrap_or(&[]);
        let count = buffer.iter_mut().zip(frame).map(|(slot, byte)| *slot = *byte).count();
        self.taken += count;
        Ok(count)
    }
}

impl<W: OutputPin> Write for Job<W> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, JobError> {
        if self.going == PIECE {
            self.finish()?;
        }
        let room = self.pieces.going.get_mut(self.going..).unwrap_or(&mut []);
        let count = room.iter_mut().zip(bytes).map(|(slot, byte)| *slot = *byte).count();
        self.going += count;
        Ok(count)
    }

    fn flush(&mut self) -> Result<(), JobError> {
        Ok(())
    }
}
