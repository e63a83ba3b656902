//! Replay: the recorded uplink of a flight goes to a fresh flight computer, and every byte it answers is compared.
//!
//! Outside the comparison: the build identity in `Hello`, and the measured cost and stack use in `HealthTlm`, which
//! belong to the machine and not to the flight.

use std::collections::VecDeque;
use std::fs::File;
use std::path::{Path, PathBuf};

use fsw_core::link::packet::{Downlink, Frame, HealthTlm};
use fsw_core::link::schema::SCHEMA_HASH;
use serde::Serialize;
use serde_json::Value;

use crate::cli::ReplayArgs;
use crate::ends::{ComputerEnd, ComputerError};
use crate::error::HostError;
use crate::linklog::{Direction, LinkLog, LinkLogError};
use crate::output::{print, print_json};
use crate::tap::{Heard, Tap};

/// Outcome of a replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// No difference found.
    pub identical: bool,
    /// Downlink packets compared.
    pub packets: usize,
    /// Minor frames replayed.
    pub frames: u32,
    /// The log ends inside a record: what came before was compared.
    pub truncated: bool,
    /// The first difference.
    pub difference: Option<Difference>,
}

/// The first difference between a recorded flight and its replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Minor frame in which it was sent.
    pub frame: u32,
    /// Index of the downlink packet, from 0.
    pub packet: usize,
    /// Kind of the packet.
    pub kind: String,
    /// The field that differs, dotted.
    pub field: String,
    /// What was recorded.
    pub recorded: String,
    /// What the replay answered.
    pub replayed: String,
}

/// Reads the link log of a run folder, or the log itself.
///
/// # Errors
/// There is none, it is no log, or it was written with other packets.
pub fn read_log(run: &Path) -> Result<LinkLog, HostError> {
    let path: PathBuf = if run.is_dir() { run.join("link.bin") } else { run.to_owned() };
    let file = File::open(&path).map_err(HostError::file("read", &path))?;
    let log = LinkLog::read(file).map_err(|source| HostError::LinkLog { path: path.clone(), source })?;
    if log.schema_hash != SCHEMA_HASH {
        return Err(HostError::Link(format!(
            "{} was recorded with packets of schema {:016x}; this program speaks {SCHEMA_HASH:016x}",
            path.display(),
            log.schema_hash
        )));
    }
    if log.records().next().is_none() {
        return Err(HostError::LinkLog { path, source: LinkLogError::Empty });
    }
    Ok(log)
}

/// Replays a log into `computer`.
///
/// # Errors
/// The computer is lost.
pub fn replay(log: &LinkLog, computer: &mut dyn ComputerEnd) -> Result<Verdict, ComputerError> {
    let mut replay = Replay { expected: VecDeque::new(), answered: VecDeque::new(), packets: 0, frames: 0 };
    let (mut recorded, mut replayed) = (Tap::<Downlink>::default(), Tap::<Downlink>::default());
    let mut answer = Vec::with_capacity(4_096);
    let mut difference = None;
    for (direction, bytes) in log.records() {
        match direction {
            Direction::Up => {
                answer.clear();
                computer.exchange(bytes, &mut answer, None)?;
                replayed.feed(&answer, |piece, heard| replay.answered.push_back(Piece::new(piece, heard)));
            }
            Direction::Down => {
                recorded.feed(bytes, |piece, heard| replay.expected.push_back(Piece::new(piece, heard)));
            }
        }
        difference = replay.compare();
        if difference.is_some() {
            break;
        }
    }
    // A log cut off in the middle lacks answers; a whole one must not.
    let difference = difference.or_else(|| if log.truncated { None } else { replay.left_over() });
    Ok(Verdict {
        identical: difference.is_none(),
        packets: replay.packets,
        frames: replay.frames,
        truncated: log.truncated,
        difference,
    })
}

/// Runs the command into a fresh `computer`; true when the replay is identical.
///
/// # Errors
/// The log cannot be read, or the computer is lost.
pub fn run(args: &ReplayArgs, computer: &mut dyn ComputerEnd) -> Result<bool, HostError> {
    let verdict = replay(&read_log(&args.run)?, computer)?;
    if args.json {
        print_json(&verdict)?;
    } else if !args.quiet {
        print(&verdict.sentence())?;
    } else if !verdict.identical {
        eprint!("aeroshell: {}", verdict.sentence());
    }
    Ok(verdict.identical)
}

impl Verdict {
    fn sentence(&self) -> String {
        let cut = if self.truncated { " (the log is cut off; compared as far as it goes)" } else { "" };
        match &self.difference {
            None => format!("identical: {} packets over {} frames{cut}\n", self.packets, self.frames),
            Some(d) => format!(
                "different: frame {}, packet {} ({}), field {}: recorded {}, replayed {}{cut}\n",
                d.frame,
                d.packet,
                d.kind,
                if d.field.is_empty() { "-" } else { &d.field },
                d.recorded,
                d.replayed
            ),
        }
    }
}

