//! Carries bytes between the truth and the flight computer until the flight is over, and listens to all of them.
//!
//! Truth packets are a tap for the recorder: they are taken out of the stream before the flight computer and before
//! `link.bin`, unless the navigation mode is `ideal`, which flies on them. So the flight computer sees the same bytes
//! wherever the truth runs, in whatever chunks they arrive.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use fsw_core::link::handshake::HelloError;
use fsw_core::link::packet::{Downlink, Uplink};
use fsw_core::link::parameters::NavigationMode;
use fsw_core::time::MissionTime;
use hil_sim::session::TruthEnd;

use crate::ends::{ComputerEnd, ComputerError};
use crate::linklog::Direction;
use crate::realtime::FrameClock;
use crate::record::{End, FlightRecord};
use crate::recorder::Recorder;
use crate::tap::{Heard, Tap};

/// Exchanges in a row in which neither end says anything before the flight counts as dead.
const MAX_SILENT_EXCHANGES: u32 = 1_000;

/// Bytes without a single packet among them for so long, and the truth counts as lost.
const NOISE_PATIENCE: Duration = Duration::from_secs(10);

/// Who watches a flight; every method has a default that does nothing.
pub trait Watch {
    /// A piece of the link, in order, as it goes to or comes from the flight computer.
    ///
    /// # Errors
    /// It cannot be kept; the flight ends as failed.
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        let _ = (direction, bytes);
        Ok(())
    }

    /// The flight has come a step further.
    fn progress(&mut self, recorder: &Recorder) {
        let _ = recorder;
    }
}

/// Nobody watches.
pub struct Unwatched;

impl Watch for Unwatched {}

/// How to run the link.
#[derive(Clone, Copy, Debug)]
pub struct Pace<'a> {
    /// Hold every frame until its time on the wall clock.
    pub realtime: bool,
    /// Set from outside to end the flight.
    pub interrupt: &'a AtomicBool,
}

/// Flies until the flight is over or an end is lost; whatever was heard until then is in the record.
pub fn fly(
    truth: &mut dyn TruthEnd,
    computer: &mut dyn ComputerEnd,
    recorder: Recorder,
    watch: &mut dyn Watch,
    pace: Pace<'_>,
) -> FlightRecord {
    fly_with(truth, computer, recorder, watch, pace, NOISE_PATIENCE)
}

fn fly_with(
    truth: &mut dyn TruthEnd,
    computer: &mut dyn ComputerEnd,
    recorder: Recorder,
    watch: &mut dyn Watch,
    pace: Pace<'_>,
    noise_patience: Duration,
) -> FlightRecord {
    let start = Instant::now();
    let flies_on_truth = recorder.facts().navigation == NavigationMode::Ideal;
    let mut pump = Pump {
        recorder,
        watch,
        flies_on_truth,
        up: Tap::default(),
        down: Tap::default(),
        to_computer: Vec::with_capacity(4_096),
        frame_ended: None,
        log_failure: None,
        refused: None,
        last_packet: start,
        noise_patience,
        clock: pace.realtime.then(FrameClock::default),
    };
    let end = pump.run(truth, computer, pace.interrupt);
    if let Some(clock) = &pump.clock {
        pump.recorder.realtime(clock.report());
    }
    pump.recorder.finish(end, start.elapsed().as_secs_f64())
}

struct Pump<'a> {
    recorder: Recorder,
    watch: &'a mut dyn Watch,
    flies_on_truth: bool,
    up: Tap<Uplink>,
    down: Tap<Downlink>,
    /// What this exchange hands to the flight computer.
    to_computer: Vec<u8>,
    /// Time of the inertial packet in it, if one is there.
    frame_ended: Option<MissionTime>,
    log_failure: Option<io::Error>,
    /// Why the truth end is none to fly with.
    refused: Option<HelloError>,
    /// When the truth end was last understood.
    last_packet: Instant,
    noise_patience: Duration,
    clock: Option<FrameClock>,
}

