//! Flies a conductor over a byte stream, in lock-step or in real time.

use std::time::{Duration, Instant};

use fsw_core::link::packet;
use fsw_core::time::FRAME;

use super::{Conductor, End, Phase, Plant, SessionError};
use crate::transport::Stream;

/// Wait for an answer before it is asked for again.
const ANSWER_PATIENCE: Duration = Duration::from_millis(500);
/// Wait for the command of a frame in lock-step before the flight goes on without it.
const FRAME_PATIENCE: Duration = Duration::from_millis(500);
/// Silence in flight after which the peer is lost.
const SILENCE: Duration = Duration::from_secs(5);

/// Whether the truth waits for the flight computer or for the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// A frame begins when the command of the frame before has come.
    LockStep,
    /// A frame begins every 20 ms, command or not.
    RealTime,
}

impl Pace {
    /// What the flight computer is told about it.
    #[must_use]
    pub const fn of_the_board(self) -> packet::Pace {
        match self {
            Self::LockStep => packet::Pace::LockStep,
            Self::RealTime => packet::Pace::RealTime,
        }
    }
}

/// Conducts a session to its end.
pub fn pump<P: Plant>(stream: &mut dyn Stream, conductor: &mut Conductor<P>, pace: Pace) -> End {
    let mut out = Vec::new();
    let mut buffer = [0u8; 4096];
    let mut heard = Instant::now();
    let mut next_frame: Option<Instant> = None;
    loop {
        let flying = conductor.status().phase == Phase::Flying;
        if flying && pace == Pace::RealTime {
            let due = *next_frame.get_or_insert_with(Instant::now);
            let waited = wait_until(stream, conductor, due, &mut buffer);
            next_frame = Some(due + Duration::from_micros(u64::from(FRAME.0)));
            match waited {
                Ok(0) => {}
                Ok(_) => heard = Instant::now(),
                Err(e) => conductor.fail(cut(conductor.status().time_s, &e)),
            }
        }
        conductor.transmit(&mut out);
        if let Some(end) = conductor.status().finished {
            return end;
        }
        if out.is_empty() && flying && pace == Pace::RealTime {
            // The command of the frame before is late: the clock does not wait for it.
            conductor.timeout();
            continue;
        }
        let written = stream.write_all(&out);
        out.clear();
        if let Err(e) = written {
            conductor.fail(cut(conductor.status().time_s, &e));
            continue;
        }
        if flying && pace == Pace::RealTime {
            continue;
        }
        let patience = if flying { FRAME_PATIENCE } else { ANSWER_PATIENCE };
        match listen(stream, conductor, patience, &mut buffer, &mut out) {
            Ok(true) => heard = Instant::now(),
            Ok(false) if flying && heard.elapsed() > SILENCE => {
                let what = format!("the frames since t = {:.2} s", conductor.status().time_s);
                let waited_s = SILENCE.as_secs_f64();
                conductor.fail(SessionError::NoAnswer { peer: "flight computer", what, waited_s });
            }
            Ok(false) => conductor.timeout(),
            Err(e) => conductor.fail(cut(conductor.status().time_s, &e)),
        }
    }
}

/// Listens until the conductor has something to say, for at most `patience`. False when it has not: bytes that change
/// nothing are as good as none.
fn listen<P: Plant>(
    stream: &mut dyn Stream,
    conductor: &mut Conductor<P>,
    patience: Duration,
    buffer: &mut [u8],
    out: &mut Vec<u8>,
) -> std::io::Result<bool> {
    let due = Instant::now() + patience;
    loop {
        let left = due.saturating_duration_since(Instant::now());
        let n = stream.read_some(buffer, left)?;
        conductor.receive(&buffer[..n]);
        conductor.transmit(out);
        if !out.is_empty() || conductor.status().finished.is_some() {
            return Ok(true);
        }
        if left.is_zero() {
            return Ok(false);
        }
    }
}

/// Listens until an instant. The number of bytes heard.
fn wait_until<P: Plant>(
    stream: &mut dyn Stream,
    conductor: &mut Conductor<P>,
    due: Instant,
    buffer: &mut [u8],
) -> std::io::Result<usize> {
    let mut heard = 0;
    while let Some(left) = due.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
        let n = stream.read_some(buffer, left)?;
        heard += n;
        conductor.receive(&buffer[..n]);
    }
    Ok(heard)
}

fn cut(time_s: f64, e: &std::io::Error) -> SessionError {
    let when = if time_s > 0.0 { format!("at t = {time_s:.2} s") } else { "before the flight".into() };
    SessionError::Cut { peer: "flight computer", when, reason: e.to_string() }
}
