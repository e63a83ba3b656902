use super::*;
use crate::record::tests::facts;
use crate::recorder::FlightId;
use fsw_core::link::framing::{FrameBytes, MAX_FRAME, encode_frame};
use fsw_core::link::packet::{Actuator, Frame, Imu, Truth};
use fsw_core::probe::MeasuredCost;
use hil_sim::session::SessionError;

static CALM: AtomicBool = AtomicBool::new(false);
const CALM_PACE: Pace<'static> = Pace { realtime: false, interrupt: &CALM };

fn encoded<P: serde::Serialize>(time: MissionTime, packet: P) -> Vec<u8> {
    let mut room: FrameBytes = [0; MAX_FRAME];
    encode_frame(&Frame { sequence: 0, time, packet }, &mut room).unwrap().to_vec()
}

/// A truth end that follows a script: a truth packet and an inertial packet per exchange, in chunks of a given size.
struct Script {
    pending: Vec<u8>,
    frame: u32,
    last_frame: u32,
    chunk: usize,
    descent_m_per_frame: f64,
}

impl Script {
    fn new(last_frame: u32, chunk: usize) -> Self {
        Self { pending: Vec::new(), frame: 0, last_frame, chunk, descent_m_per_frame: 0.0 }
    }
}

impl TruthEnd for Script {
    fn exchange(&mut self, _: &[u8], out: &mut Vec<u8>) -> Result<(), SessionError> {
        if self.pending.is_empty() {
            if self.frame > self.last_frame {
                return Err(SessionError::Bench("no more".into()));
            }
            let time = MissionTime::of_frame(self.frame);
            let height = 3_500_000.0 - self.descent_m_per_frame * f64::from(self.frame);
            let truth = Truth { position_m: [height, 0.0, 0.0], ..Truth::default() };
            self.pending.extend(encoded(time, Uplink::Truth(truth)));
            if self.frame > 0 {
                self.pending.extend(encoded(time, Uplink::Imu(Imu::default())));
            }
            self.frame += 1;
        }
        let take = self.chunk.min(self.pending.len());
        out.extend(self.pending.drain(..take));
        Ok(())
    }
}

/// A flight computer that answers every inertial packet and fires the mortar in a given frame.
struct Answerer {
    up: Tap<Uplink>,
    fire_in: u32,
    truths: u32,
    heard: Vec<u8>,
    frame_closed: Option<()>,
}

impl Answerer {
    fn new(fire_in: u32) -> Self {
        Self { up: Tap::default(), fire_in, truths: 0, heard: Vec::new(), frame_closed: None }
    }
}

impl ComputerEnd for Answerer {
    fn exchange(&mut self, bytes: &[u8], out: &mut Vec<u8>, _: Option<Instant>) -> Result<(), ComputerError> {
        self.heard.extend_from_slice(bytes);
        let (fire_in, truths, closed) = (self.fire_in, &mut self.truths, &mut self.frame_closed);
        self.up.feed(bytes, |_, heard| {
            let Heard::Packet(frame) = heard else { return };
            match frame.packet {
                Uplink::Imu(_) => {
                    let index = frame.time.frame_index();
                    let discretes = if index == fire_in { Actuator::MORTAR_FIRE } else { 0 };
                    let actuator = Actuator { frame: index, discretes, ..Actuator::default() };
                    out.extend(encoded(frame.time, Downlink::Actuator(actuator)));
                    *closed = Some(());
                }
                Uplink::Truth(_) => *truths += 1,
                _ => {}
            }
        });
        Ok(())
    }

    fn take_cost(&mut self) -> Option<MeasuredCost> {
        self.frame_closed.take().map(|()| MeasuredCost { whole: 2_000, ..MeasuredCost::NONE })
    }
}

/// Keeps the pieces of the link.
#[derive(Default)]
struct Pieces(Vec<(Direction, Vec<u8>)>);

impl Watch for Pieces {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.0.push((direction, bytes.to_vec()));
        Ok(())
    }
}

fn recorder(navigation: NavigationMode) -> Recorder {
    let mut facts = facts();
    facts.navigation = navigation;
    Recorder::new(facts, FlightId::default(), 1000.0)
}

fn run(mut script: Script, fire_in: u32, navigation: NavigationMode) -> (FlightRecord, Answerer, Pieces) {
    let (mut computer, mut pieces) = (Answerer::new(fire_in), Pieces::default());
    let record = fly(&mut script, &mut computer, recorder(navigation), &mut pieces, CALM_PACE);
    (record, computer, pieces)
}

#[test]
fn a_flight_ends_at_the_frame_of_the_mortar() {
    let (record, ..) = run(Script::new(100, usize::MAX), 9, NavigationMode::Ekf);
    assert_eq!(record.end, End::Deployed);
    assert_eq!((record.truth.len(), record.actuators.len(), record.frame_cost_us.len()), (10, 9, 9));
    assert_eq!(record.summary.deploy.map(|d| d.time_s), Some(0.18));
}

#[test]
fn truth_packets_reach_recorder_only_unless_the_navigation_flies_on_them() {
    let (record, computer, pieces) = run(Script::new(100, usize::MAX), 5, NavigationMode::Ekf);
    assert_eq!((record.truth.len(), computer.truths), (6, 0));
    assert_eq!(pieces.0.iter().filter(|(d, _)| *d == Direction::Up).count(), 5);
    let (record, computer, pieces) = run(Script::new(100, usize::MAX), 5, NavigationMode::Ideal);
    assert_eq!((record.truth.len(), computer.truths), (6, 6));
    assert_eq!(pieces.0.iter().filter(|(d, _)| *d == Direction::Up).count(), 11);
}

