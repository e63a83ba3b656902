//! The flight computer as its link sees it: session, lock-step frames, gaps, refusals.

use std::vec::Vec;

use super::*;
use crate::config::Config;
use crate::link::packet::{Command, CommandOutcome, Hello, Imu, Injection, Refusal, RejectCounters};
use crate::link::parameters::{BlockId, ParameterBlock};

/// A ground that numbers its packets and keeps what comes back.
struct Ground {
    computer: FlightComputer,
    sender: Sender,
    receiver: Receiver<Downlink>,
    counters: RejectCounters,
    heard: Vec<Downlink>,
}

impl Ground {
    fn new() -> Self {
        Self {
            computer: FlightComputer::new(7),
            sender: Sender::new(),
            receiver: Receiver::new(),
            counters: RejectCounters::default(),
            heard: Vec::new(),
        }
    }

    fn armed() -> Self {
        let mut ground = Self::new();
        ground.hello();
        assert_eq!(ground.command(Command::Arm { digest: Config::DEFAULT.digest() }), CommandOutcome::Accepted);
        ground
    }

    fn flying() -> Self {
        let mut ground = Self::armed();
        assert_eq!(ground.command(Command::Go { pace: Pace::LockStep }), CommandOutcome::Accepted);
        ground
    }

    fn send(&mut self, time: MissionTime, packet: Uplink) -> Vec<Downlink> {
        let mut out = [0; MAX_FRAME];
        let bytes = self.sender.encode(time, &packet, &mut out).unwrap();
        let Self { computer, receiver, counters, heard, .. } = self;
        heard.clear();
        computer.receive(bytes, |frame| {
            heard.extend(frame.iter().filter_map(|b| receiver.push(*b, counters)).map(|f| f.packet));
        });
        self.heard.clone()
    }

    fn hello(&mut self) -> Vec<Downlink> {
        self.send(MissionTime::ZERO, Uplink::Hello(Hello::ours(1)))
    }

    fn command(&mut self, command: Command) -> CommandOutcome {
        let heard = self.send(MissionTime::ZERO, Uplink::Command(command));
        let reply = heard.into_iter().find_map(|p| if let Downlink::CommandReply(r) = p { Some(r) } else { None });
        reply.expect("every command is answered").outcome
    }

    fn imu(&mut self, frame: u32) -> Vec<Actuator> {
        let heard = self.send(MissionTime::of_frame(frame), Uplink::Imu(Imu::default()));
        heard.into_iter().filter_map(|p| if let Downlink::Actuator(a) = p { Some(a) } else { None }).collect()
    }

    fn rejects(&self) -> RejectCounters {
        self.computer.executive().rejects
    }
}

#[test]
fn hello_is_answered_by_hello() {
    let mut ground = Ground::new();
    assert_eq!(ground.hello(), [Downlink::Hello(Hello::ours(7))]);
}

#[test]
fn a_peer_of_another_version_is_told_so_and_not_obeyed() {
    let mut ground = Ground::new();
    let other = Hello { protocol_version: 999, ..Hello::ours(1) };
    assert_eq!(ground.send(MissionTime::ZERO, Uplink::Hello(other)).len(), 1);
    assert!(ground.send(MissionTime::ZERO, Uplink::Command(Command::Go { pace: Pace::LockStep })).is_empty());
    assert_eq!(ground.rejects().decode, 1);
    ground.hello();
    assert_eq!(ground.command(Command::Go { pace: Pace::LockStep }), CommandOutcome::Refused(Refusal::NotArmed));
}

