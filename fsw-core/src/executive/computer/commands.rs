//! What is answered: greetings and commands.

use super::{FlightComputer, Restart};
use crate::link::packet::{Command, CommandOutcome, Downlink, EventKind, Hello, Injection, Mode, Refusal, Severity};
use crate::link::parameters::BlockId;
use crate::probe::Probe;
use crate::time::MissionTime;

/// Commands and greetings answered within a minor frame of the flight, at most; more are counted and dropped.
pub const ANSWERS_PER_FRAME: u8 = 4;

impl FlightComputer {
    /// Whether this minor frame of the flight has answered as many commands and greetings as it may; counts this one.
    pub(super) fn is_flooded(&mut self) -> bool {
        if self.executive.mode() == Mode::Standby {
            return false;
        }
        let frame = self.executive.frame();
        let (of_frame, answered) = self.answered;
        let answered = if of_frame == frame { answered } else { 0 };
        self.answered = (frame, answered.saturating_add(1));
        answered >= ANSWERS_PER_FRAME
    }

    /// The answer to a Hello is ours, whatever theirs says, so that the peer can tell its user what differs. Nothing
    /// else of a peer that does not match is listened to: bytes that happen to decode would mean something else to it.
    /// In flight a greeting changes nothing: a stray one must not cut the vehicle off from its sensors.
    #[inline(never)] // its stack shall not lie under every minor frame
    pub(super) fn greet(&mut self, theirs: &Hello, probe: &mut impl Probe, transmit: &mut impl FnMut(&[u8])) {
        if self.executive.mode() == Mode::Standby {
            self.peer_refused = theirs.check().is_err();
        }
        let ours = Hello::ours(self.build_id);
        self.send(MissionTime::ZERO, &Downlink::Hello(ours), probe, transmit);
        if self.executive.mode() == Mode::Standby {
            self.tell_restart(transmit);
        }
    }

    #[inline(never)] // its stack shall not lie under every minor frame
    pub(super) fn obey(&mut self, command: Command, now: MissionTime) -> CommandOutcome {
        let result = match command {
            Command::Load(_) if self.executive.is_armed() => Err(Refusal::AlreadyArmed),
            Command::Load(block) => self.executive.config.apply(&block),
            Command::ReadBack(id) => return self.read_back(id),
            Command::Arm { digest } => self.arm(digest, now),
            Command::Go { .. } if !self.executive.is_armed() => Err(Refusal::NotArmed),
            Command::Go { pace } => self.executive.go(pace).then_some(()).ok_or(Refusal::WrongMode),
            Command::Inject(Injection::Overrun { frames }) => {
                self.executive.cost.inject_overrun(frames);
                Ok(())
            }
            Command::Inject(Injection::Restart) if self.restart == Restart::Refused => Err(Refusal::WrongMode),
            Command::Inject(Injection::Restart) => {
                self.restart = Restart::Asked;
                Ok(())
            }
            Command::ReportCost { on } => {
                self.reports_cost = on;
                Ok(())
            }
        };
        match result {
            Ok(()) => CommandOutcome::Accepted,
            Err(refusal) => CommandOutcome::Refused(refusal),
        }
    }

    fn read_back(&self, id: BlockId) -> CommandOutcome {
        match self.executive.config.read_back(id) {
            Some(block) => CommandOutcome::Block(block),
            None => CommandOutcome::Refused(Refusal::BadTable { block: id }),
        }
    }

    fn arm(&mut self, digest: u32, now: MissionTime) -> Result<(), Refusal> {
        if self.executive.is_armed() {
            return Err(Refusal::AlreadyArmed);
        }
        let held = self.executive.config.digest();
        if held != digest {
            return Err(Refusal::DigestMismatch { held });
        }
        self.executive.config.validate()?;
        self.executive.arm().map_err(|_| Refusal::BadTable { block: BlockId::AtmosphereRows(0) })?;
        self.executive.log.record(now, Severity::Activity, EventKind::Armed { digest });
        Ok(())
    }
}
