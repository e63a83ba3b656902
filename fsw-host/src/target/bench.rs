//! A flight computer that works off files: whole recorded uplinks, at the full speed of the emulator.
//!
//! The image `bench` runs the same board as the image that flies, between two files instead of a serial line: it reads
//! the job, writes the answers and ends. Logs are flown one after the other in one boot; between two of them the
//! computer is told to restart, which only this image obeys.

use std::fs;
use std::path::PathBuf;
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fsw_core::link::framing::{DELIMITER, FrameBytes, MAX_FRAME, encode_frame};
use fsw_core::link::packet::{Command, Frame, Injection, Uplink};
use fsw_core::time::MissionTime;

use super::remote::Acknowledges;
use super::{Image, Qemu, Target, TargetError};
use crate::linklog::{Direction, LinkLog};
use crate::tap::{Heard, Tap};

/// Name of the image.
pub const BENCH_IMAGE: &str = "bench";
/// Longest wait for a job.
pub const PATIENCE: Duration = Duration::from_secs(600);

/// The bytes that went to the flight computer, in order.
#[must_use]
pub fn uplink_of(log: &LinkLog) -> Vec<u8> {
    log.records().filter(|(direction, _)| *direction == Direction::Up).flat_map(|(_, bytes)| bytes).copied().collect()
}

/// Set by nobody.
static UNDISTURBED: AtomicBool = AtomicBool::new(false);
/// Time between two looks at the interrupt.
const GLANCE: Duration = Duration::from_millis(100);

/// Flies recorded uplinks on a target, one after the other in one boot, and returns what it answered to each: the bytes
/// that a flight computer in this process would answer, apart from measured cost and identity of the build.
///
/// # Errors
/// No emulator; or the board did not do its job within `patience`, with the emulator's last words.
pub fn run(target: Target, image: &Image, logs: &[Vec<u8>], patience: Duration) -> Result<Vec<Vec<u8>>, TargetError> {
    Bench { target, image, plugin: None, interrupt: &UNDISTURBED, patience }.run(logs)
}

/// How logs are flown on a target.
#[derive(Clone, Copy, Debug)]
pub struct Bench<'a> {
    /// The processor.
    pub target: Target,
    /// Its bench image.
    pub image: &'a Image,
    /// A plugin for the emulator, with its arguments.
    pub plugin: Option<&'a str>,
    /// Set from outside to end it.
    pub interrupt: &'a AtomicBool,
    /// Longest wait for a job.
    pub patience: Duration,
}

impl Bench<'_> {
    /// As [`run`].
    ///
    /// # Errors
    /// As [`run`], and when it was interrupted.
    pub fn run(&self, logs: &[Vec<u8>]) -> Result<Vec<Vec<u8>>, TargetError> {
        let folder = Folder::new()?;
        let (job, answer) = (folder.0.join("job.bin"), folder.0.join("answer.bin"));
        fs::write(&job, job_of(logs)).map_err(TargetError::system(format!("write {}", job.display())))?;
        let files = format!("arg={BENCH_IMAGE},arg={},arg={}", job.display(), answer.display());
        let mut devices = vec!["-semihosting-config".into(), format!("enable=on,target=native,{files}")];
        devices.extend(self.plugin.into_iter().flat_map(|plugin| ["-plugin".to_owned(), plugin.to_owned()]));
        let mut qemu = Qemu::start(self.target, self.image, &devices, [Stdio::null(), Stdio::null()])?;
        self.wait(&mut qemu, logs.len())?;
        let answer = fs::read(&answer).map_err(TargetError::system(format!("read {}", answer.display())))?;
        answers_of(&answer, logs).ok_or_else(|| self.failed("its answer ends before the job does".into()))
    }

    fn wait(&self, qemu: &mut Qemu, logs: usize) -> Result<(), TargetError> {
        let due = Instant::now() + self.patience;
        loop {
            match qemu.wait(GLANCE) {
                Some(status) if status.success() => return Ok(()),
                Some(status) => return Err(self.failed(qemu.last_words(status))),
                None if self.interrupt.load(Ordering::Relaxed) => return Err(TargetError::Interrupted),
                None if Instant::now() < due => {}
                None => {
                    let patience_s = self.patience.as_secs();
                    return Err(self.failed(format!("it did not finish {logs} logs within {patience_s} s")));
                }
            }
        }
    }

    fn failed(&self, reason: String) -> TargetError {
        TargetError::Bench { target: self.target.title(), reason }
    }
}

