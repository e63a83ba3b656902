//! A flight computer by script, for tests: obeys commands, flies a constant command, fires at a given frame.

use fsw_core::config::Config;
use fsw_core::link::framing::{FrameBytes, MAX_FRAME};
use fsw_core::link::packet::{
    Actuator, Command, CommandOutcome, CommandReply, Downlink, Hello, RejectCounters, Uplink,
};
use fsw_core::link::receiver::{Receiver, Sender};
use fsw_core::time::MissionTime;

/// See the module.
pub struct Scripted {
    pub hello: Hello,
    pub config: Config,
    pub fire_at_frame: u32,
    pub bank_accel_radps2: f64,
    /// Answers to give instead of the honest ones, by number of the command.
    pub overrides: Vec<(usize, Option<CommandOutcome>)>,
    /// Frames whose actuator command is swallowed.
    pub mute_frames: std::ops::Range<u32>,
    pub commands_heard: Vec<Command>,
    pub heard: Vec<(MissionTime, Uplink)>,
    pub counters: RejectCounters,
    pub receiver: Receiver<Uplink>,
    pub sender: Sender,
    pub frame: u32,
}

impl Scripted {
    pub fn new(fire_at_frame: u32) -> Self {
        Self {
            hello: Hello::ours(7),
            config: Config::DEFAULT,
            fire_at_frame,
            bank_accel_radps2: 0.0,
            overrides: Vec::new(),
            mute_frames: 0..0,
            commands_heard: Vec::new(),
            heard: Vec::new(),
            counters: RejectCounters::default(),
            receiver: Receiver::new(),
            sender: Sender::new(),
            frame: 0,
        }
    }

    pub fn receive(&mut self, bytes: &[u8], out: &mut Vec<u8>) {
        for &byte in bytes {
            let Some(frame) = self.receiver.push(byte, &mut self.counters) else { continue };
            self.heard.push((frame.time, frame.packet.clone()));
            let answer = match frame.packet {
                Uplink::Hello(_) => Some(Downlink::Hello(self.hello.clone())),
                Uplink::Command(command) => {
                    let number = self.commands_heard.len();
                    self.commands_heard.push(command.clone());
                    let honest = Some(self.obey(&command));
                    let forced = self.overrides.iter().find(|(n, _)| *n == number).map(|(_, outcome)| outcome.clone());
                    forced
                        .unwrap_or(honest)
                        .map(|outcome| Downlink::CommandReply(CommandReply { to_sequence: frame.sequence, outcome }))
                }
                Uplink::Imu(_) => {
                    self.frame = frame.time.frame_index();
                    let fire = if self.frame >= self.fire_at_frame { Actuator::MORTAR_FIRE } else { 0 };
                    (!self.mute_frames.contains(&self.frame)).then(|| {
                        Downlink::Actuator(Actuator {
                            frame: self.frame,
                            bank_accel_radps2: self.bank_accel_radps2,
                            discretes: fire,
                            ..Actuator::default()
                        })
                    })
                }
                _ => None,
            };
            let mut room: FrameBytes = [0; MAX_FRAME];
            if let Some(answer) = answer {
                out.extend_from_slice(
                    self.sender.encode(MissionTime::of_frame(self.frame), &answer, &mut room).unwrap(),
                );
            }
        }
    }

    fn obey(&mut self, command: &Command) -> CommandOutcome {
        match command {
            Command::Load(block) => match self.config.apply(block) {
                Ok(()) => CommandOutcome::Accepted,
                Err(refusal) => CommandOutcome::Refused(refusal),
            },
            Command::ReadBack(id) => CommandOutcome::Block(self.config.read_back(*id).unwrap()),
            Command::Arm { digest } => {
                assert_eq!(*digest, self.config.digest());
                CommandOutcome::Accepted
            }
            _ => CommandOutcome::Accepted,
        }
    }
}
