//! [`Navigator`]: one step per minor frame, in any navigation mode.

use super::bridge::{Bridge, BridgeNoise};
use super::estimate::Estimate;
use super::filter::{Filter, pressure, radio, transition::FrameStep};
use super::strapdown::{Increments, Nominal, StepRecord, Strapdown};
use crate::frames::{Rot, Vec3};
use crate::link::packet::{MAX_SOURCES, NavTlm, Truth};
use crate::link::parameters::{InitialKnowledge, NavigationMode, NavigationParameters, RadioSource};
use crate::math::fun::ln;
use crate::model::OnboardModel;
use crate::model::orbiter::SourceState;
use crate::sensors::Batch;
use crate::time::{FRAME, MissionTime};

/// What the navigator is lent for a step: the onboard model and the parameters in force.
#[derive(Clone, Copy, Debug)]
pub struct NavContext<'a> {
    /// Planet and air as the flight software believes them.
    pub model: &'a OnboardModel,
    /// Filter settings.
    pub parameters: &'a NavigationParameters,
    /// Radio sources by slot.
    pub sources: &'a [RadioSource; MAX_SOURCES],
    /// Algorithm that flies.
    pub mode: NavigationMode,
}

/// Counters for fault protection; they only grow, except the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NavCounters {
    /// Frames bridged in the present run without an inertial measurement.
    pub bridged_run: u16,
    /// Frames bridged since the start.
    pub bridged_total: u32,
    /// Times the covariance had to be restored.
    pub covariance_restored: u16,
    /// Measurements lost because the queue was full.
    pub queue_overflow: u16,
}

/// Strapdown, filter and the choice between navigation modes. Built in place once; a copy is a snapshot.
#[derive(Clone, Debug, Default)]
pub struct Navigator {
    started: bool,
    /// False in mode `ideal`, where there is no uncertainty to report.
    filtering: bool,
    nominal: Nominal,
    strapdown: Strapdown,
    bridge: Bridge,
    filter: Filter,
    sources: [SourceState; MAX_SOURCES],
    estimate: Estimate,
}

/// Standard deviation of position, along any inertial axis, beyond which an estimate is not valid, m.
pub const MAX_POSITION_SIGMA_M: f64 = 20_000.0;

impl Navigator {
    /// A navigator that knows nothing; its estimates are invalid until [`Navigator::start`].
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Starts from the knowledge at the entry epoch. Knowledge that is not finite or has no attitude leaves it unstarted.
    pub fn start(&mut self, knowledge: &InitialKnowledge, context: &NavContext<'_>) {
        let attitude = Rot::from_quaternion(knowledge.attitude);
        let nominal = Nominal {
            r_i: Vec3::from_array(knowledge.position_m),
            v_i: Vec3::from_array(knowledge.velocity_mps),
            attitude_bi: attitude.unwrap_or_else(Rot::identity),
        };
        self.filtering = context.mode != NavigationMode::Ideal;
        self.started = attitude.is_some() && nominal.is_finite();
        self.nominal = if self.started { nominal } else { Nominal::default() };
        self.strapdown = Strapdown::new();
        self.bridge = Bridge::default();
        self.filter.start(knowledge, context.parameters);
        for (state, source) in self.sources.iter_mut().zip(context.sources) {
            *state = SourceState::new(source, &context.model.planet);
        }
        self.estimate = Estimate::default();
    }

    /// Advances to `now`, the end of the minor frame whose measurements are in `batch`.
    pub fn step(&mut self, now: MissionTime, batch: &Batch, context: &NavContext<'_>) -> Estimate {
        if !self.started {
            self.estimate.time = now;
            return self.estimate;
        }
        let before = self.nominal;
        let (increments, bridged) = self.increments(batch);
        let planet = &context.model.planet;
        let record = self.strapdown.advance(&mut self.nominal, &increments, FRAME.as_s(), planet);
        match (context.mode, batch.truth.as_ref()) {
            (NavigationMode::Ideal, truth) => {
                truth.iter().for_each(|(_, truth)| adopt(&mut self.nominal, truth));
                self.publish(now, context, &increments, &record);
                truth.iter().for_each(|(_, truth)| self.publish_truth(truth, context));
            }
            (NavigationMode::Ekf | NavigationMode::DeadReckoning, _) => {
                let after = self.nominal;
                let frame = FrameStep {
                    before: &before,
                    after: &after,
                    increments: &increments,
                    record: &record,
                    density_decay: 1.0,
                    dt_s: FRAME.as_s(),
                };
                self.filter.propagate(frame, &bridged, context.parameters, planet);
                self.observe(batch, context);
                self.filter.work(&mut self.nominal, context.mode, context.parameters);
                self.publish(now, context, &increments, &record);
                self.estimate.log_density = self.filter.learned().log_density;
                self.estimate.log_density_sigma = self.filter.uncertainty().log_density_sigma;
            }
        }
        self.estimate.valid = self.usable();
        self.estimate
    }

