//! Hears every packet of a flight, keeps what belongs in the [`FlightRecord`], and knows when the flight is over.

use fsw_core::link::packet::{Actuator, Downlink, Frame, RejectCounters, Truth};
use fsw_core::probe::{MeasuredCost, SLOT_COUNT};
use fsw_core::time::{FRAME, MissionTime};
use sha2::{Digest, Sha256};

use crate::measure::{consistency, truth_sample};
use crate::realtime::RealTime;
use crate::record::{Computer, End, FlightRecord, LinkCounters, ScenarioFacts, Summary, TruthSample};
use crate::{cost, summary};

/// Identity of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlightId {
    /// Seed of the dispersions.
    pub seed: u64,
    /// Run under that seed.
    pub run: u64,
    /// Dispersions off.
    pub nominal: bool,
}

/// Collects one flight.
pub struct Recorder {
    record: FlightRecord,
    hash: Sha256,
    link: LinkCounters,
    computer: Computer,
    realtime: Option<RealTime>,
    time_limit_s: f64,
    over: Option<End>,
}

impl Recorder {
    /// A recorder at the start of a flight.
    #[must_use]
    pub fn new(facts: ScenarioFacts, id: FlightId, time_limit_s: f64) -> Self {
        let record = FlightRecord {
            facts,
            seed: id.seed,
            run: id.run,
            nominal: id.nominal,
            truth: Vec::with_capacity(16_384),
            actuators: Vec::with_capacity(16_384),
            nav: Vec::with_capacity(4_096),
            guidance: Vec::with_capacity(512),
            health: Vec::with_capacity(512),
            events: Vec::new(),
            frame_cost_us: Vec::new(),
            slot_worst_ns: [0; SLOT_COUNT],
            nees: Vec::with_capacity(4_096),
            bound: Vec::new(),
            end: End::Interrupted,
            summary: Summary::default(),
        };
        let (link, computer) =
            (LinkCounters::default(), Computer { place: "in-process".into(), ..Computer::default() });
        Self { record, hash: Sha256::new(), link, computer, realtime: None, time_limit_s, over: None }
    }

    /// Flies on another computer than the one of this process.
    #[must_use]
    pub fn on(mut self, computer: Computer) -> Self {
        self.computer = computer;
        self
    }

    /// The facts of the scenario.
    #[must_use]
    pub fn facts(&self) -> &ScenarioFacts {
        &self.record.facts
    }

    /// Hears a true state.
    pub fn truth(&mut self, time: MissionTime, packet: &Truth) {
        let sample = truth_sample(&self.record.facts, time, packet, self.record.truth.last());
        if sample.altitude_m <= 0.0 {
            self.over.get_or_insert(End::Ground);
        } else if sample.time_s >= self.time_limit_s {
            self.over.get_or_insert(End::TimeLimit);
        }
        self.record.truth.push(sample);
    }

    /// Hears a packet of the flight computer.
    pub fn downlink(&mut self, frame: Frame<Downlink>) {
        hash_packet(&mut self.hash, &frame);
        let record = &mut self.record;
        match frame.packet {
            Downlink::Actuator(actuator) => {
                if actuator.discretes & Actuator::MORTAR_FIRE != 0 {
                    // The parachute opens at this instant, whatever else ends here.
                    self.over = Some(End::Deployed);
                }
                record.actuators.push(actuator);
            }
            Downlink::NavTlm(nav) => {
                if let Some(truth) = sample_at(&record.truth, frame.time.as_s()) {
                    record.nees.push(consistency(frame.time.as_s(), &nav, &truth.packet));
                }
                record.nav.push((frame.time, nav));
            }
            Downlink::GuidanceTlm(guidance) => record.guidance.push((frame.time, guidance)),
            Downlink::HealthTlm(health) => record.health.push((frame.time, health)),
            Downlink::Event(event) => record.events.push(event),
            Downlink::Hello(hello) => self.computer.build_id = Some(format!("{:016x}", hello.build_id)),
            Downlink::CommandReply(_) | Downlink::CostTlm(_) => {}
        }
    }

    /// Hears bytes of the flight computer that are no packet.
    pub fn downlink_damaged(&mut self) {
        self.link.downlink_rejected += 1;
    }

    /// Counts bytes that crossed the link.
    pub fn count_bytes(&mut self, up: usize, down: usize) {
        self.link.uplink_bytes += up as u64;
        self.link.downlink_bytes += down as u64;
    }

    /// Notes what a frame cost in this process, ns.
    pub fn frame_cost(&mut self, cost: &MeasuredCost) {
        self.record.frame_cost_us.push(cost.whole as f32 * 1e-3);
        for (worst, spent) in self.record.slot_worst_ns.iter_mut().zip(cost.slots) {
            *worst = (*worst).max(spent);
        }
    }

    /// Notes how well the wall clock was kept.
    pub fn realtime(&mut self, kept: RealTime) {
        self.realtime = Some(kept);
    }

    /// How the flight ended, once it has.
    #[must_use]
    pub fn over(&self) -> Option<&End> {
        self.over.as_ref()
    }

    /// True states heard so far.
    #[must_use]
    pub fn truth_count(&self) -> usize {
        self.record.truth.len()
    }

    /// The last true state heard.
    #[must_use]
    pub fn last_truth(&self) -> Option<&TruthSample> {
        self.record.truth.last()
    }