impl Pump<'_> {
    fn run(&mut self, truth: &mut dyn TruthEnd, computer: &mut dyn ComputerEnd, interrupt: &AtomicBool) -> End {
        let (mut from_truth, mut from_computer) = (Vec::with_capacity(4_096), Vec::with_capacity(4_096));
        let mut silent = 0;
        loop {
            if interrupt.load(Ordering::Relaxed) {
                return End::Interrupted;
            }
            from_truth.clear();
            if let Err(loss) = truth.exchange(&from_computer, &mut from_truth) {
                // An interrupt reaches a truth simulator of our own too, and may cut the link before we see it.
                let interrupted = interrupt.load(Ordering::Relaxed);
                return if interrupted { End::Interrupted } else { End::Failed(self.at_time(&loss.to_string())) };
            }
            self.hear_truth(&from_truth);
            if let Some(error) = self.refused {
                return End::Failed(self.at_time(&format!("the truth simulator is refused: {error}")));
            }
            if !from_truth.is_empty() && self.last_packet.elapsed() > self.noise_patience {
                let waited_s = self.noise_patience.as_secs_f64();
                let what = format!("the truth simulator has sent no packet among its bytes for {waited_s} s");
                return End::Failed(self.at_time(&what));
            }
            from_computer.clear();
            let answered = self.run_computer(computer, &mut from_computer);
            self.hear_computer(&from_computer);
            if let Err(loss) = answered {
                let interrupted = loss == ComputerError::Interrupted || interrupt.load(Ordering::Relaxed);
                return if interrupted { End::Interrupted } else { End::Failed(self.at_time(&loss.to_string())) };
            }
            self.watch.progress(&self.recorder);
            if let Some(e) = self.log_failure.take() {
                return End::Failed(self.at_time(&format!("link.bin cannot be written: {e}")));
            }
            if let Some(end) = self.recorder.over().cloned() {
                // Let the other end hear the last words too; whether it still listens does not matter any more.
                from_truth.clear();
                let _ = truth.exchange(&from_computer, &mut from_truth);
                return end;
            }
            silent = if from_truth.is_empty() && from_computer.is_empty() { silent + 1 } else { 0 };
            if silent > MAX_SILENT_EXCHANGES {
                return End::Failed(self.at_time("both ends of the link fell silent"));
            }
        }
    }

    fn at_time(&self, what: &str) -> String {
        match self.recorder.last_truth() {
            Some(truth) => format!("{what} (at t = {:.2} s)", truth.time_s),
            None => format!("{what} (before the first frame)"),
        }
    }

    /// Sorts what the truth end sent: truth packets to the recorder, the rest to the flight computer and the log.
    fn hear_truth(&mut self, bytes: &[u8]) {
        self.to_computer.clear();
        self.frame_ended = None;
        let (recorder, to_computer, watch) = (&mut self.recorder, &mut self.to_computer, &mut *self.watch);
        let (frame_ended, log_failure, flies_on_truth) =
            (&mut self.frame_ended, &mut self.log_failure, self.flies_on_truth);
        let (refused, last_packet) = (&mut self.refused, &mut self.last_packet);
        self.up.feed(bytes, |piece, heard| {
            // Nothing of the frame in which the flight ended reaches the flight computer, however it was chunked.
            if recorder.over().is_some() {
                return;
            }
            if let Heard::Packet(frame) = &heard {
                *last_packet = Instant::now();
                match &frame.packet {
                    Uplink::Hello(hello) => *refused = hello.check().err(),
                    Uplink::Truth(packet) => {
                        recorder.truth(frame.time, packet);
                        if !flies_on_truth || recorder.over().is_some() {
                            return;
                        }
                    }
                    Uplink::Imu(_) => *frame_ended = Some(frame.time),
                    _ => {}
                }
            }
            to_computer.extend_from_slice(piece);
            if let Err(e) = watch.link(Direction::Up, piece) {
                log_failure.get_or_insert(e);
            }
        });
    }

    fn run_computer(
        &mut self,
        computer: &mut dyn ComputerEnd,
        from_computer: &mut Vec<u8>,
    ) -> Result<(), ComputerError> {
        if self.to_computer.is_empty() {
            return Ok(());
        }
        let until = match (&mut self.clock, self.frame_ended) {
            (Some(clock), Some(time)) => Some(clock.wait_for(time)),
            _ => None,
        };
        let answered = computer.exchange(&self.to_computer, from_computer, until);
        if let (Some(clock), Some(due)) = (&mut self.clock, until) {
            clock.answered(Instant::now(), due);
        }
        if let Some(cost) = computer.take_cost() {
            self.recorder.frame_cost(&cost);
        }
        self.recorder.count_bytes(self.to_computer.len(), from_computer.len());
        answered
    }

    fn hear_computer(&mut self, bytes: &[u8]) {
        let (recorder, watch, log_failure) = (&mut self.recorder, &mut *self.watch, &mut self.log_failure);
        self.down.feed(bytes, |piece, heard| {
            match heard {
                Heard::Packet(frame) => recorder.downlink(frame),
                Heard::Damaged(_) => recorder.downlink_damaged(),
                Heard::Nothing => {}
            }
            if let Err(e) = watch.link(Direction::Down, piece) {
                log_failure.get_or_insert(e);
            }
        });
    }
}

#[cfg(test)]
mod tests;
