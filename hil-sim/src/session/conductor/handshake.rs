//! Before the flight: what each phase says and what the answers lead to.

use fsw_core::link::packet::{Command, CommandOutcome, Downlink, Hello, Refusal, Uplink};
use fsw_core::link::parameters::{BlockId, ParameterBlock};

use super::{Conductor, Phase, Plant, SessionError, refusal};

/// Identity that the conductor gives in its greeting.
const BUILD_ID: u64 = 0;

impl<P: Plant> Conductor<P> {
    /// Queues what the present phase has to say, under a new number.
    pub(super) fn say(&mut self) {
        let command = match self.phase {
            Phase::Greeting => {
                self.send(Uplink::Hello(Hello::ours(BUILD_ID)));
                return;
            }
            Phase::Loading => Command::Load(self.plan.blocks[self.block].clone()),
            Phase::Verifying => Command::ReadBack(id_of(&self.plan.blocks[self.block])),
            Phase::Arming => Command::Arm { digest: self.config.digest() },
            Phase::Starting => Command::Go { pace: self.pace },
            Phase::Flying | Phase::Finished => return,
        };
        self.outstanding = Some(self.sender.next_sequence());
        self.send(Uplink::Command(command));
    }

    /// What the outstanding command asks, in words.
    pub(super) fn what_is_asked(&self) -> String {
        let block = || self.plan.blocks.get(self.block).map_or_else(String::new, |b| refusal::name(id_of(b)));
        match self.phase {
            Phase::Loading => format!("the loading of the {}", block()),
            Phase::Verifying => format!("the read-back of the {}", block()),
            Phase::Arming => "the arming".into(),
            Phase::Starting => "the start".into(),
            Phase::Greeting | Phase::Flying | Phase::Finished => "the greeting".into(),
        }
    }

    pub(super) fn hear(&mut self, packet: Downlink) {
        match packet {
            Downlink::Hello(hello) if self.phase == Phase::Greeting => match hello.check() {
                Ok(()) => self.enter(Phase::Loading),
                Err(error) => self.fail(SessionError::Hello { peer: "flight computer", error }),
            },
            Downlink::CommandReply(reply) if self.outstanding == Some(reply.to_sequence) => {
                self.answered(reply.outcome)
            }
            // A reply to a repeat, when the first one had already been obeyed, or to something long settled.
            Downlink::Actuator(actuator) if self.phase == Phase::Flying => self.commanded(&actuator),
            _ => {}
        }
    }

    fn enter(&mut self, phase: Phase) {
        self.phase = phase;
        self.block = 0;
        self.repeats = 0;
        self.outstanding = None;
        if phase == Phase::Flying {
            self.begin_flight();
        } else {
            self.say();
        }
    }

    /// Takes the answer to the outstanding command.
    fn answered(&mut self, outcome: CommandOutcome) {
        let repeated = self.repeats > 0;
        match (self.phase, outcome) {
            (Phase::Loading, CommandOutcome::Accepted) => self.next_block(Phase::Verifying),
            (Phase::Verifying, CommandOutcome::Block(held)) => {
                let sent = &self.plan.blocks[self.block];
                if held == *sent {
                    self.next_block(Phase::Arming);
                } else {
                    let (sent, held) = (format!("{sent:?}"), format!("{held:?}"));
                    let block = refusal::name(id_of(&self.plan.blocks[self.block]));
                    self.fail(SessionError::ReadBack { block, sent, held });
                }
            }
            (Phase::Arming, CommandOutcome::Accepted) => self.enter(Phase::Starting),
            (Phase::Starting, CommandOutcome::Accepted) => self.enter(Phase::Flying),
            // The first of two equal commands was obeyed and only its answer was lost.
            (Phase::Arming, CommandOutcome::Refused(Refusal::AlreadyArmed)) if repeated => self.enter(Phase::Starting),
            (Phase::Starting, CommandOutcome::Refused(Refusal::WrongMode)) if repeated => self.enter(Phase::Flying),
            (_, CommandOutcome::Refused(why)) => {
                self.fail(SessionError::Refused { what: self.what_is_asked(), reason: refusal::explain(why) });
            }
            (_, other) => self.fail(SessionError::Refused {
                what: self.what_is_asked(),
                reason: format!("its answer makes no sense here ({other:?})"),
            }),
        }
    }

    fn next_block(&mut self, after_the_last: Phase) {
        self.block += 1;
        self.repeats = 0;
        if self.block < self.plan.blocks.len() {
            self.say();
        } else {
            self.enter(after_the_last);
        }
    }
}

/// The name of a block.
fn id_of(block: &ParameterBlock) -> BlockId {
    match block {
        ParameterBlock::Modes(_) => BlockId::Modes,
        ParameterBlock::Planet(_) => BlockId::Planet,
        ParameterBlock::Vehicle(_) => BlockId::Vehicle,
        ParameterBlock::AeroRows(rows) => BlockId::AeroRows(rows.start),
        ParameterBlock::Atmosphere(_) => BlockId::Atmosphere,
        ParameterBlock::AtmosphereRows(rows) => BlockId::AtmosphereRows(rows.start),
        ParameterBlock::Target(_) => BlockId::Target,
        ParameterBlock::Deploy(_) => BlockId::Deploy,
        ParameterBlock::Source { slot, .. } => BlockId::Source(*slot),
        ParameterBlock::InitialKnowledge(_) => BlockId::InitialKnowledge,
        ParameterBlock::Navigation(_) => BlockId::Navigation,
        ParameterBlock::Guidance(_) => BlockId::Guidance,
        ParameterBlock::Constraints(_) => BlockId::Constraints,
        ParameterBlock::Control(_) => BlockId::Control,
        ParameterBlock::Estimators(_) => BlockId::Estimators,
    }
}
