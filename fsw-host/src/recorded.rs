//! A flight's link log as the filters see it: what each minor frame brought, decoded from the bytes that crossed the link.

use std::io;

use fsw_core::config::Config;
use fsw_core::link::packet::{Command, RejectCounters, Truth, Uplink};
use fsw_core::link::parameters::NavigationParameters;
use fsw_core::link::receiver::Receiver;
use fsw_core::link::schema::SCHEMA_HASH;
use fsw_core::model::OnboardModel;
use fsw_core::sensors::{self, Batch, FrameInputs, StuckMonitor};
use fsw_core::time::{FRAMES_PER_SECOND, MissionTime};
use hil_sim::scenario::Scenario;
use nalgebra::{Quaternion, UnitQuaternion};

use crate::ends::LocalComputer;
use crate::error::HostError;
use crate::fly::fly_watched;
use crate::linklog::{Direction, LinkLog, LinkLogWriter};
use crate::pump::Watch;
use crate::record::{FlightRecord, TruthSample};
use crate::recorder::FlightId;

/// Frames in a row without a true state after which the true path counts as unknown: a second.
const LONGEST_GAP: u32 = FRAMES_PER_SECOND;

/// One recorded flight.
pub struct Recorded {
    /// Parameters as they were loaded over the link.
    pub config: Box<Config>,
    /// Statistics of the sensors that flew, whatever the flight software was told of them.
    pub sensors: NavigationParameters,
    /// The onboard model that follows from them.
    pub model: Box<OnboardModel>,
    /// What each minor frame brought; the first is frame 1.
    pub frames: Vec<FrameInputs>,
    /// The bank that was commanded over each, rad/s².
    pub bank_accel_radps2: Vec<f64>,
    /// True state after each minor frame; the first is that of the epoch.
    pub truth: Vec<Truth>,
}

impl Recorded {
    /// Flies a scenario with its own navigation and keeps the link.
    ///
    /// # Errors
    /// The scenario cannot be flown.
    pub fn fly(scenario: &Scenario, seed: u64, run: u64) -> Result<Self, HostError> {
        let (log, record) = fly_kept(scenario, seed, run)?;
        Self::of(&log, &record)
    }

    /// Decodes the log of a flight, as far as its true path is known.
    ///
    /// # Errors
    /// The log brings no parameters that the flight software takes.
    pub fn of(log: &LinkLog, record: &FlightRecord) -> Result<Self, HostError> {
        let truth = at_every_frame(&record.truth);
        let mut config = Box::new(Config::DEFAULT);
        let (mut frames, mut gathered) = (Vec::new(), FrameInputs::new());
        let (mut receiver, mut rejects) = (Receiver::<Uplink>::new(), RejectCounters::NONE);
        let refused = |what: String| HostError::Option(format!("the parameters of the log: {what}"));
        for (_, bytes) in log.records().filter(|(direction, _)| *direction == Direction::Up) {
            let mut rest = bytes;
            while !rest.is_empty() {
                let Some(frame) = receiver.take(&mut rest, &mut rejects) else { continue };
                match frame.packet {
                    Uplink::Command(Command::Load(block)) => {
                        config.apply(&block).map_err(|why| refused(format!("{why:?}")))?;
                    }
                    Uplink::Imu(imu) => {
                        gathered.imu = Some((frame.time, imu));
                        let inputs = std::mem::take(&mut gathered);
                        let index = frame.time.frame_index() as usize;
                        if index >= truth.len() {
                            continue;
                        }
                        // Frames that went missing brought nothing.
                        frames.resize(index.max(1) - 1, FrameInputs::new());
                        frames.push(inputs);
                    }
                    packet => {
                        gathered.put(frame.time, &packet, &mut rejects);
                    }
                }
            }
        }
        let c = &config;
        let model = OnboardModel::new(c.planet, &c.vehicle, &c.aero_rows, &c.atmosphere, &c.atmosphere_rows);
        let model = Box::new(model.map_err(|why| refused(why.to_string()))?);
        let bank_accel_radps2 = record.actuators.iter().map(|actuator| actuator.bank_accel_radps2).collect();
        Ok(Self { config, sensors: record.facts.sensors, model, frames, bank_accel_radps2, truth })
    }