/// One downlink packet, or bytes that are none.
struct Piece {
    bytes: Vec<u8>,
    frame: Option<Frame<Downlink>>,
}

impl Piece {
    fn new(bytes: &[u8], heard: Heard<Downlink>) -> Self {
        let frame = match heard {
            Heard::Packet(frame) => Some(comparable(frame)),
            Heard::Damaged(_) | Heard::Nothing => None,
        };
        Self { bytes: bytes.to_vec(), frame }
    }

    fn kind(&self) -> String {
        let kind = match self.frame.as_ref().map(|f| &f.packet) {
            None => "undecodable bytes",
            Some(Downlink::Hello(_)) => "Hello",
            Some(Downlink::Actuator(_)) => "Actuator",
            Some(Downlink::NavTlm(_)) => "NavTlm",
            Some(Downlink::GuidanceTlm(_)) => "GuidanceTlm",
            Some(Downlink::HealthTlm(_)) => "HealthTlm",
            Some(Downlink::Event(_)) => "Event",
            Some(Downlink::CommandReply(_)) => "CommandReply",
            Some(Downlink::CostTlm(_)) => "CostTlm",
        };
        kind.to_owned()
    }
}

/// The packet without what belongs to the machine.
fn comparable(mut frame: Frame<Downlink>) -> Frame<Downlink> {
    match &mut frame.packet {
        Downlink::Hello(hello) => hello.build_id = 0,
        Downlink::HealthTlm(health) => {
            let blank = HealthTlm::default();
            health.worst_cost = blank.worst_cost;
            health.worst_frame = blank.worst_frame;
            health.stack_high_water_bytes = blank.stack_high_water_bytes;
        }
        _ => {}
    }
    frame
}

struct Replay {
    expected: VecDeque<Piece>,
    answered: VecDeque<Piece>,
    packets: usize,
    frames: u32,
}

impl Replay {
    /// Compares as far as both sides have spoken.
    fn compare(&mut self) -> Option<Difference> {
        while let (Some(expected), Some(answered)) = (self.expected.front(), self.answered.front()) {
            if !same(expected, answered) {
                let (field, recorded, replayed) = first_difference(&tree(expected), &tree(answered), "");
                return Some(self.difference(expected.kind(), field, recorded, replayed));
            }
            if let Some(Downlink::Actuator(actuator)) = expected.frame.as_ref().map(|f| &f.packet) {
                self.frames = actuator.frame;
            }
            self.packets += 1;
            self.expected.pop_front();
            self.answered.pop_front();
        }
        None
    }

    fn left_over(&self) -> Option<Difference> {
        let missing = || "nothing".to_owned();
        if let Some(piece) = self.expected.front() {
            return Some(self.difference(piece.kind(), String::new(), tree(piece).to_string(), missing()));
        }
        let piece = self.answered.front()?;
        Some(self.difference(piece.kind(), String::new(), missing(), tree(piece).to_string()))
    }

    fn difference(&self, kind: String, field: String, recorded: String, replayed: String) -> Difference {
        Difference { frame: self.frames + 1, packet: self.packets, kind, field, recorded, replayed }
    }
}

fn same(a: &Piece, b: &Piece) -> bool {
    a.bytes == b.bytes || (a.frame.is_some() && bits(a) == bits(b))
}

/// Postcard form: equal exactly when every bit of every field is, NaN included.
fn bits(piece: &Piece) -> Vec<u8> {
    let mut room = [0u8; fsw_core::link::framing::MAX_PAYLOAD];
    match piece.frame.as_ref().map(|frame| postcard::to_slice(frame, &mut room)) {
        Some(Ok(bytes)) => bytes.to_vec(),
        _ => piece.bytes.clone(),
    }
}

fn tree(piece: &Piece) -> Value {
    match piece.frame.as_ref().map(serde_json::to_value) {
        Some(Ok(value)) => value,
        _ => Value::String(format!("{} bytes", piece.bytes.len())),
    }
}

