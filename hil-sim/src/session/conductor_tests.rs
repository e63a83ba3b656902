use fsw_core::link::packet::{self, Command, CommandOutcome, Hello, Imu, Injection, Pressure, Radio};
use fsw_core::link::parameters::{BlockId, ParameterBlock};

use super::super::scripted::Scripted;
use super::*;
use crate::noise::Stream;
use crate::truth::FramePackets;

/// A plant that falls a metre a frame and counts.
struct Stone {
    frames: u32,
    altitude_m: f64,
    last_command: f64,
    packets: FramePackets,
}

impl Plant for Stone {
    fn advance(&mut self, bank_accel_radps2: f64, _: f64) {
        self.frames += 1;
        self.altitude_m -= 1.0;
        self.last_command = bank_accel_radps2;
        self.packets = FramePackets {
            pressure: self.frames.is_multiple_of(5).then(Pressure::default),
            radio: if self.frames.is_multiple_of(50) { vec![Radio::default()] } else { Vec::new() },
            imu: Imu::default(),
        };
    }

    fn packets(&self) -> &FramePackets {
        &self.packets
    }

    fn truth(&self) -> packet::Truth {
        packet::Truth { bank_rad: f64::from(self.frames), ..packet::Truth::default() }
    }

    fn altitude_m(&self) -> f64 {
        self.altitude_m
    }
}

fn session(name: &str, sets: &[&str]) -> Conductor<Stone> {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let scenario = Scenario::resolve(name, &sets).unwrap();
    let knowledge = Config::DEFAULT.initial_knowledge;
    let mut plan = Plan::new(&scenario, knowledge, Stream::new(1, 0, "test"));
    plan.truth_tap = false;
    let plant = Stone { frames: 0, altitude_m: 1e5, last_command: 0.0, packets: FramePackets::default() };
    Conductor::with_plant(plant, plan).unwrap()
}

/// Moves bytes until the end, or until nothing moves for long.
fn fly(conductor: &mut Conductor<Stone>, computer: &mut Scripted) -> End {
    for _ in 0..1_000_000 {
        let (mut up, mut down) = (Vec::new(), Vec::new());
        conductor.transmit(&mut up);
        if up.is_empty() {
            conductor.timeout();
        }
        computer.receive(&up, &mut down);
        conductor.receive(&down);
        if let Some(end) = conductor.status().finished {
            return end;
        }
    }
    panic!("no end")
}

#[test]
fn a_session_greets_loads_reads_back_arms_starts_and_flies_to_the_parachute() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(200));
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    let blocks = conductor.plan.blocks.len();
    let kinds: Vec<&str> = computer
        .commands_heard
        .iter()
        .map(|c| match c {
            Command::Load(_) => "load",
            Command::ReadBack(_) => "read",
            Command::Arm { .. } => "arm",
            Command::Go { .. } => "go",
            Command::Inject(_) => "inject",
            Command::ReportCost { .. } => "report cost",
        })
        .collect();
    assert_eq!(kinds[..blocks], vec!["load"; blocks]);
    assert_eq!(kinds[blocks..2 * blocks], vec!["read"; blocks]);
    assert_eq!(kinds[2 * blocks..], ["arm", "go"]);
    assert_eq!((conductor.plant().frames, conductor.status().time_s), (200, 4.0));
    let count = |f: fn(&Uplink) -> bool| computer.heard.iter().filter(|(_, p)| f(p)).count();
    assert_eq!(count(|p| matches!(p, Uplink::Imu(_))), 200);
    assert_eq!(count(|p| matches!(p, Uplink::Pressure(_))), 40);
    assert_eq!(count(|p| matches!(p, Uplink::Radio(_))), 4);
    assert_eq!(count(|p| matches!(p, Uplink::Truth(_))), 0);
    assert_eq!(computer.counters.lost, 0);
}