    /// The last bank command and mode heard.
    #[must_use]
    pub fn last_actuator(&self) -> Option<&Actuator> {
        self.record.actuators.last()
    }

    /// Closes the record with its summary.
    #[must_use]
    pub fn finish(mut self, end: End, wall_s: f64) -> FlightRecord {
        self.link.rejected = self.record.health.last().map_or_else(RejectCounters::default, |(_, h)| h.rejects);
        self.record.end = end;
        let hash = self.hash.finalize();
        let hash = hash.iter().map(|byte| format!("{byte:02x}")).collect();
        self.record.summary = Summary {
            cost: cost::of(&self.record, &self.computer.place),
            computer: self.computer,
            realtime: self.realtime,
            ..summary::of(&self.record, self.link, hash, wall_s)
        };
        self.record
    }
}

/// The sample of the frame that ends at `time_s`, if it was heard.
#[must_use]
pub fn sample_at(samples: &[TruthSample], time_s: f64) -> Option<&TruthSample> {
    let half_frame_s = 0.5 * FRAME.as_s();
    let at = samples.partition_point(|sample| sample.time_s < time_s - half_frame_s);
    samples.get(at).filter(|sample| (sample.time_s - time_s).abs() < half_frame_s)
}

/// Adds one packet to the output hash when it belongs there: `(time, packet)` in postcard form of every Actuator,
/// NavTlm, GuidanceTlm and Event.
pub fn hash_packet(hash: &mut Sha256, frame: &Frame<Downlink>) {
    let counted = matches!(
        frame.packet,
        Downlink::Actuator(_) | Downlink::NavTlm(_) | Downlink::GuidanceTlm(_) | Downlink::Event(_)
    );
    if counted {
        let mut room = [0u8; fsw_core::link::framing::MAX_PAYLOAD];
        if let Ok(bytes) = postcard::to_slice(&(frame.time, &frame.packet), &mut room) {
            hash.update(bytes);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::facts;
    use fsw_core::link::packet::HealthTlm;

    fn actuator(frame: u32, discretes: u8) -> Frame<Downlink> {
        let packet = Downlink::Actuator(Actuator { frame, discretes, ..Actuator::default() });
        Frame { sequence: 3, time: MissionTime::of_frame(frame), packet }
    }

    fn high_up() -> Truth {
        Truth { position_m: [3_500_000.0, 0.0, 0.0], velocity_mps: [0.0, 5_000.0, 0.0], ..Truth::default() }
    }

    fn digest(frames: &[Frame<Downlink>]) -> String {
        let mut recorder = Recorder::new(facts(), FlightId::default(), 1000.0);
        for frame in frames {
            recorder.downlink(frame.clone());
        }
        recorder.finish(End::TimeLimit, 0.0).summary.output_hash
    }

    #[test]
    fn the_hash_covers_time_and_packet_but_neither_health_nor_sequence() {
        let base = digest(&[actuator(1, 0), actuator(2, 0)]);
        assert_eq!(base.len(), 64);
        assert_ne!(base, digest(&[actuator(1, 0), actuator(2, 1)]));
        let mut late = actuator(2, 0);
        late.time = MissionTime(late.time.0 + 1);
        assert_ne!(base, digest(&[actuator(1, 0), late]));
        let mut renumbered = actuator(2, 0);
        renumbered.sequence = 99;
        let health = Downlink::HealthTlm(HealthTlm { frames: 7, ..HealthTlm::default() });
        let health = Frame { sequence: 5, time: MissionTime(1), packet: health };
        assert_eq!(base, digest(&[actuator(1, 0), health, renumbered]));
    }

    #[test]
    fn firing_the_mortar_ends_the_flight_at_that_frame() {
        let mut recorder = Recorder::new(facts(), FlightId::default(), 1000.0);
        recorder.truth(MissionTime::of_frame(1), &high_up());
        recorder.downlink(actuator(1, Actuator::MORTAR_ARM));
        assert_eq!(recorder.over(), None);
        recorder.truth(MissionTime::of_frame(2), &high_up());
        recorder.downlink(actuator(2, Actuator::MORTAR_FIRE));
        assert_eq!(recorder.over(), Some(&End::Deployed));
    }

    #[test]
    fn the_ground_and_the_time_limit_end_a_flight_too() {
        let mut recorder = Recorder::new(facts(), FlightId::default(), 0.03);
        recorder.truth(MissionTime::of_frame(1), &high_up());
        assert_eq!(recorder.over(), None);
        recorder.truth(MissionTime::of_frame(2), &high_up());
        assert_eq!(recorder.over(), Some(&End::TimeLimit));
        let mut recorder = Recorder::new(facts(), FlightId::default(), 1000.0);
        recorder.truth(MissionTime::of_frame(1), &Truth { position_m: [3_300_000.0, 0.0, 0.0], ..high_up() });
        assert_eq!(recorder.over(), Some(&End::Ground));
    }

    #[test]
    fn a_sample_is_found_by_its_time_only() {
        let samples: Vec<_> = (0..5)
            .filter(|n| *n != 3)
            .map(|n| TruthSample { time_s: f64::from(n) * 0.02, ..Default::default() })
            .collect();
        assert_eq!(sample_at(&samples, 0.04).map(|s| s.time_s), Some(0.04));
        assert!(sample_at(&samples, 0.06).is_none());
        assert!(sample_at(&samples, 0.2).is_none());
    }
}