#[test]
fn parameters_are_read_back_and_frozen_by_arming() {
    let mut ground = Ground::new();
    ground.hello();
    let block = ParameterBlock::Target(crate::link::parameters::Target { longitude_rad: 0.25, latitude_rad: -0.5 });
    assert_eq!(ground.command(Command::Load(block.clone())), CommandOutcome::Accepted);
    assert_eq!(ground.command(Command::ReadBack(BlockId::Target)), CommandOutcome::Block(block.clone()));
    let held = ground.computer.executive().config.digest();
    let wrong = Command::Arm { digest: held ^ 1 };
    assert_eq!(ground.command(wrong), CommandOutcome::Refused(Refusal::DigestMismatch { held }));
    assert_eq!(ground.command(Command::Arm { digest: held }), CommandOutcome::Accepted);
    assert_eq!(ground.command(Command::Load(block)), CommandOutcome::Refused(Refusal::AlreadyArmed));
}

#[test]
fn go_needs_arming_and_works_once() {
    let mut ground = Ground::new();
    ground.hello();
    assert_eq!(ground.command(Command::Go { pace: Pace::LockStep }), CommandOutcome::Refused(Refusal::NotArmed));
    let mut ground = Ground::flying();
    assert_eq!(ground.command(Command::Go { pace: Pace::LockStep }), CommandOutcome::Refused(Refusal::WrongMode));
}

#[test]
fn nothing_flies_before_go() {
    let mut ground = Ground::armed();
    assert!(ground.imu(1).is_empty());
    assert_eq!(ground.computer.executive().mode(), Mode::Standby);
}

#[test]
fn each_inertial_packet_closes_one_frame_with_one_actuator_command() {
    let mut ground = Ground::flying();
    for frame in 1..=120 {
        let actuators = ground.imu(frame);
        assert_eq!(actuators.iter().map(|a| a.frame).collect::<Vec<_>>(), [frame]);
        assert!(matches!(ground.heard.last(), Some(Downlink::Actuator(_))), "the actuator packet ends the frame");
    }
}

#[test]
fn missing_frames_are_run_without_a_measurement_and_counted() {
    let mut ground = Ground::flying();
    ground.imu(1);
    let frames: Vec<_> = ground.imu(5).iter().map(|a| a.frame).collect();
    assert_eq!(frames, [2, 3, 4, 5]);
    assert_eq!(ground.rejects().missed_frames, 3);
}

#[test]
fn a_jump_in_time_is_worked_off_in_bounded_pieces_and_the_flight_goes_on() {
    let mut ground = Ground::flying();
    ground.imu(1);
    let mut frame = 1 + 3 * MAX_BRIDGED_FRAMES;
    assert!(ground.imu(frame).is_empty(), "one time stamp is not believed");
    frame += 1;
    assert_eq!(ground.imu(frame).len() as u32, MAX_BRIDGED_FRAMES);
    while ground.computer.executive().frame() < frame {
        frame += 1;
        assert!(ground.imu(frame).len() as u32 <= MAX_BRIDGED_FRAMES + 1);
        assert!(frame < 1000, "never catches up");
    }
    assert_eq!(ground.imu(frame + 1).len(), 1);
}

#[test]
fn old_and_odd_time_stamps_close_no_frame() {
    let mut ground = Ground::flying();
    ground.imu(1);
    ground.imu(2);
    assert!(ground.imu(2).is_empty());
    let odd = MissionTime(FRAME_3_AND_A_HALF_US);
    assert!(ground.send(odd, Uplink::Imu(Imu::default())).is_empty());
    assert_eq!((ground.rejects().late, ground.rejects().range), (1, 1));
    assert_eq!(ground.imu(3).len(), 1);
}

#[test]
fn one_wrong_time_stamp_runs_nothing_ahead_of_the_vehicle() {
    let mut ground = Ground::flying();
    let mut frame = 0;
    for wrong in [MAX_UNCONFIRMED_GAP + 3, 40, 5_000, 200_000, 5_000] {
        frame += 1;
        assert_eq!(ground.imu(frame).len(), 1);
        assert!(ground.imu(frame + wrong).is_empty());
    }
    assert_eq!(ground.imu(frame + 1).len(), 1);
    let rejects = ground.rejects();
    assert_eq!((rejects.early, rejects.missed_frames, rejects.late), (5, 0, 0));
}