#[test]
fn the_size_of_the_chunks_changes_nothing() {
    for navigation in [NavigationMode::Ekf, NavigationMode::Ideal] {
        for (fire_in, descent_m_per_frame) in [(12, 0.0), (u32::MAX, 10_000.0)] {
            let fly = |chunk| {
                let script = Script { descent_m_per_frame, ..Script::new(100, chunk) };
                let (record, computer, pieces) = run(script, fire_in, navigation);
                (record.end, record.summary.output_hash, computer.heard, pieces.0)
            };
            let whole = fly(usize::MAX);
            for chunk in [1, 5, 64] {
                assert!(fly(chunk) == whole, "chunks of {chunk}, {navigation:?}, fire in {fire_in}");
            }
        }
    }
}

#[test]
fn a_cut_link_keeps_everything_up_to_the_cut() {
    let (record, ..) = run(Script::new(20, usize::MAX), u32::MAX, NavigationMode::Ekf);
    assert_eq!(record.end, End::Failed("the truth simulator refuses the flight: no more (at t = 0.40 s)".into()));
    assert_eq!((record.truth.len(), record.actuators.len()), (21, 20));
    assert!(!record.summary.success);
}

#[test]
fn an_interrupt_ends_the_flight_and_keeps_it() {
    let interrupt = AtomicBool::new(true);
    let (mut script, mut computer) = (Script::new(20, usize::MAX), Answerer::new(9));
    let pace = Pace { realtime: false, interrupt: &interrupt };
    let record = fly(&mut script, &mut computer, recorder(NavigationMode::Ekf), &mut Unwatched, pace);
    assert_eq!(record.end, End::Interrupted);
    assert_eq!(record.summary.outcome, "interrupted");
}

#[test]
fn two_silent_ends_do_not_hang() {
    struct Silent;
    impl TruthEnd for Silent {
        fn exchange(&mut self, _: &[u8], _: &mut Vec<u8>) -> Result<(), SessionError> {
            Ok(())
        }
    }
    let record = fly(&mut Silent, &mut Answerer::new(9), recorder(NavigationMode::Ekf), &mut Unwatched, CALM_PACE);
    assert!(matches!(record.end, End::Failed(reason) if reason.contains("silent")));
}

#[test]
fn a_full_disk_ends_the_flight_as_failed() {
    struct FullDisk;
    impl Watch for FullDisk {
        fn link(&mut self, _: Direction, _: &[u8]) -> io::Result<()> {
            Err(io::Error::other("no space left"))
        }
    }
    let (mut script, mut computer) = (Script::new(20, usize::MAX), Answerer::new(9));
    let record = fly(&mut script, &mut computer, recorder(NavigationMode::Ekf), &mut FullDisk, CALM_PACE);
    assert!(matches!(record.end, End::Failed(reason) if reason.contains("no space left")));
}

/// A truth end that says the same bytes for ever.
struct Babble(Vec<u8>);

impl TruthEnd for Babble {
    fn exchange(&mut self, _: &[u8], out: &mut Vec<u8>) -> Result<(), SessionError> {
        out.extend_from_slice(&self.0);
        Ok(())
    }
}

fn end_of(babble: Vec<u8>) -> String {
    let id = FlightId { seed: 1, run: 0, nominal: false };
    let recorder = Recorder::new(facts(), id, 100.0);
    let mut truth = Babble(babble);
    let patience = Duration::from_millis(50);
    let record = fly_with(&mut truth, &mut Answerer::new(1), recorder, &mut Unwatched, CALM_PACE, patience);
    record.summary.reason.unwrap_or_default()
}

#[test]
fn noise_without_end_is_no_flight_without_end() {
    for noise in [vec![0x55; 64], vec![0], b"HTTP/1.1 400 Bad Request\r\n\r\n".to_vec()] {
        let reason = end_of(noise);
        assert!(reason.starts_with("the truth simulator has sent no packet among its bytes for 0.05 s"), "{reason}");
    }
}

#[test]
fn a_truth_end_of_another_protocol_is_refused_by_name() {
    let theirs = fsw_core::link::packet::Hello { protocol_version: 77, schema_hash: 0, build_id: 0 };
    let reason = end_of(encoded(MissionTime::ZERO, Uplink::Hello(theirs)));
    assert!(reason.starts_with("the truth simulator is refused: the peer speaks protocol version 77"), "{reason}");
}

/// A flight computer that is lost in its third frame, after it has answered.
struct Mortal(Answerer);

impl ComputerEnd for Mortal {
    fn exchange(&mut self, bytes: &[u8], out: &mut Vec<u8>, until: Option<Instant>) -> Result<(), ComputerError> {
        self.0.exchange(bytes, out, until)?;
        let frames = self.0.heard.iter().filter(|byte| **byte == 0).count();
        let lost = || ComputerError::Lost { place: "on the bench".into(), reason: "smoke".into() };
        if frames < 3 { Ok(()) } else { Err(lost()) }
    }
}

#[test]
fn a_lost_flight_computer_ends_the_flight_and_its_last_words_are_kept() {
    let mut computer = Mortal(Answerer::new(9));
    let mut script = Script::new(20, usize::MAX);
    let record = fly(&mut script, &mut computer, recorder(NavigationMode::Ekf), &mut Unwatched, CALM_PACE);
    let reason = "the flight computer on the bench is lost: smoke (at t = 0.06 s)";
    assert_eq!(record.end, End::Failed(reason.into()));
    assert_eq!((record.actuators.len(), record.frame_cost_us.len()), (3, 0));
}
