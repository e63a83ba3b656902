//! The hard flights on a board behind a serial line: flown by the board in lock-step, while it reports what each of its
//! frames cost, by whatever its own counter counts.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fsw_core::link::packet::{Command, CommandOutcome, Downlink, Injection, Refusal};

use super::args::Unit;
use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::FlightCost;
use super::table::{Budgets, Flown};
use super::uplink::greeting_and;
use crate::ends::ComputerEnd;
use crate::error::HostError;
use crate::fly::fly_watched;
use crate::linklog::Direction;
use crate::pump::Watch;
use crate::record::End;
use crate::recorder::Recorder;
use crate::tap::{Heard, Tap};
use crate::target::{RemoteComputer, TargetError};

/// Times that a command is sent before the board counts as silent. An unanswered greeting takes half a second.
const ATTEMPTS: u32 = 20;
/// How long the user may take to reset a board.
const RESET_PATIENCE: Duration = Duration::from_secs(120);
/// Time between two looks at whether it was.
const GLANCE: Duration = Duration::from_millis(200);

/// A board that is measured.
pub struct Line<'a> {
    end: RemoteComputer,
    place: &'a str,
    interrupt: &'a AtomicBool,
    attempts: u32,
    reset_patience: Duration,
}

impl<'a> Line<'a> {
    /// A board that has not been spoken to. `place` names it in errors.
    #[must_use]
    pub const fn new(end: RemoteComputer, place: &'a str, interrupt: &'a AtomicBool) -> Self {
        Self { end, place, interrupt, attempts: ATTEMPTS, reset_patience: RESET_PATIENCE }
    }

    /// Flies and measures one flight after the other. An interrupt ends it with those that are done.
    ///
    /// # Errors
    /// The board is silent, lost, of another protocol, was not reset in time, or reports no cost.
    pub fn measure(mut self, flights: &[HardFlight], bar: &Bar) -> Result<Vec<Flown>, HostError> {
        let mut all = Vec::with_capacity(flights.len());
        for flight in flights {
            bar.at(all.len(), &flight.name);
            match self.begin_afresh(bar).and_then(|()| self.fly(flight, all.len(), bar)) {
                Ok(cost) => all.push(cost),
                Err(_) if self.interrupt.load(Ordering::Relaxed) => {
                    if all.is_empty() {
                        return Err(TargetError::Interrupted.into());
                    }
                    bar.tell(&format!("interrupted: the figures are of the {} flights before", all.len()));
                    break;
                }
                Err(error) => return Err(error),
            }
        }
        Ok(all)
    }

    /// Brings the board into `Standby` as after power-on, whatever it has flown before: by command where its image
    /// obeys that, else by the user's hand.
    fn begin_afresh(&mut self, bar: &Bar) -> Result<(), HostError> {
        let restart = Command::Inject(Injection::Restart);
        if self.insist(restart)? == CommandOutcome::Accepted || is_fresh(self.insist(QUESTION)?) {
            return Ok(());
        }
        let place = self.place;
        bar.tell(&format!(
            "reset the flight computer {place}: the image `flight` flies once per boot (`measure` begins again by itself)"
        ));
        let due = Instant::now() + self.reset_patience;
        let question = greeting_and(QUESTION);
        while !self.tell(&question)?.is_some_and(is_fresh) {
            if Instant::now() >= due {
                let waited_s = self.reset_patience.as_secs();
                let flown = "is still in a flight that it has flown before and was not reset within";
                return Err(HostError::Option(format!("the flight computer {place} {flown} {waited_s} s")));
            }
            std::thread::sleep(GLANCE);
        }
        Ok(())
    }

    fn fly(&mut self, flight: &HardFlight, done: usize, bar: &Bar) -> Result<Flown, HostError> {
        let (HardFlight { name, scenario, id, predicts }, place) = (flight, self.place);
        if self.insist(Command::ReportCost { on: true })? != CommandOutcome::Accepted {
            return Err(HostError::Option(format!("the flight computer {place} refuses to report its cost")));
        }
        let mut listener = Listener::new(bar, name, done);
        self.end.start_over();
        let record = fly_watched(scenario, *id, &mut self.end, &mut listener)?;
        let Listener { cost, damaged, .. } = listener;
        match record.end {
            End::Interrupted => return Err(TargetError::Interrupted.into()),
            End::Failed(reason) => return Err(HostError::Option(format!("the flight \"{name}\" failed: {reason}"))),
            End::Deployed | End::Ground | End::TimeLimit => {}
        }
        if damaged > 0 {
            bar.tell(&format!("{damaged} packets of \"{name}\" came damaged: the costs of some frames may be missing"));
        }
        if cost.frames.is_empty() {
            let said = format!("the flight computer {place} flew \"{name}\" but sent no cost of any frame (CostTlm)");
            return Err(HostError::Option(said));
        }
        if cost.frames.iter().all(|frame| frame.whole == 0) {
            let said = format!("the counter of the flight computer {place} stands still: every frame cost 0");
            return Err(HostError::Option(said));
        }
        Ok(Flown { name: name.clone(), predicts: *predicts, cost })
    }