    /// Hands the measurements of the frame to the filter.
    fn observe(&mut self, batch: &Batch, context: &NavContext<'_>) {
        let parameters = context.parameters;
        if let Some(p) = &batch.pressure {
            let log_density = self.filter.learned().log_density;
            self.filter.take(&pressure::observe(
                p.time,
                p.stagnation_pa,
                &self.nominal,
                log_density,
                context.model,
                parameters,
            ));
        }
        for (measured, state) in batch.radio.iter().zip(self.sources.iter_mut()) {
            if let Some(m) = measured {
                for observation in &radio::observe(m, state, &self.nominal, &context.model.planet, parameters) {
                    self.filter.take(observation);
                }
            }
        }
    }

    /// The telemetry packet; drains the innovations gathered since the one before.
    pub fn telemetry(&mut self) -> NavTlm {
        let uncertainty = self.filter.uncertainty();
        let learned = self.filter.learned();
        let mut packet = NavTlm {
            position_m: self.estimate.r_i.to_array(),
            velocity_mps: self.estimate.v_i.to_array(),
            attitude: self.estimate.attitude_bi.quaternion().map(|c| c as f32),
            log_density: self.estimate.log_density as f32,
            log_density_sigma: self.estimate.log_density_sigma as f32,
            bank_rad: self.estimate.bank_rad as f32,
            ..NavTlm::default()
        };
        if self.filtering {
            packet.covariance = uncertainty.covariance.map(|c| c as f32);
            packet.attitude_sigma_rad = uncertainty.attitude_sigma_rad.map(|c| c as f32);
            packet.accelerometer_bias_mps2 = learned.accelerometer_bias_mps2.map(|c| c as f32);
            packet.gyro_bias_radps = learned.gyro_bias_radps.map(|c| c as f32);
        }
        self.filter.drain(&mut packet.innovations);
        packet
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Counters for fault protection.
    #[must_use]
    pub fn counters(&self) -> NavCounters {
        NavCounters {
            bridged_run: self.bridge.run(),
            bridged_total: self.bridge.total(),
            covariance_restored: self.filter.restored(),
            queue_overflow: self.filter.overflow(),
        }
    }

    /// Compensated increments of this frame, bridged when there are none.
    fn increments(&mut self, batch: &Batch) -> (Increments, BridgeNoise) {
        let learned = self.filter.learned();
        let dt = FRAME.as_s();
        let measured = batch.imu.as_ref().map(|imu| Increments {
            delta_v_b: imu.delta_v_b - Vec3::from_array(learned.accelerometer_bias_mps2) * dt,
            delta_theta_b: imu.delta_theta_b - Vec3::from_array(learned.gyro_bias_radps) * dt,
        });
        self.bridge.choose(measured, self.strapdown.last(), dt)
    }

    fn publish(&mut self, now: MissionTime, context: &NavContext<'_>, increments: &Increments, record: &StepRecord) {
        let planet = &context.model.planet;
        let per_s = 1.0 / FRAME.as_s();
        self.estimate.set_trajectory(now, &self.nominal.r_i, &self.nominal.v_i, planet);
        self.estimate.attitude_bi = self.nominal.attitude_bi;
        self.estimate.specific_force_b = increments.delta_v_b * per_s;
        self.estimate.set_bank(&(increments.delta_theta_b * per_s), &record.acceleration_i, planet);
    }

    /// Mode `ideal`: what the truth packet says beyond position, velocity and attitude.
    fn publish_truth(&mut self, truth: &Truth, context: &NavContext<'_>) {
        self.estimate.bank_rad = truth.bank_rad;
        self.estimate.bank_rate_radps = truth.bank_rate_radps;
        let ratio = truth.density_kgpm3 / context.model.atmosphere.density(self.estimate.altitude_m);
        self.estimate.log_density = if ratio > 0.0 && ratio.is_finite() { ln(ratio) } else { 0.0 };
        self.estimate.log_density_sigma = 0.0;
    }

    fn usable(&self) -> bool {
        let known = !self.filtering || self.filter.uncertainty().position_sigma_m <= MAX_POSITION_SIGMA_M;
        known && !self.bridge.lost() && self.nominal.is_finite()
    }
}

/// Takes position, velocity and attitude of the truth packet; one without an attitude is ignored.
fn adopt(nominal: &mut Nominal, truth: &Truth) {
    if let Some(attitude_bi) = Rot::from_quaternion(truth.attitude) {
        *nominal =
            Nominal { r_i: Vec3::from_array(truth.position_m), v_i: Vec3::from_array(truth.velocity_mps), attitude_bi };
    }
}
