//! A truth simulator that serves flights to a host: the preamble on the stream before the session proper.
//!
//! The client (`aeroshell fly --truth …`) says which protocol it speaks, sends the resolved scenario and starts the
//! flight; from then on the stream carries the session of [`super::Conductor`].

use std::io;
use std::time::{Duration, Instant};

use fsw_core::link::framing::{Decoder, FrameBytes, MAX_FRAME, decode, encode};
use fsw_core::link::schema::SCHEMA_HASH;
use serde::{Deserialize, Serialize};

use super::pump::{Pace, pump};
use super::{Conductor, End, SessionError};
use crate::scenario::Scenario;
use crate::transport::Stream;

/// Version of the preamble.
pub const BENCH_VERSION: u16 = 1;
/// Longest piece of text in one message, bytes.
const TEXT_PIECE: usize = 128;
/// Longest scenario, bytes: ten times a scenario with two full tables.
const MAX_SCENARIO: usize = 1 << 20;
/// Messages after which a peer that still has not come to the point is given up.
const MAX_MESSAGES: usize = 2 * MAX_SCENARIO / TEXT_PIECE;
/// Longest refusal that is listened to, bytes.
const MAX_REFUSAL: usize = 4096;
/// Wait for the next message of the preamble.
const PATIENCE: Duration = Duration::from_secs(5);

