//! Replay: the recorded uplink of a flight goes to a fresh flight computer, and every byte it answers is compared.
//!
//! Outside the comparison: the build identity in `Hello`, and the measured cost, the overruns it shows and the stack
//! use in `HealthTlm`, which belong to the machine and not to the flight.

mod comparison;

use std::fs::File;
use std::path::{Path, PathBuf};

use fsw_core::link::packet::Downlink;
use fsw_core::link::schema::SCHEMA_HASH;
use serde::Serialize;

use crate::cli::{ComputerPlace, ReplayArgs};
use crate::ends::{ComputerEnd, ComputerError, LocalComputer};
use crate::error::HostError;
use crate::linklog::{Direction, LinkLog, LinkLogError};
use crate::output::{print, print_json};
use crate::tap::Tap;
use crate::target::{Image, Target, TargetError, bench};
use comparison::{Piece, Replay};

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
    let mut replay = Replay::default();
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
    Ok(replay.verdict(log, difference))
}

/// Compares the whole answer of another flight computer to the uplink of a log with the one in the log.
#[must_use]
pub fn compare(log: &LinkLog, answer: &[u8]) -> Verdict {
    let mut replay = Replay::default();
    let mut recorded = Tap::<Downlink>::default();
    for (_, bytes) in log.records().filter(|(direction, _)| *direction == Direction::Down) {
        recorded.feed(bytes, |piece, heard| replay.expected.push_back(Piece::new(piece, heard)));
    }
    Tap::<Downlink>::default().feed(answer, |piece, heard| replay.answered.push_back(Piece::new(piece, heard)));
    let difference = replay.compare();
    replay.verdict(log, difference)
}

/// Runs the command; true when every replay is identical.
///
/// # Errors
/// A log cannot be read, or the computer cannot be had.
pub fn run(args: &ReplayArgs) -> Result<bool, HostError> {
    let logs = args.runs.iter().map(|run| read_log(run)).collect::<Result<Vec<_>, _>>()?;
    let verdicts = match &args.computer {
        ComputerPlace::InProcess if args.image.is_some() => {
            return Err(TargetError::ImageNotTaken(args.computer.to_string()).into());
        }
        ComputerPlace::InProcess => {
            let replay = |log: &LinkLog| replay(log, &mut LocalComputer::default());
            logs.iter().map(replay).collect::<Result<Vec<_>, _>>()?
        }
        ComputerPlace::Qemu(target) => on_target(*target, args.image.as_deref(), &logs)?,
        ComputerPlace::Serial(_) => {
            let reason = "a board on a serial line takes no replay: take in-process, qemu:m7 or qemu:rv64";
            return Err(HostError::Option(reason.into()));
        }
    };
    tell(args, &verdicts)?;
    Ok(verdicts.iter().all(|verdict| verdict.identical))
}

/// Replays logs on a target, one after the other in one boot.
fn on_target(target: Target, image: Option<&Path>, logs: &[LinkLog]) -> Result<Vec<Verdict>, HostError> {
    let image = match image {
        Some(path) => Image::open(target, path)?,
        None => Image::build(target, bench::BENCH_IMAGE)?,
    };
    let uplinks: Vec<_> = logs.iter().map(bench::uplink_of).collect();
    let answers = bench::run(target, &image, &uplinks, bench::PATIENCE)?;
    Ok(logs.iter().zip(&answers).map(|(log, answer)| compare(log, answer)).collect())
}

fn tell(args: &ReplayArgs, verdicts: &[Verdict]) -> Result<(), HostError> {
    if args.json {
        return match verdicts {
            [verdict] => print_json(verdict),
            _ => print_json(&verdicts),
        };
    }
    for (run, verdict) in args.runs.iter().zip(verdicts) {
        let run = if args.runs.len() > 1 { format!("{}: ", run.display()) } else { String::new() };
        if !args.quiet {
            print(&format!("{run}{}", verdict.sentence()))?;
        } else if !verdict.identical {
            eprint!("aeroshell: {run}{}", verdict.sentence());
        }
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linklog::LinkLogWriter;
    use fsw_core::link::framing::{FrameBytes, MAX_FRAME, encode_frame};
    use fsw_core::link::packet::Frame;
    use fsw_core::link::packet::{Actuator, HealthTlm, Hello};
    use fsw_core::time::MissionTime;
    use std::collections::VecDeque;
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
        let health =
            HealthTlm { worst_cost: [cost; 8], worst_frame: cost, slips: cost as u16, frames, ..HealthTlm::default() };
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
