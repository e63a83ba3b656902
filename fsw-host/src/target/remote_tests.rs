use super::*;
use crate::ends::LocalComputer;
use crate::linklog::Direction;
use crate::pump::{self, Pace, Watch};
use crate::record::{End, FlightRecord, ScenarioFacts};
use crate::recorder::{FlightId, Recorder};
use fsw_core::executive::FlightComputer;
use fsw_core::link::packet::{Hello, Uplink};
use fsw_core::link::receiver::Sender;
use fsw_core::time::MissionTime;
use hil_sim::scenario::Scenario;
use hil_sim::session::Conductor;
use hil_sim::transport::{Listener, Tcp};
use std::thread::JoinHandle;

static CALM: AtomicBool = AtomicBool::new(false);
const SHORT: Duration = Duration::from_millis(60);

/// What a board does with the delimiters it receives, by number.
type Habit = fn(u32) -> Does;

#[derive(Clone, Copy, PartialEq)]
enum Does {
    Answer,
    /// Neither hears nor answers.
    Sleep,
    /// Switches itself off.
    Die,
}

/// A board behind a TCP port, in a thread.
fn board(habit: Habit) -> (Tcp, JoinHandle<()>) {
    let port = Listener::bind("127.0.0.1:0").unwrap();
    let address = port.local_address().unwrap().to_string();
    let thread = std::thread::spawn(move || run_board(&mut port.accept().unwrap(), habit));
    (Tcp::connect(&address).unwrap(), thread)
}

fn run_board(stream: &mut Tcp, habit: Habit) {
    let mut computer = Box::new(FlightComputer::new(7));
    let (mut buffer, mut answer, mut delimiters) = ([0u8; 7], Vec::new(), 0);
    while let Ok(n) = stream.read_some(&mut buffer, Duration::from_secs(5)) {
        for byte in &buffer[..n] {
            let closes = *byte == DELIMITER;
            delimiters += u32::from(closes);
            match habit(delimiters) {
                Does::Sleep => continue,
                Does::Die => return,
                Does::Answer => {}
            }
            computer.receive(&[*byte], |bytes| answer.extend_from_slice(bytes));
            if closes {
                answer.push(DELIMITER);
            }
        }
        if stream.write_all(&std::mem::take(&mut answer)).is_err() {
            return;
        }
    }
}

fn computer(stream: Tcp) -> RemoteComputer {
    RemoteComputer::new(Box::new(stream), "on the bench".into(), &CALM).with_patience(SHORT)
}

/// The pieces of the link as a run folder keeps them.
#[derive(Default)]
struct Pieces(Vec<Piece>);

type Piece = (Direction, Vec<u8>);

impl Watch for Pieces {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.0.push((direction, bytes.to_vec()));
        Ok(())
    }
}

fn fly(end: &mut dyn ComputerEnd) -> (FlightRecord, Pieces) {
    let scenario = Scenario::builtin("msl").unwrap();
    let mut truth = Conductor::new(&scenario, 1, 0, false).unwrap();
    let recorder = Recorder::new(ScenarioFacts::of(&scenario), FlightId { seed: 1, ..FlightId::default() }, 1000.0);
    let mut pieces = Pieces::default();
    let pace = Pace { realtime: false, interrupt: &CALM };
    (pump::fly(&mut truth, end, recorder, &mut pieces, pace), pieces)
}

fn hello(sender: &mut Sender) -> Vec<u8> {
    let mut room = [0; fsw_core::link::framing::MAX_FRAME];
    sender.encode(MissionTime::ZERO, &Uplink::Hello(Hello::ours(1)), &mut room).unwrap().to_vec()
}

#[test]
fn a_board_over_tcp_flies_the_bits_of_this_process() {
    let (stream, thread) = board(|_| Does::Answer);
    let mut far = RemoteComputer::new(Box::new(stream), "on the bench".into(), &CALM);
    let (there, far_pieces) = fly(&mut far);
    let (here, near_pieces) = fly(&mut LocalComputer::default());
    assert_eq!(there.end, End::Deployed);
    assert_eq!(there.summary.output_hash, here.summary.output_hash);
    assert_eq!(there.summary.miss_m, here.summary.miss_m);
    assert_eq!(far_pieces.0.len(), near_pieces.0.len());
    let differs = |(far, near): &(&Piece, &Piece)| far != near;
    // The greeting of the flight computer carries the identity of its build.
    assert!(far_pieces.0.iter().zip(&near_pieces.0).filter(differs).count() <= 1);
    assert!(there.frame_cost_us.is_empty(), "the link is no cost of the flight software");
    drop(far);
    thread.join().unwrap();
}