/// Messages of the preamble, both directions. `Hello` stays first for ever, so that any version understands it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
enum Message<'a> {
    /// First message of either side.
    Hello { version: u16, schema_hash: u64 },
    /// Client: the next piece of the scenario, TOML.
    Scenario { text: &'a str },
    /// Client: the scenario is complete, fly.
    Start { seed: u64, run: u64, nominal: bool },
    /// Server: the session begins.
    Ready,
    /// Server: what is wrong; pieces until an empty one.
    Error { text: &'a str },
}

const HELLO: Message<'static> = Message::Hello { version: BENCH_VERSION, schema_hash: SCHEMA_HASH };

/// Reads messages of the preamble one by one.
#[derive(Default)]
struct Inbox {
    decoder: Decoder,
    waiting: Vec<u8>,
}

impl Inbox {
    /// Waits for the next message and hands it to `take`. Bytes that are no message are skipped.
    fn next<T>(
        &mut self,
        stream: &mut dyn Stream,
        peer: &'static str,
        mut take: impl FnMut(Message<'_>) -> T,
    ) -> Result<T, SessionError> {
        let deadline = Instant::now() + PATIENCE;
        let mut buffer = [0u8; 1024];
        loop {
            for k in 0..self.waiting.len() {
                let message =
                    self.decoder.push(self.waiting[k]).and_then(Result::ok).and_then(|p| decode(p).ok()).map(&mut take);
                if let Some(taken) = message {
                    self.waiting.drain(..=k);
                    return Ok(taken);
                }
            }
            self.waiting.clear();
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                let waited_s = PATIENCE.as_secs_f64();
                let what = "in the bench protocol, as if it were busy with another flight".into();
                return Err(SessionError::NoAnswer { peer, what, waited_s });
            }
            let n = stream.read_some(&mut buffer, left).map_err(|e| cut(peer, &e))?;
            self.waiting.extend_from_slice(&buffer[..n]);
        }
    }
}

fn say(stream: &mut dyn Stream, peer: &'static str, message: &Message<'_>) -> Result<(), SessionError> {
    let mut room: FrameBytes = [0; MAX_FRAME];
    // A message is shorter than the longest packet: its text is cut to pieces.
    let bytes = encode(message, &mut room).map_err(|e| SessionError::Bench(e.to_string()))?;
    stream.write_all(bytes).map_err(|e| cut(peer, &e))
}

fn cut(peer: &'static str, e: &io::Error) -> SessionError {
    SessionError::Cut { peer, when: "before the flight".into(), reason: e.to_string() }
}

/// Pieces of a text that each fit a message.
fn pieces(mut text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    while !text.is_empty() {
        let at = text.floor_char_boundary(TEXT_PIECE);
        let (piece, rest) = text.split_at(at);
        pieces.push(piece);
        text = rest;
    }
    pieces
}

/// What a client asked for.
pub struct Order {
    /// The flight.
    pub scenario: Scenario,
    /// Seed of the campaign.
    pub seed: u64,
    /// Run of the campaign.
    pub run: u64,
    /// Without dispersions.
    pub nominal: bool,
}

const CLIENT: &str = "host";
const SERVER: &str = "truth simulator";

/// Serves one client: preamble, then the flight.
///
/// # Errors
/// The preamble failed; the client was told if that was possible.
pub fn serve(stream: &mut dyn Stream, pace: Pace) -> Result<End, SessionError> {
    let (order, left_over) = take_order(stream)?;
    let made = Conductor::new(&order.scenario, order.seed, order.run, order.nominal);
    let mut conductor = made.or_else(|error| refuse(stream, error))?;
    conductor.set_pace(pace.of_the_board());
    say(stream, CLIENT, &Message::Ready)?;
    conductor.receive(&left_over);
    Ok(pump(stream, &mut conductor, pace))
}

/// The server's side of the preamble: the order, and bytes that already belong to the session.
fn take_order(stream: &mut dyn Stream) -> Result<(Order, Vec<u8>), SessionError> {
    let mut inbox = Inbox::default();
    let theirs = inbox.next(stream, CLIENT, version_of)?;
    say(stream, CLIENT, &HELLO)?;
    check_version(theirs)?;
    let (mut text, mut messages) = (String::new(), 0);
    let (seed, run, nominal) = loop {
        let start = inbox.next(stream, CLIENT, |message| match message {
            Message::Scenario { text: piece } => {
                text.push_str(piece);
                None
            }
            Message::Start { seed, run, nominal } => Some((seed, run, nominal)),
            _ => None,
        })?;
        messages += 1;
        if text.len() > MAX_SCENARIO || messages > MAX_MESSAGES {
            return refuse(stream, SessionError::Bench(format!("the scenario is longer than {MAX_SCENARIO} bytes")));
        }
        if let Some(start) = start {
            break start;
        }
    };
    match Scenario::from_link(&text) {
        Ok(scenario) => Ok((Order { scenario, seed, run, nominal }, inbox.waiting)),
        Err(e) => refuse(stream, SessionError::Bench(e.message)),
    }
}

/// Tells the client why not.
fn refuse<T>(stream: &mut dyn Stream, error: SessionError) -> Result<T, SessionError> {
    let text = match &error {
        SessionError::Bench(text) => text.clone(),
        other => other.to_string(),
    };
    for piece in pieces(&text).into_iter().chain([""]) {
        say(stream, CLIENT, &Message::Error { text: piece })?;
    }
    Err(error)
}

/// The version of a greeting, `None` for anything else.
fn version_of(message: Message<'_>) -> Option<(u16, u64)> {
    match message {
        Message::Hello { version, schema_hash } => Some((version, schema_hash)),
        _ => None,
    }
}

fn check_version(theirs: Option<(u16, u64)>) -> Result<(), SessionError> {
    match theirs {
        Some((BENCH_VERSION, SCHEMA_HASH)) => Ok(()),
        Some((BENCH_VERSION, theirs)) => Err(SessionError::Hello {
            peer: "other end",
            error: fsw_core::link::handshake::HelloError::Schema { theirs },
        }),
        Some((theirs, _)) => Err(SessionError::BenchVersion { theirs, ours: BENCH_VERSION }),
        None => Err(SessionError::Bench("the first message is no greeting".into())),
    }
}

/// The client's side of the preamble: orders a flight over an open stream, which then carries the session.
///
/// # Errors
/// The peer does not answer, speaks another version, or refuses the flight in its own words.
pub fn order(
    stream: &mut dyn Stream,
    scenario: &Scenario,
    seed: u64,
    run: u64,
    nominal: bool,
) -> Result<Vec<u8>, SessionError> {
    let mut inbox = Inbox::default();
    say(stream, SERVER, &HELLO)?;
    check_version(inbox.next(stream, SERVER, version_of)?)?;
    for text in pieces(&scenario.to_toml()) {
        say(stream, SERVER, &Message::Scenario { text })?;
    }
    say(stream, SERVER, &Message::Start { seed, run, nominal })?;
    let mut error = String::new();
    for _ in 0..MAX_MESSAGES {
        let done = inbox.next(stream, SERVER, |message| match message {
            Message::Ready => Some(true),
            Message::Error { text: "" } => Some(false),
            Message::Error { text } => {
                error.push_str(text);
                (error.len() > MAX_REFUSAL).then_some(false)
            }
            _ => None,
        })?;
        match done {
            Some(true) => return Ok(inbox.waiting),
            Some(false) => return Err(SessionError::Bench(error)),
            None => {}
        }
    }
    Err(SessionError::Bench("it talks and talks, but neither accepts nor refuses it".into()))
}

#[cfg(test)]
#[path = "bench_tests.rs"]
mod tests;