    /// Sends a command until the board says what became of it.
    fn insist(&mut self, command: Command) -> Result<CommandOutcome, HostError> {
        let packets = greeting_and(command);
        for _ in 0..self.attempts {
            if let Some(outcome) = self.tell(&packets)? {
                return Ok(outcome);
            }
        }
        // One that has flown answers a few commands and then no more: its frame does not end.
        let (place, waited_s) = (self.place, self.attempts / 2);
        let ask = "is it switched on, and reset since its last flight?";
        Err(HostError::Option(format!("the flight computer {place} does not answer within {waited_s} s: {ask}")))
    }

    /// Sends a greeting and a command once; what the board answered to the command.
    fn tell(&mut self, packets: &[u8]) -> Result<Option<CommandOutcome>, HostError> {
        // What it says about restarts of long ago is no news; and it may have been reset since the last time.
        self.end.start_over();
        let (mut answer, mut outcome, mut refused) = (Vec::new(), None, None);
        self.end.exchange(packets, &mut answer, None)?;
        Tap::<Downlink>::default().feed(&answer, |_, heard| match heard {
            Heard::Packet(frame) => match frame.packet {
                Downlink::Hello(hello) => refused = hello.check().err(),
                Downlink::CommandReply(reply) => outcome = Some(reply.outcome),
                _ => {}
            },
            Heard::Damaged(_) | Heard::Nothing => {}
        });
        match refused {
            Some(error) => Err(HostError::Link(format!("the flight computer {} is refused: {error}", self.place))),
            None => Ok(outcome),
        }
    }
}

/// A command that a board in `Standby` refuses because the digest is wrong, and one that has flown because it is armed.
const QUESTION: Command = Command::Arm { digest: 0 };

const fn is_fresh(answer: CommandOutcome) -> bool {
    matches!(answer, CommandOutcome::Refused(Refusal::DigestMismatch { .. }))
}

/// Adds up the costs, and moves the bar.
struct Listener<'a> {
    bar: &'a Bar,
    name: &'a str,
    done: usize,
    tap: Tap<Downlink>,
    cost: FlightCost,
    damaged: u32,
    shown_s: f64,
}

impl<'a> Listener<'a> {
    fn new(bar: &'a Bar, name: &'a str, done: usize) -> Self {
        Self { bar, name, done, tap: Tap::default(), cost: FlightCost::default(), damaged: 0, shown_s: 0.0 }
    }
}

impl Watch for Listener<'_> {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        if direction == Direction::Down {
            let (cost, damaged) = (&mut self.cost, &mut self.damaged);
            self.tap.feed(bytes, |_, heard| match heard {
                Heard::Packet(frame) => cost.hear(&frame.packet),
                Heard::Damaged(_) => *damaged += 1,
                Heard::Nothing => {}
            });
        }
        Ok(())
    }

    fn progress(&mut self, recorder: &Recorder) {
        let time_s = recorder.last_truth().map_or(0.0, |truth| truth.time_s);
        if time_s >= self.shown_s + 1.0 {
            self.shown_s = time_s;
            self.bar.at(self.done, &format!("{}, {time_s:.0} s", self.name));
        }
    }
}

/// What the figures are held against.
#[must_use]
pub const fn budgets(unit: Option<Unit>) -> Budgets {
    match unit {
        None => Budgets::None,
        Some(Unit::Cycles) => Budgets::Cycles,
        Some(Unit::Instructions) => Budgets::Instructions(None),
    }
}

/// What the figures are, in words.
#[must_use]
pub const fn granularity(unit: Option<Unit>) -> &'static str {
    match unit {
        None => {
            "counts of the board's own counter; no budget applies (--unit cycles or --unit instructions says what it \
             counts)"
        }
        Some(Unit::Cycles) => "cycles, by the board's own counter",
        Some(Unit::Instructions) => "instructions, by the board's own counter",
    }
}

#[cfg(test)]
#[path = "line_tests.rs"]
mod tests;