#[test]
fn acknowledges_are_told_from_frames_in_any_chunks() {
    let stream = [0, 0, 5, 6, 0, 7, 0, 0, 0, 8, 0];
    for chunk in 1..=stream.len() {
        let (mut acknowledges, mut rest) = (Acknowledges::default(), Vec::new());
        let count: usize = stream.chunks(chunk).map(|bytes| acknowledges.take_out(bytes, &mut rest)).sum();
        assert_eq!((count, rest.as_slice()), (4, &[5, 6, 0, 7, 0, 8, 0][..]));
    }
}

#[test]
fn greetings_that_nobody_heard_are_owed_no_answer() {
    // It wakes up in the middle of the third.
    let (stream, _thread) = board(|delimiter| if delimiter <= 2 { Does::Sleep } else { Does::Answer });
    let (mut computer, mut sender) = (computer(stream), Sender::new());
    for heard in [false, false, false, true, true] {
        let mut answer = Vec::new();
        computer.exchange(&hello(&mut sender), &mut answer, None).unwrap();
        assert_eq!(!answer.is_empty(), heard);
    }
    assert_eq!((computer.owed, computer.in_step), (0, true));
}

#[test]
fn acknowledges_left_over_from_an_earlier_session_are_not_taken_for_answers() {
    let port = Listener::bind("127.0.0.1:0").unwrap();
    let address = port.local_address().unwrap().to_string();
    let _thread = std::thread::spawn(move || {
        let mut stream = port.accept().unwrap();
        stream.write_all(&[DELIMITER; 3]).unwrap();
        // Some stand before the first word of the answer, and some behind it.
        let (mut flight, mut buffer) = (Box::new(FlightComputer::new(7)), [0u8; 100]);
        let mut left_over = [DELIMITER; 2].as_slice();
        while let Ok(n) = stream.read_some(&mut buffer, Duration::from_secs(5)) {
            let mut answer = Vec::new();
            flight.receive(&buffer[..n], |bytes| answer.extend_from_slice(bytes));
            answer.extend(buffer[..n].iter().filter(|byte| **byte == DELIMITER));
            answer.extend(std::mem::take(&mut left_over));
            if stream.write_all(&answer).is_err() {
                return;
            }
        }
    });
    let (mut computer, mut sender) = (computer(Tcp::connect(&address).unwrap()), Sender::new());
    // They are in the line before the first word.
    std::thread::sleep(SHORT);
    for _ in 0..3 {
        let mut answer = Vec::new();
        computer.exchange(&hello(&mut sender), &mut answer, None).unwrap();
        assert!(!answer.is_empty() && computer.owed == 0);
    }
}

#[test]
fn a_board_that_falls_silent_is_given_up_after_the_patience() {
    let (stream, _thread) = board(|delimiter| if delimiter <= 40 { Does::Answer } else { Does::Sleep });
    let (record, _) = fly(&mut computer(stream));
    let End::Failed(reason) = record.end else { panic!("{:?}", record.end) };
    assert!(reason.starts_with("the flight computer on the bench is silent: no answer within 0 s"), "{reason}");
}

#[test]
fn a_board_that_goes_away_is_lost_by_name() {
    let (stream, _thread) = board(|delimiter| if delimiter <= 40 { Does::Answer } else { Does::Die });
    let (record, _) = fly(&mut computer(stream));
    let End::Failed(reason) = record.end else { panic!("{:?}", record.end) };
    assert!(reason.starts_with("the flight computer on the bench is lost: "), "{reason}");
}

#[test]
fn in_real_time_a_late_answer_is_left_to_the_next_exchange() {
    let (stream, _thread) = board(|_| Does::Sleep);
    let mut computer = computer(stream);
    computer.in_step = true;
    let until = Instant::now() + SHORT / 4;
    let mut answer = Vec::new();
    computer.exchange(&hello(&mut Sender::new()), &mut answer, Some(until)).unwrap();
    assert!(answer.is_empty() && Instant::now() >= until && computer.owed == 1);
}

#[test]
fn an_interrupt_is_noticed_while_the_board_is_waited_for() {
    static INTERRUPT: AtomicBool = AtomicBool::new(true);
    let (stream, _thread) = board(|_| Does::Sleep);
    let mut computer = RemoteComputer::new(Box::new(stream), "on the bench".into(), &INTERRUPT);
    let lost = computer.exchange(&hello(&mut Sender::new()), &mut Vec::new(), None);
    assert_eq!(lost, Err(ComputerError::Interrupted));
}
