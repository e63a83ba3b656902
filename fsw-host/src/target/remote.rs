//! A flight computer at the other end of a byte stream.
//!
//! The board answers each delimiter it receives with everything that follows from it and then one more `0x00`: an empty
//! frame, the acknowledge. So in lock-step this end knows that the board is done when as many empty frames have come
//! back as delimiters were sent. It takes them out: what is handed on equals the answer of a computer in this process.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fsw_core::link::framing::DELIMITER;
use fsw_core::link::packet::{Downlink, EventKind, RestartReport};
use hil_sim::transport::Stream;

use super::Qemu;
use crate::ends::{ComputerEnd, ComputerError};
use crate::tap::{Heard, Tap};

/// How long the board may think, or be held up by a busy computer, in lock-step.
const PATIENCE: Duration = Duration::from_secs(20);
/// Silence after which a greeting is repeated.
const GREETING_PATIENCE: Duration = Duration::from_millis(500);
/// Silence on a line that can lose bytes after which an answer counts as lost and the flight goes on.
const LOSS_PATIENCE: Duration = Duration::from_secs(1);
/// Silence after which a board that has just been greeted has said all, and the most pieces that it may say it in.
const SETTLING: Duration = Duration::from_millis(50);
const SETTLING_CHUNKS: usize = 100;
/// Pieces in which silence is waited for, so that an interrupt is noticed.
const STEP: Duration = Duration::from_millis(200);

/// See the [module](self).
pub struct RemoteComputer {
    stream: Box<dyn Stream>,
    place: String,
    /// The emulator behind the stream; a real line can lose bytes, an emulated one cannot.
    emulator: Option<Qemu>,
    interrupt: &'static AtomicBool,
    acknowledges: Acknowledges,
    session: Session,
    /// Delimiters sent that were not acknowledged yet.
    owed: usize,
    /// The board has answered once, and nothing sent before that is outstanding any more.
    in_step: bool,
    /// When something was heard last, or the flight computer was first talked to.
    heard: Option<Instant>,
    patience: Duration,
}

impl RemoteComputer {
    /// A computer behind a stream that it has not spoken on yet. `place` names it in errors.
    #[must_use]
    pub fn new(stream: Box<dyn Stream>, place: String, interrupt: &'static AtomicBool) -> Self {
        Self {
            stream,
            place,
            emulator: None,
            interrupt,
            acknowledges: Acknowledges::default(),
            session: Session::default(),
            owed: 0,
            in_step: false,
            heard: None,
            patience: PATIENCE,
        }
    }

    /// The same, in an emulator that lives as long as this does.
    #[must_use]
    pub fn in_emulator(mut self, emulator: Qemu) -> Self {
        self.emulator = Some(emulator);
        self
    }

    /// Another patience with a board that says nothing.
    #[must_use]
    pub fn with_patience(mut self, patience: Duration) -> Self {
        self.patience = patience;
        self
    }

    /// Forgets the session with a board that has restarted: it is about to be greeted anew, and owes nothing.
    pub fn start_over(&mut self) {
        self.owed = 0;
        self.in_step = false;
        self.heard = None;
        self.session = Session::default();
    }

    fn lost(&mut self, error: &io::Error) -> ComputerError {
        // A stream that ends is how the end of an emulator shows first.
        let ended = self.emulator.as_mut().and_then(|qemu| {
            qemu.wait(Duration::from_millis(200));
            qemu.ended()
        });
        ComputerError::Lost { place: self.place.clone(), reason: ended.unwrap_or_else(|| error.to_string()) }
    }

    /// Listens once, for at most `wait`. Whether anything came.
    fn listen(&mut self, wait: Duration, from_computer: &mut Vec<u8>) -> Result<bool, ComputerError> {
        let mut buffer = [0u8; 4096];
        let n = self.stream.read_some(&mut buffer, wait).map_err(|e| self.lost(&e))?;
        if n > 0 {
            self.heard = Some(Instant::now());
        }
        for piece in buffer[..n].split_inclusive(|byte| *byte == DELIMITER) {
            let before = from_computer.len();
            let acknowledged = self.acknowledges.take_out(piece, from_computer);
            if let Some(report) = self.session.listen(&from_computer[before..]) {
                return Err(ComputerError::Restarted { place: self.place.clone(), report });
            }
            // What comes before the answer to the greeting acknowledges packets of an earlier session.
            if self.session.greeted {
                self.owed = self.owed.saturating_sub(acknowledged);
            }
        }
        Ok(n > 0)
    }