/// Path and values of the first leaf that differs; leaves that print alike (NaN) are told apart by nothing but name.
fn first_difference(a: &Value, b: &Value, path: &str) -> (String, String, String) {
    let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
    match (a, b) {
        (Value::Object(x), Value::Object(y)) => {
            for (key, left) in x {
                match y.get(key) {
                    Some(right) if left != right => return first_difference(left, right, &join(key)),
                    Some(_) => {}
                    None => return (join(key), left.to_string(), b.to_string()),
                }
            }
        }
        (Value::Array(x), Value::Array(y)) if x.len() == y.len() => {
            for (index, (left, right)) in x.iter().zip(y).enumerate() {
                if left != right {
                    return first_difference(left, right, &join(&index.to_string()));
                }
            }
        }
        _ => {}
    }
    (path.to_owned(), a.to_string(), b.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linklog::LinkLogWriter;
    use fsw_core::link::framing::{FrameBytes, MAX_FRAME, encode_frame};
    use fsw_core::link::packet::{Actuator, Hello};
    use fsw_core::time::MissionTime;
    use std::time::Instant;

    /// Answers the n-th exchange with the n-th script entry.
    struct Script(VecDeque<Vec<u8>>);

    impl ComputerEnd for Script {
        fn exchange(&mut self, _: &[u8], out: &mut Vec<u8>, _: Option<Instant>) -> Result<(), ComputerError> {
            out.extend(self.0.pop_front().unwrap_or_default());
            Ok(())
        }
    }

    fn encoded(frame: u32, packet: Downlink) -> Vec<u8> {
        let mut room: FrameBytes = [0; MAX_FRAME];
        let frame = Frame { sequence: 0, time: MissionTime::of_frame(frame), packet };
        encode_frame(&frame, &mut room).unwrap().to_vec()
    }

    fn actuator(frame: u32, rate: f64) -> Vec<u8> {
        encoded(frame, Downlink::Actuator(Actuator { frame, bank_rate_radps: rate, ..Actuator::default() }))
    }

    fn health(cost: u32, frames: u32) -> Vec<u8> {
        let health = HealthTlm { worst_cost: [cost; 8], worst_frame: cost, frames, ..HealthTlm::default() };
        encoded(3, Downlink::HealthTlm(health))
    }

    fn hello(build_id: u64) -> Vec<u8> {
        encoded(0, Downlink::Hello(Hello { protocol_version: 1, schema_hash: 2, build_id }))
    }

    fn log_of(answers: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut log = LinkLogWriter::new(&mut bytes, SCHEMA_HASH).unwrap();
        for answer in answers {
            log.record(Direction::Up, &[1, 0]).unwrap();
            log.record(Direction::Down, answer).unwrap();
        }
        bytes
    }

    fn verdict(recorded: &[Vec<u8>], replayed: &[Vec<u8>]) -> Verdict {
        let log = LinkLog::read(log_of(recorded).as_slice()).unwrap();
        replay(&log, &mut Script(replayed.iter().cloned().collect())).unwrap()
    }

    #[test]
    fn a_replay_with_the_same_answers_is_identical() {
        let answers = [hello(1), actuator(1, 0.1), actuator(2, f64::NAN)];
        let verdict = verdict(&answers, &answers);
        assert!(verdict.identical, "{verdict:?}");
        assert_eq!((verdict.packets, verdict.frames), (3, 2));
    }

    #[test]
    fn build_identity_and_measured_cost_do_not_count_but_counters_do() {
        assert!(verdict(&[hello(1), health(5, 9)], &[hello(2), health(6, 9)]).identical);
        let difference = verdict(&[health(5, 9)], &[health(5, 8)]).difference.unwrap();
        assert_eq!((difference.kind.as_str(), difference.field.as_str()), ("HealthTlm", "packet.HealthTlm.frames"));
    }

    #[test]
    fn the_first_difference_is_named_by_frame_packet_and_field() {
        let verdict = verdict(&[actuator(1, 0.0), actuator(2, 0.5)], &[actuator(1, 0.0), actuator(2, 0.25)]);
        let difference = verdict.difference.unwrap();
        assert_eq!((difference.frame, difference.packet), (2, 1));
        assert_eq!(difference.field, "packet.Actuator.bank_rate_radps");
        assert_eq!((difference.recorded.as_str(), difference.replayed.as_str()), ("0.5", "0.25"));
    }

    #[test]
    fn a_missing_and_a_surplus_answer_are_differences() {
        assert!(!verdict(&[actuator(1, 0.0)], &[]).identical);
        let both = [actuator(1, 0.0), actuator(1, 0.0)].concat();
        assert!(!verdict(&[actuator(1, 0.0)], &[both]).identical);
    }

    #[test]
    fn a_log_cut_off_is_compared_as_far_as_it_goes() {
        let answers = [actuator(1, 0.0), actuator(2, 0.0)];
        let whole = log_of(&answers);
        let log = LinkLog::read(&whole[..whole.len() - 3]).unwrap();
        let verdict = replay(&log, &mut Script(answers.into_iter().collect())).unwrap();
        assert!(verdict.identical && verdict.truncated);
        assert_eq!(verdict.packets, 1);
    }
}