#[test]
fn the_inertial_sample_closes_the_frame_and_carries_its_end_time() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(50));
    fly(&mut conductor, &mut computer);
    let frames: Vec<_> = computer.heard.iter().filter(|(t, _)| *t == MissionTime::of_frame(50)).collect();
    assert!(matches!(frames[..], [(_, Uplink::Pressure(_)), (_, Uplink::Radio(_)), (_, Uplink::Imu(_))]));
}

#[test]
fn ideal_navigation_hears_the_truth_of_every_frame_and_of_the_start() {
    let (mut conductor, mut computer) = (session("msl-ideal", &[]), Scripted::new(10));
    fly(&mut conductor, &mut computer);
    let banks: Vec<f64> = computer
        .heard
        .iter()
        .filter_map(|(_, p)| if let Uplink::Truth(t) = p { Some(t.bank_rad) } else { None })
        .collect();
    assert_eq!(banks, (0..=10).map(f64::from).collect::<Vec<_>>());
    assert_eq!(computer.counters.lost, 0);
}

#[test]
fn the_tapped_truth_stays_outside_the_numbering() {
    let mut conductor = session("msl", &[]);
    conductor.plan.truth_tap = true;
    let mut computer = Scripted::new(100);
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    // Number 0 is always old to a computer that hears it; the numbered packets have no gap.
    assert_eq!((computer.counters.lost, computer.counters.reordered), (0, 101));
}

#[test]
fn the_command_of_one_frame_steers_the_next() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(2));
    computer.bank_accel_radps2 = 0.25;
    fly(&mut conductor, &mut computer);
    assert_eq!(conductor.plant().last_command, 0.25);
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(1));
    computer.bank_accel_radps2 = 0.25;
    fly(&mut conductor, &mut computer);
    assert_eq!(conductor.plant().last_command, 0.0);
}

#[test]
fn a_command_that_is_not_finite_is_not_obeyed() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(20));
    computer.bank_accel_radps2 = f64::NAN;
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    assert_eq!(conductor.plant().last_command, 0.0);
}

#[test]
fn without_a_parachute_the_flight_ends_on_the_ground_or_at_the_time_limit() {
    let (mut conductor, mut computer) = (session("msl", &["time_limit_s=5"]), Scripted::new(u32::MAX));
    assert_eq!(fly(&mut conductor, &mut computer), End::TimeLimit);
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(u32::MAX));
    conductor.plant.altitude_m = 30.0;
    assert_eq!(fly(&mut conductor, &mut computer), End::Ground);
    assert_eq!(conductor.plant().frames, 30);
}

#[test]
fn lost_commands_do_not_stop_the_flight() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(300));
    computer.mute_frames = 100..150;
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    assert_eq!(conductor.plant().frames, 300);
}

#[test]
fn a_flight_computer_that_falls_silent_ends_the_session() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(u32::MAX));
    computer.mute_frames = 100..u32::MAX;
    let End::Failed(error) = fly(&mut conductor, &mut computer) else { panic!("no failure") };
    assert!(error.to_string().starts_with("the flight computer does not answer the frames since t = "), "{error}");
}

#[test]
fn lost_replies_are_asked_for_again() {
    let (mut conductor, mut computer) = (session("msl", &[]), Scripted::new(10));
    let blocks = conductor.plan.blocks.len();
    // A load, a read-back, and the arming whose first copy was obeyed.
    computer.overrides = vec![
        (3, None),
        (blocks + 5, None),
        (2 * blocks + 2, None),
        (2 * blocks + 3, Some(CommandOutcome::Refused(Refusal::AlreadyArmed))),
    ];
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
}