#[test]
fn a_stray_greeting_of_another_version_does_not_end_a_flight() {
    let mut ground = Ground::flying();
    assert_eq!(ground.imu(1).len(), 1);
    let other = Hello { protocol_version: 999, ..Hello::ours(1) };
    assert_eq!(ground.send(MissionTime::of_frame(1), Uplink::Hello(other)).len(), 1);
    assert_eq!(ground.imu(2).len(), 1);
}

const FRAME_3_AND_A_HALF_US: u32 = 70_000;

#[test]
fn an_injected_overrun_is_counted_and_survived() {
    let mut ground = Ground::flying();
    assert_eq!(ground.command(Command::Inject(Injection::Overrun { frames: 3 })), CommandOutcome::Accepted);
    for frame in 1..=50 {
        assert_eq!(ground.imu(frame).len(), 1);
    }
    assert_eq!(ground.computer.executive().cost.slips, 3);
}

#[test]
fn a_copy_of_the_computer_flies_on_to_the_same_bytes() {
    let mut ground = Ground::flying();
    for frame in 1..=70 {
        ground.imu(frame);
    }
    let mut copy = ground.computer.clone();
    let mut out = [0; MAX_FRAME];
    let bytes = ground.sender.encode(MissionTime::of_frame(71), &Uplink::Imu(Imu::default()), &mut out).unwrap();
    let (mut a, mut b) = (Vec::new(), Vec::new());
    ground.computer.receive(bytes, |frame| a.extend_from_slice(frame));
    copy.receive(bytes, |frame| b.extend_from_slice(frame));
    assert!(!a.is_empty() && a == b);
}

#[test]
fn a_flood_of_commands_in_flight_is_answered_four_times_a_frame_and_counted() {
    let mut ground = Ground::flying();
    ground.imu(1);
    let read = Command::ReadBack(crate::link::parameters::BlockId::Planet);
    let mut answers = 0;
    for _ in 0..100 {
        answers += ground.send(MissionTime::of_frame(1), Uplink::Command(read.clone())).len();
    }
    assert_eq!(
        (answers, ground.rejects().flooded),
        (usize::from(ANSWERS_PER_FRAME), 100 - u32::from(ANSWERS_PER_FRAME))
    );
    assert_eq!(ground.imu(2).len(), 1);
    assert_eq!(ground.send(MissionTime::of_frame(2), Uplink::Command(read)).len(), 1, "the next frame answers again");
}

/// Every number that a computer remembers.
fn all_of(computer: &FlightComputer) -> std::string::String {
    std::format!("{computer:?}")
}

#[test]
fn a_dormant_computer_that_is_woken_flies_like_a_new_one_to_the_last_bit() {
    let (mut dormant, mut ground) = (Dormant::new(), Ground::new());
    assert_ne!(all_of(&dormant.0), all_of(&ground.computer), "asleep it has no parameters");
    assert_eq!(all_of(dormant.wake(7)), all_of(&ground.computer));
    let mut woken = Ground { computer: dormant.wake(7).clone(), ..Ground::new() };
    for ground in [&mut ground, &mut woken] {
        ground.hello();
        ground.command(Command::Arm { digest: Config::DEFAULT.digest() });
        ground.command(Command::Go { pace: Pace::LockStep });
    }
    for frame in 1..=500 {
        assert_eq!(ground.imu(frame), woken.imu(frame));
    }
    assert_eq!(all_of(&ground.computer), all_of(&woken.computer));
}

#[test]
fn a_computer_that_begins_again_remembers_nothing() {
    let mut ground = Ground::flying();
    ground.computer.allow_restart();
    for frame in 1..=500 {
        ground.imu(frame);
    }
    ground.command(Command::Inject(Injection::Restart));
    assert!(ground.computer.restart_if_asked() && !ground.computer.restart_if_asked());
    let mut new = FlightComputer::new(7);
    new.allow_restart();
    assert_eq!(all_of(&ground.computer), all_of(&new));
}
