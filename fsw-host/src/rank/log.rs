//! A flight's link log as the filters see it: what each minor frame brought, decoded from the bytes that crossed the link.

use std::io;

use fsw_core::config::Config;
use fsw_core::link::packet::{Actuator, Command, RejectCounters, Truth, Uplink};
use fsw_core::link::receiver::Receiver;
use fsw_core::link::schema::SCHEMA_HASH;
use fsw_core::model::OnboardModel;
use fsw_core::sensors::FrameInputs;
use hil_sim::scenario::Scenario;

use crate::ends::LocalComputer;
use crate::error::HostError;
use crate::fly::fly_watched;
use crate::linklog::{Direction, LinkLog, LinkLogWriter};
use crate::pump::Watch;
use crate::recorder::FlightId;

/// One recorded flight.
pub struct Recorded {
    /// Parameters as they were loaded over the link.
    pub config: Box<Config>,
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
        let memory = |e: io::Error| HostError::Option(format!("the link log does not fit into memory: {e}"));
        let mut kept = Kept(LinkLogWriter::new(Vec::new(), SCHEMA_HASH).map_err(memory)?);
        let id = FlightId { seed, run, ..FlightId::default() };
        let record = fly_watched(scenario, id, &mut LocalComputer::default(), &mut kept)?;
        let log = LinkLog::read(kept.0.into_inner().as_slice())
            .map_err(|e| HostError::Option(format!("the link log of run {run}: {e}")))?;
        let truth = record.truth.iter().map(|sample| sample.packet).collect();
        Self::of(&log, &record.actuators, truth)
    }

    /// Decodes a log.
    fn of(log: &LinkLog, actuators: &[Actuator], truth: Vec<Truth>) -> Result<Self, HostError> {
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
                        let index = frame.time.frame_index() as usize;
                        gathered.imu = Some((frame.time, imu));
                        // Frames that went missing brought nothing.
                        frames.resize(index.max(1) - 1, FrameInputs::new());
                        frames.push(std::mem::take(&mut gathered));
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
        let bank_accel_radps2 = actuators.iter().map(|actuator| actuator.bank_accel_radps2).collect();
        Ok(Self { config, model, frames, bank_accel_radps2, truth })
    }
}

/// Keeps the link in memory.
struct Kept(LinkLogWriter<Vec<u8>>);

impl Watch for Kept {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.0.record(direction, bytes)
    }
}