    /// Each frame's number, its end, its measurements as the flight software accepts them, and the true state then.
    pub fn accepted(&self) -> impl Iterator<Item = (usize, MissionTime, Batch, &Truth)> + '_ {
        let (mut rejects, mut stuck) = (RejectCounters::NONE, StuckMonitor::default());
        (1..).zip(self.frames.iter().zip(self.truth.iter().skip(1))).map(move |(k, (inputs, truth))| {
            let now = MissionTime::of_frame(u32::try_from(k).unwrap_or(u32::MAX));
            let mut batch = sensors::accept(now, inputs, &mut rejects);
            stuck.step(&mut batch, &self.config.navigation, &mut rejects);
            (k, now, batch, truth)
        })
    }
}

/// True states at the epoch and after every frame. A simulator beyond a bad line may have lost some on the way: what lies
/// between two others is put between them; where too many are missing, the path ends.
fn at_every_frame(samples: &[TruthSample]) -> Vec<Truth> {
    let mut path: Vec<Truth> = Vec::with_capacity(samples.len());
    let index = |sample: &TruthSample| (sample.time_s * f64::from(FRAMES_PER_SECOND)).round() as u32;
    for sample in samples {
        let Some(missing) = index(sample).checked_sub(u32::try_from(path.len()).unwrap_or(u32::MAX)) else { continue };
        let Some(before) = path.last().copied().or((missing == 0).then_some(sample.packet)) else { break };
        if missing > LONGEST_GAP {
            break;
        }
        let share = |step: u32| f64::from(step) / f64::from(missing + 1);
        path.extend((1..=missing).map(|step| between(&before, &sample.packet, share(step))));
        path.push(sample.packet);
    }
    path
}

/// Some share of the way from one true state to another.
fn between(a: &Truth, b: &Truth, share: f64) -> Truth {
    let mix = |a: f64, b: f64| a + share * (b - a);
    let vector = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| mix(a[axis], b[axis]));
    let turn = |[w, x, y, z]: [f64; 4]| UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    let q = turn(a.attitude).nlerp(&turn(b.attitude), share);
    Truth {
        position_m: vector(a.position_m, b.position_m),
        velocity_mps: vector(a.velocity_mps, b.velocity_mps),
        attitude: [q.w, q.i, q.j, q.k],
        dynamic_pressure_pa: mix(a.dynamic_pressure_pa, b.dynamic_pressure_pa),
        ..*a
    }
}

/// Flies with the scenario's own navigation and keeps the link.
pub(crate) fn fly_kept(scenario: &Scenario, seed: u64, run: u64) -> Result<(LinkLog, FlightRecord), HostError> {
    let memory = |e: io::Error| HostError::Option(format!("the link log does not fit into memory: {e}"));
    let mut kept = Kept(LinkLogWriter::new(Vec::new(), SCHEMA_HASH).map_err(memory)?);
    let id = FlightId { seed, run, ..FlightId::default() };
    let record = fly_watched(scenario, id, &mut LocalComputer::default(), &mut kept)?;
    let log = LinkLog::read(kept.0.into_inner().as_slice())
        .map_err(|e| HostError::Option(format!("the link log of run {run}: {e}")))?;
    Ok((log, record))
}

/// Keeps the link in memory.
struct Kept(LinkLogWriter<Vec<u8>>);

impl Watch for Kept {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.0.record(direction, bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(frame: u32) -> TruthSample {
        let position_m = [3.5e6 + f64::from(frame), 0.0, 0.0];
        let packet = Truth { position_m, attitude: [1.0, 0.0, 0.0, 0.0], ..Truth::default() };
        TruthSample { time_s: f64::from(frame) / f64::from(FRAMES_PER_SECOND), packet, ..TruthSample::default() }
    }

    #[test]
    fn true_states_lost_on_the_way_are_put_between_their_neighbours() {
        let path = at_every_frame(&[0, 1, 4, 3, 5].map(sample));
        let x: Vec<f64> = path.iter().map(|truth| truth.position_m[0] - 3.5e6).collect();
        assert!(x.iter().zip(0..).all(|(x, k)| (x - f64::from(k)).abs() < 1e-8) && x.len() == 6, "{x:?}");
    }

    #[test]
    fn a_path_ends_where_too_much_of_it_is_missing_and_never_begins_without_its_epoch() {
        assert_eq!(
            at_every_frame(&[0, 1, 2 + LONGEST_GAP, 3 + LONGEST_GAP].map(sample)).len(),
            4 + LONGEST_GAP as usize
        );
        assert_eq!(at_every_frame(&[0, 1, 3 + LONGEST_GAP].map(sample)).len(), 2);
        assert!(at_every_frame(&[sample(1), sample(2)]).is_empty());
    }
}