    /// After the first answer: takes what the board still acknowledges. One that has restarted may have found the end of an
    /// earlier session's packet in front of the greeting, and answers both before it acknowledges either.
    fn settle(&mut self, from_computer: &mut Vec<u8>) -> Result<(), ComputerError> {
        for _ in 0..SETTLING_CHUNKS {
            if !self.listen(SETTLING, from_computer)? {
                break;
            }
        }
        self.owed = 0;
        self.in_step = true;
        Ok(())
    }

    /// What silence means after it has lasted so long: go on waiting, give this answer up, or give the board up.
    fn judge_silence(&mut self, silence: Duration, anything_came: bool) -> Result<Waiting, ComputerError> {
        let total = self.heard.map_or(Duration::ZERO, |heard| heard.elapsed());
        if !self.in_step {
            if silence < GREETING_PATIENCE {
                return Ok(Waiting::GoOn);
            }
            // It answers by now; greetings of before it listened will never be acknowledged.
            if anything_came {
                self.owed = 0;
            }
            return Ok(Waiting::GiveUp);
        }
        if total >= self.patience {
            return Err(ComputerError::Silent { place: self.place.clone(), waited_s: self.patience.as_secs() });
        }
        if self.emulator.is_none() && silence >= LOSS_PATIENCE {
            self.owed = 0;
            return Ok(Waiting::GiveUp);
        }
        Ok(Waiting::GoOn)
    }
}

enum Waiting {
    GoOn,
    GiveUp,
}

impl ComputerEnd for RemoteComputer {
    fn exchange(
        &mut self,
        to_computer: &[u8],
        from_computer: &mut Vec<u8>,
        until: Option<Instant>,
    ) -> Result<(), ComputerError> {
        self.owed += to_computer.iter().filter(|byte| **byte == DELIMITER).count();
        self.stream.write_all(to_computer).map_err(|e| self.lost(&e))?;
        let before = from_computer.len();
        let mut quiet_since = Instant::now();
        self.heard.get_or_insert(quiet_since);
        while self.owed > 0 {
            if self.interrupt.load(Ordering::Relaxed) {
                return Err(ComputerError::Interrupted);
            }
            let now = Instant::now();
            let left = until.map_or(STEP, |until| until.saturating_duration_since(now).min(STEP));
            if until.is_some() && left.is_zero() {
                return Ok(());
            }
            if self.listen(left, from_computer)? {
                quiet_since = Instant::now();
            } else if let Waiting::GiveUp = self.judge_silence(now - quiet_since, from_computer.len() > before)? {
                break;
            }
        }
        if from_computer.len() > before && self.owed == 0 && !self.in_step {
            self.settle(from_computer)?;
        }
        Ok(())
    }
}

/// What the board says of the session: its beginning, and a restart that it does not survive.
#[derive(Default)]
struct Session {
    tap: Tap<Downlink>,
    /// The board has answered a greeting.
    greeted: bool,
    /// The board has obeyed commands: a restart from now on loses them. Before, it tells of one of long ago.
    obeys: bool,
}

impl Session {
    fn listen(&mut self, bytes: &[u8]) -> Option<RestartReport> {
        let (mut report, obeys, greeted) = (None, &mut self.obeys, &mut self.greeted);
        self.tap.feed(bytes, |_, heard| match heard {
            Heard::Packet(frame) => match frame.packet {
                Downlink::Hello(_) => *greeted = true,
                Downlink::CommandReply(_) => *obeys = true,
                Downlink::Event(event) => {
                    if let (EventKind::Restarted(found), true) = (event.kind, *obeys) {
                        report = Some(found);
                    }
                }
                _ => {}
            },
            Heard::Damaged(_) | Heard::Nothing => {}
        });
        report
    }
}

/// Tells acknowledges from the rest of the stream.
#[derive(Debug)]
pub(super) struct Acknowledges {
    /// The byte before was a delimiter, or there was none.
    between_frames: bool,
}

impl Default for Acknowledges {
    fn default() -> Self {
        Self { between_frames: true }
    }
}

impl Acknowledges {
    /// Appends what is no acknowledge; the number of those that are.
    pub(super) fn take_out(&mut self, bytes: &[u8], rest: &mut Vec<u8>) -> usize {
        let mut count = 0;
        for &byte in bytes {
            let delimiter = byte == DELIMITER;
            if delimiter && self.between_frames {
                count += 1;
            } else {
                rest.push(byte);
            }
            self.between_frames = delimiter;
        }
        count
    }
}

#[cfg(test)]
#[path = "remote_tests.rs"]
mod tests;