/// The answers by log: each ends with the acknowledge of its log's last delimiter, and the one to the restart between
/// two logs belongs to neither. None when there are too few.
fn answers_of(answer: &[u8], logs: &[Vec<u8>]) -> Option<Vec<Vec<u8>>> {
    let (mut acknowledges, mut bytes) = (Acknowledges::default(), answer.iter());
    let mut next = |delimiters: usize| {
        let (mut rest, mut owed) = (Vec::new(), delimiters);
        while owed > 0 {
            owed -= acknowledges.take_out(std::slice::from_ref(bytes.next()?), &mut rest);
        }
        Some(rest)
    };
    let mut answers = Vec::with_capacity(logs.len());
    for (number, log) in logs.iter().enumerate() {
        if number > 0 {
            next(1)?;
        }
        answers.push(next(log.iter().filter(|byte| **byte == DELIMITER).count())?);
    }
    Some(answers)
}

/// The logs with a restart between each two, numbered on so that it is not taken for a repetition.
fn job_of(logs: &[Vec<u8>]) -> Vec<u8> {
    let mut job = Vec::with_capacity(logs.iter().map(|log| log.len() + MAX_FRAME).sum());
    for (number, log) in logs.iter().enumerate() {
        job.extend_from_slice(log);
        if number + 1 == logs.len() {
            break;
        }
        let (sequence, time) = last_frame(log);
        let packet = Uplink::Command(Command::Inject(Injection::Restart));
        let mut room: FrameBytes = [0; MAX_FRAME];
        let frame = Frame { sequence: sequence.wrapping_add(1), time, packet };
        // Every packet fits its own maximum size.
        job.extend_from_slice(encode_frame(&frame, &mut room).unwrap_or_default());
    }
    job
}

/// Number and time of the last packet of a log.
fn last_frame(log: &[u8]) -> (u16, MissionTime) {
    let mut last = (u16::MAX, MissionTime::ZERO);
    Tap::<Uplink>::default().feed(log, |_, heard| {
        if let Heard::Packet(frame) = heard {
            last = (frame.sequence, frame.time);
        }
    });
    last
}

/// A folder of its own, removed in the end.
pub(crate) struct Folder(pub(crate) PathBuf);

impl Folder {
    pub(crate) fn new() -> Result<Self, TargetError> {
        use std::sync::atomic::{AtomicU32, Ordering};
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("aeroshell-bench-{}-{number}", std::process::id()));
        fs::create_dir(&path).map_err(TargetError::system(format!("create {}", path.display())))?;
        Ok(Self(path))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::executive::FlightComputer;
    use fsw_core::link::packet::Hello;
    use fsw_core::link::receiver::Sender;

    fn greetings(count: usize) -> Vec<u8> {
        let (mut sender, mut room) = (Sender::new(), [0; MAX_FRAME]);
        let mut greet =
            || sender.encode(MissionTime::ZERO, &Uplink::Hello(Hello::ours(1)), &mut room).unwrap().to_vec();
        (0..count).flat_map(|_| greet()).collect()
    }

    /// The board of the bench image, in this process.
    fn board(job: &[u8]) -> Vec<u8> {
        let (mut computer, mut answer) = (Box::new(FlightComputer::new(7)), Vec::new());
        computer.allow_restart();
        for frame in job.split_inclusive(|byte| *byte == DELIMITER) {
            computer.receive(frame, |bytes| answer.extend_from_slice(bytes));
            answer.push(DELIMITER);
            computer.restart_if_asked();
        }
        answer
    }

    #[test]
    fn each_log_of_a_job_is_answered_as_if_it_were_alone() {
        let logs = [greetings(3), greetings(1), Vec::new(), greetings(2)];
        let answers = answers_of(&board(&job_of(&logs)), &logs).unwrap();
        for (log, answer) in logs.iter().zip(&answers) {
            let mut alone = Vec::new();
            FlightComputer::new(7).receive(log, |bytes| alone.extend_from_slice(bytes));
            assert_eq!(answer, &alone);
        }
    }

    #[test]
    fn an_answer_that_ends_early_is_none() {
        let logs = [greetings(3), greetings(1)];
        let whole = board(&job_of(&logs));
        assert_eq!(answers_of(&whole[..whole.len() - 1], &logs), None);
    }
}