#[test]
fn each_failure_of_the_handshake_and_loading_gets_one_sentence() {
    let blocks = session("msl", &[]).plan.blocks.len();
    let read_vehicle = blocks + 2;
    let mut wrong = Config::DEFAULT.vehicle;
    wrong.mass_kg = 1.0;
    let cases: Vec<(Scripted, &str)> = vec![
        (
            Scripted { hello: Hello { protocol_version: 9, ..Hello::ours(0) }, ..Scripted::new(1) },
            "the flight computer is refused: the peer speaks protocol version 9, this program version 1",
        ),
        (
            Scripted { hello: Hello { schema_hash: 1, ..Hello::ours(0) }, ..Scripted::new(1) },
            "the flight computer is refused: the peer's packets have another shape",
        ),
        (
            Scripted {
                overrides: vec![(
                    2,
                    Some(CommandOutcome::Refused(Refusal::OutOfRange { block: BlockId::Vehicle, field: 0 })),
                )],
                ..Scripted::new(1)
            },
            "the flight computer refuses the loading of the vehicle block: vehicle block, field mass_kg must be 1 to 1000000 kg",
        ),
        (
            Scripted {
                overrides: vec![(read_vehicle, Some(CommandOutcome::Block(ParameterBlock::Vehicle(wrong))))],
                ..Scripted::new(1)
            },
            "the flight computer holds another vehicle block than it was sent: sent Vehicle(",
        ),
        (
            Scripted {
                overrides: vec![(2 * blocks, Some(CommandOutcome::Refused(Refusal::DigestMismatch { held: 0xABCD })))],
                ..Scripted::new(1)
            },
            "the flight computer refuses the arming: it holds parameters with the digest 0x0000abcd",
        ),
        (
            Scripted { overrides: (0..99).map(|n| (n, None)).collect(), ..Scripted::new(1) },
            "the flight computer does not answer the loading of the modes block",
        ),
    ];
    for (mut computer, sentence) in cases {
        let End::Failed(error) = fly(&mut session("msl", &[]), &mut computer) else { panic!("{sentence}") };
        assert!(error.to_string().starts_with(sentence), "said:     {error}\nexpected: {sentence}");
    }
}

#[test]
fn nobody_at_the_other_end_is_reported() {
    let mut conductor = session("msl", &[]);
    while conductor.status().finished.is_none() {
        conductor.timeout();
    }
    let Some(End::Failed(error)) = conductor.status().finished else { panic!("no failure") };
    assert_eq!(error.to_string(), "the flight computer does not answer the greeting (waited 30 s)");
}

#[test]
fn faults_of_the_uplink_lose_and_corrupt_what_they_should() {
    let fault = |kind: &str, more: &str| {
        format!("fault=[{{kind=\"{kind}\", target=\"uplink\", start_s=1.0, duration_s=1.0, parameters={{{more}}}}}]")
    };
    let (mut conductor, mut computer) = (session("msl", &[&fault("dropout", "")]), Scripted::new(200));
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    // 50 inertial, 10 pressure samples and one radio measurement.
    assert_eq!(computer.counters.lost, 61);

    let (mut conductor, mut computer) = (session("msl", &[&fault("bit-flips", "per_packet=0.5")]), Scripted::new(200));
    assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
    let counters = computer.counters;
    let rejected = counters.cobs + counters.crc + counters.decode;
    // Binomial(61, 0.5): 3σ is 12. A flip of a delimiter costs two frames, one in zero costs one more reject.
    assert!((18..=45).contains(&rejected), "{counters:?}");
}

#[test]
fn an_overrun_of_the_flight_computer_is_asked_for_once_in_its_first_frame() {
    for (start_s, first) in [(1.0, 50), (0.0, 1)] {
        let fault = format!("fault=[{{kind=\"overrun\", target=\"computer\", start_s={start_s:.1}, duration_s=0.5}}]");
        let (mut conductor, mut computer) = (session("msl", &[&fault]), Scripted::new(200));
        assert_eq!(fly(&mut conductor, &mut computer), End::Deployed);
        let wanted = Uplink::Command(Command::Inject(Injection::Overrun { frames: 25 }));
        let injected: Vec<_> = computer.heard.iter().filter(|(_, packet)| *packet == wanted).collect();
        assert_eq!(injected.len(), 1);
        assert_eq!(injected[0].0, MissionTime::of_frame(first));
    }
}
