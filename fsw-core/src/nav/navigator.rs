//! [`Navigator`]: one step per minor frame, in any navigation mode.

use super::bridge::{Bridge, BridgeNoise, Measured, Surroundings};
use super::estimate::Estimate;
use super::filter::{Filter, Learned, Uncertainty, pressure, radio, transition::FrameStep};
use super::modelled::design::Design;
use super::modelled::watch::GivenUp;
use super::modelled::{Flown, Lent, Modelled};
use super::strapdown::{Increments, Nominal, StepRecord, Strapdown};
use crate::frames::{Rot, Vec3};
use crate::link::packet::{GivenUpCause, MAX_SOURCES, NavTlm, Truth};
use crate::link::parameters::{
    EstimatorParameters, InitialKnowledge, NavigationMode, NavigationParameters, RadioSource,
};
use crate::model::OnboardModel;
use crate::model::orbiter::SourceState;
use crate::probe::{Kernel, NoProbe, Probe};
use crate::sensors::Batch;
use crate::time::{FRAME, MissionTime};

/// What the navigator is lent for a step: the onboard model and the parameters in force.
#[derive(Clone, Copy, Debug)]
pub struct NavContext<'a> {
    /// Planet and air as the flight software believes them.
    pub model: &'a OnboardModel,
    /// Filter settings.
    pub parameters: &'a NavigationParameters,
    /// Settings of the filters over the onboard model.
    pub estimators: &'a EstimatorParameters,
    /// Radio sources by slot.
    pub sources: &'a [RadioSource; MAX_SOURCES],
    /// Algorithm that flies.
    pub mode: NavigationMode,
    /// Bank acceleration commanded over this frame, rad/s²: what the vehicle does while it is not measured.
    pub bank_accel_radps2: f64,
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
    /// Why the model-based filter no longer flies, in a mode that has one.
    pub given_up: Option<GivenUpCause>,
}

/// Strapdown, filter and the choice between navigation modes. Built in place once; a copy is a snapshot.
#[derive(Clone, Debug)]
pub struct Navigator {
    started: bool,
    /// False in mode `ideal`, where there is no uncertainty to report.
    filtering: bool,
    nominal: Nominal,
    strapdown: Strapdown,
    bridge: Bridge,
    filter: Filter,
    modelled: Modelled,
    /// The estimate is that of the model-based filter.
    on_model: bool,
    sources: [SourceState; MAX_SOURCES],
    estimate: Estimate,
}

/// Standard deviation of position, along any inertial axis, beyond which an estimate is not valid, m.
pub const MAX_POSITION_SIGMA_M: f64 = 20_000.0;
/// The same of the velocity, m/s: two degrees of direction at entry.
pub const MAX_VELOCITY_SIGMA_MPS: f64 = 200.0;
/// The same of the attitude, rad: beyond it nobody knows where the lift points.
pub const MAX_ATTITUDE_SIGMA_RAD: f64 = crate::units::rad(10.0);

impl Default for Navigator {
    fn default() -> Self {
        Self::new()
    }
}

impl Navigator {
    /// A navigator that knows nothing; its estimates are invalid until [`Navigator::start`].
    #[must_use]
    pub const fn new() -> Self {
        Self {
            started: false,
            filtering: false,
            nominal: Nominal { attitude_bi: Rot::unset(), ..Nominal::none() },
            strapdown: Strapdown::new(),
            bridge: Bridge::NEW,
            filter: Filter::new(),
            modelled: Modelled::new(),
            on_model: false,
            sources: [const { SourceState::None }; MAX_SOURCES],
            estimate: Estimate { attitude_bi: Rot::unset(), ..Estimate::none() },
        }
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
        self.on_model = false;
        if let Some(design) = Design::of(context.mode, context.estimators) {
            self.modelled.start(&design, knowledge, context.parameters);
            self.on_model = self.started && self.modelled.given_up().is_none();
        }
        for (state, source) in self.sources.iter_mut().zip(context.sources) {
            *state = SourceState::new(source, &context.model.planet);
        }
        self.estimate = Estimate::default();
    }

    /// Advances to `now`, the end of the minor frame whose measurements are in `batch`.
    pub fn step(&mut self, now: MissionTime, batch: &Batch, context: &NavContext<'_>) -> Estimate {
        self.step_probed(now, batch, context, &mut NoProbe)
    }

    /// As [`Self::step`], telling `probe` when strapdown and the parts of the filter are done.
    pub fn step_probed(
        &mut self,
        now: MissionTime,
        batch: &Batch,
        context: &NavContext<'_>,
        probe: &mut impl Probe,
    ) -> Estimate {
        if !self.started {
            self.estimate.time = now;
            return self.estimate;
        }
        let before = self.nominal;
        let (increments, bridged) = self.increments(batch, context);
        let planet = &context.model.planet;
        let record = self.strapdown.advance(&mut self.nominal, &increments, FRAME.as_s(), planet);
        probe.kernel_done(Kernel::Strapdown, 1);
        if context.mode == NavigationMode::Ideal {
            let truth = batch.truth.as_ref();
            truth.iter().for_each(|(_, truth)| adopt(&mut self.nominal, truth));
            self.publish(now, context, &increments, &record);
            truth.iter().for_each(|(_, truth)| self.publish_truth(truth, context));
        } else {
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
            probe.kernel_done(Kernel::FilterPredict, 1);
            if !self.on_model {
                self.observe(batch, context);
            }
            self.filter.work(&mut self.nominal, context.mode, context.parameters, probe);
            if self.on_model {
                let flown = Flown { before: &before, after: &after, record: &record, bridged: batch.imu.is_none() };
                self.fly_on_model(&flown, batch, context, probe);
            }
            self.publish(now, context, &increments, &record);
        }
        self.estimate.valid = self.usable();
        self.estimate
    }

    /// The model-based filter's frame; what it says counts until it is given up.
    fn fly_on_model(&mut self, flown: &Flown<'_>, batch: &Batch, context: &NavContext<'_>, probe: &mut impl Probe) {
        let Some(design) = Design::of(context.mode, context.estimators) else { return };
        let lent = Lent { design: &design, model: context.model, parameters: context.parameters };
        self.modelled.step(flown, batch, &mut self.sources, &lent, probe);
        self.modelled.compare(&self.nominal, self.filter.uncertainty());
        self.on_model = self.modelled.given_up().is_none();
    }

    /// Hands the measurements of the frame to the filter.
    fn observe(&mut self, batch: &Batch, context: &NavContext<'_>) {
        let parameters = context.parameters;
        if let Some(p) = &batch.pressure {
            let learned = self.filter.learned();
            let observed =
                pressure::observe(p.time, p.stagnation_pa, &self.nominal, learned, context.model, parameters);
            self.filter.take(&observed);
        }
        if batch.radio.iter().all(Option::is_none) {
            return;
        }
        let lowest_sine = radio::lowest_sine(parameters);
        for (measured, state) in batch.radio.iter().zip(self.sources.iter_mut()) {
            let Some(m) = measured else { continue };
            for observation in &radio::observe(m, state, &self.nominal, &context.model.planet, parameters, lowest_sine)
            {
                self.filter.take(observation);
            }
        }
    }

    /// The telemetry packet; drains the innovations gathered since the one before.
    pub fn telemetry(&mut self) -> NavTlm {
        let uncertainty = self.uncertainty();
        let learned = self.learned();
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
        if self.on_model {
            for (slot, record) in packet.innovations.iter_mut().zip(self.modelled.innovations().items()) {
                *slot = Some(*record);
            }
            self.modelled.innovations().clear();
        } else {
            self.filter.drain(&mut packet.innovations);
        }
        packet
    }

    /// How uncertain the estimate is. The attitude is always the strapdown's.
    fn uncertainty(&self) -> Uncertainty {
        let strapdown = self.filter.uncertainty();
        if self.on_model {
            Uncertainty { attitude_sigma_rad: strapdown.attitude_sigma_rad, ..*self.modelled.uncertainty() }
        } else {
            *strapdown
        }
    }

    fn learned(&self) -> Learned {
        if self.on_model { self.modelled.learned() } else { *self.filter.learned() }
    }

    /// Why the model-based filter no longer flies, in a mode that has one.
    #[must_use]
    pub fn given_up(&self) -> Option<GivenUp> {
        self.modelled.given_up()
    }

    /// The last estimate.
    #[must_use]
    pub fn estimate(&self) -> &Estimate {
        &self.estimate
    }

    /// Scalar updates that the filter of the strapdown solution made in the last frame.
    #[must_use]
    pub fn scalar_updates(&self) -> usize {
        self.filter.updates()
    }

    /// Counters for fault protection.
    #[must_use]
    pub fn counters(&self) -> NavCounters {
        NavCounters {
            bridged_run: self.bridge.run(),
            bridged_total: self.bridge.total(),
            covariance_restored: self.filter.restored(),
            queue_overflow: self.filter.overflow(),
            given_up: self.modelled.given_up().map(|why| why.cause()),
        }
    }

    /// Compensated increments of this frame, bridged when there are none.
    fn increments(&mut self, batch: &Batch, context: &NavContext<'_>) -> (Increments, BridgeNoise) {
        let learned = self.filter.learned();
        let dt_s = FRAME.as_s();
        let measured = batch.imu.as_ref().map(|imu| Measured {
            increments: learned.compensated(&imu.delta_v_b, &imu.delta_theta_b, dt_s),
            accelerometer_saturated: imu.accelerometer_saturated,
            gyro_saturated: imu.gyro_saturated,
        });
        let around = Surroundings {
            nominal: &self.nominal,
            log_density: learned.log_density,
            model: context.model,
            bank_accel_radps2: context.bank_accel_radps2,
            dt_s,
        };
        self.bridge.choose(measured, self.strapdown.last(), &around)
    }

    fn publish(&mut self, now: MissionTime, context: &NavContext<'_>, increments: &Increments, record: &StepRecord) {
        let planet = &context.model.planet;
        let per_s = 1.0 / FRAME.as_s();
        let (r_i, v_i) = if self.on_model {
            let [x, y, z, vx, vy, vz] = *self.modelled.state();
            (Vec3::new(x, y, z), Vec3::new(vx, vy, vz))
        } else {
            (self.nominal.r_i, self.nominal.v_i)
        };
        self.estimate.set_trajectory(now, &r_i, &v_i, planet);
        self.estimate.attitude_bi = self.nominal.attitude_bi;
        self.estimate.specific_force_b = increments.delta_v_b * per_s;
        self.estimate.set_bank(&(increments.delta_theta_b * per_s), &record.acceleration_i, planet);
        let (log_density, sigma) = self.log_density(context.parameters);
        self.estimate.log_density = log_density;
        self.estimate.log_density_sigma = sigma;
    }

    /// Log-density and its standard deviation; a filter that knows nothing of it leaves it as it was before the flight.
    fn log_density(&self, parameters: &NavigationParameters) -> (f64, f64) {
        if self.on_model {
            self.modelled.beyond().log_density.unwrap_or((0.0, parameters.log_density_sigma))
        } else {
            (self.filter.learned().log_density, self.filter.uncertainty().log_density_sigma)
        }
    }

    /// Mode `ideal`: what the truth packet says beyond position, velocity and attitude. Perfect navigation is not perfect
    /// knowledge of the air: the density stays as unknown as before the flight, so that guidance is judged on its own.
    fn publish_truth(&mut self, truth: &Truth, context: &NavContext<'_>) {
        self.estimate.bank_rad = truth.bank_rad;
        self.estimate.bank_rate_radps = truth.bank_rate_radps;
        self.estimate.log_density = 0.0;
        self.estimate.log_density_sigma = context.parameters.log_density_sigma;
    }

    fn usable(&self) -> bool {
        (!self.filtering || self.is_certain()) && !self.bridge.lost() && self.nominal.is_finite()
    }

    /// Written so that a standard deviation that is not a number is not certain.
    fn is_certain(&self) -> bool {
        let strapdown = self.filter.uncertainty();
        let uncertainty = if self.on_model { self.modelled.uncertainty() } else { strapdown };
        uncertainty.sound
            && uncertainty.position_sigma_m <= MAX_POSITION_SIGMA_M
            && uncertainty.velocity_sigma_mps <= MAX_VELOCITY_SIGMA_MPS
            && strapdown.attitude_sigma_rad.iter().all(|sigma| *sigma <= MAX_ATTITUDE_SIGMA_RAD)
    }
}

/// Takes position, velocity and attitude of the truth packet; one without an attitude is ignored.
fn adopt(nominal: &mut Nominal, truth: &Truth) {
    if let Some(attitude_bi) = Rot::from_quaternion(truth.attitude) {
        *nominal =
            Nominal { r_i: Vec3::from_array(truth.position_m), v_i: Vec3::from_array(truth.velocity_mps), attitude_bi };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::{Body, Inertial};
    use crate::link::packet::Verdict;
    use crate::nav::{MAX_BRIDGED_FRAMES, RECOVERY_FRAMES};
    use crate::sensors::{ImuIncrement, RadioMeasurement};
    use std::boxed::Box;

    static CONFIG: Config = Config::DEFAULT;
    const SOURCES: [RadioSource; MAX_SOURCES] = [RadioSource::None; MAX_SOURCES];

    fn model() -> OnboardModel {
        let c = Config::DEFAULT;
        OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    fn context(model: &OnboardModel, mode: NavigationMode) -> NavContext<'_> {
        NavContext {
            model,
            parameters: &CONFIG.navigation,
            estimators: &CONFIG.estimators,
            sources: &SOURCES,
            mode,
            bank_accel_radps2: 0.0,
        }
    }

    fn knowledge() -> InitialKnowledge {
        InitialKnowledge {
            position_m: [3.52e6, 0.0, 0.0],
            velocity_mps: [-1300.0, 5300.0, 100.0],
            attitude: [1.0, 0.0, 0.0, 0.0],
            position_sigma_m: 500.0,
            velocity_sigma_mps: 0.3,
            attitude_sigma_rad: 5e-4,
        }
    }

    fn measured(frame: u32) -> Batch {
        let imu = ImuIncrement {
            time: MissionTime::of_frame(frame),
            delta_v_b: Vec3::<Body>::new(-0.1, 0.0, 0.02),
            delta_theta_b: Vec3::new(1e-4, 0.0, 0.0),
            accelerometer_saturated: false,
            gyro_saturated: false,
        };
        Batch { imu: Some(imu), ..Batch::default() }
    }

    fn started(model: &OnboardModel, mode: NavigationMode) -> Box<Navigator> {
        let mut navigator = Box::new(Navigator::new());
        navigator.start(&knowledge(), &context(model, mode));
        navigator
    }

    #[test]
    fn before_the_start_and_after_unusable_knowledge_estimates_are_invalid() {
        let model = model();
        let context = context(&model, NavigationMode::Ekf);
        let mut navigator = Navigator::new();
        assert!(!navigator.step(MissionTime::of_frame(1), &measured(1), &context).valid);
        for bad in [
            InitialKnowledge { attitude: [0.0; 4], ..knowledge() },
            InitialKnowledge { position_m: [f64::NAN, 0.0, 0.0], ..knowledge() },
        ] {
            navigator.start(&bad, &context);
            let e = navigator.step(MissionTime::of_frame(1), &measured(1), &context);
            assert!(!e.valid && e.r_i.is_finite() && e.time == MissionTime::of_frame(1));
        }
    }

    #[test]
    fn ideal_navigation_is_the_truth_packet_and_knows_nothing_of_the_air() {
        let model = model();
        let mut navigator = started(&model, NavigationMode::Ideal);
        let truth = Truth {
            position_m: [3.4e6, 1e5, -2e5],
            velocity_mps: [-500.0, 3000.0, 10.0],
            attitude: [0.8, 0.6, 0.0, 0.0],
            bank_rad: 0.7,
            bank_rate_radps: -0.1,
            density_kgpm3: 1.1 * model.atmosphere.density(Vec3::<Inertial>::new(3.4e6, 1e5, -2e5).norm() - 3_397_200.0),
            ..Truth::default()
        };
        let now = MissionTime::of_frame(1);
        let batch = Batch { truth: Some((now, truth)), ..measured(1) };
        let e = navigator.step(now, &batch, &context(&model, NavigationMode::Ideal));
        assert!(e.valid && e.r_i.to_array() == truth.position_m && e.v_i.to_array() == truth.velocity_mps);
        assert_eq!((e.bank_rad, e.bank_rate_radps), (0.7, -0.1));
        assert_eq!((e.log_density, e.log_density_sigma), (0.0, Config::DEFAULT.navigation.log_density_sigma));
        let packet = navigator.telemetry();
        assert!(packet.covariance.iter().all(|c| *c == 0.0) && packet.attitude_sigma_rad == [0.0; 3]);
    }

    #[test]
    fn the_truth_packet_is_ignored_outside_mode_ideal() {
        let model = model();
        for mode in [NavigationMode::Ekf, NavigationMode::DeadReckoning] {
            let (mut with, mut without) = (started(&model, mode), started(&model, mode));
            let now = MissionTime::of_frame(1);
            let truth = Truth { attitude: [1.0, 0.0, 0.0, 0.0], ..Truth::default() };
            let told = Batch { truth: Some((now, truth)), ..measured(1) };
            let context = context(&model, mode);
            assert_eq!(with.step(now, &told, &context), without.step(now, &measured(1), &context));
        }
    }

    #[test]
    fn a_gap_is_bridged_then_invalid_then_valid_again_and_widens_the_covariance() {
        let model = model();
        let context = context(&model, NavigationMode::Ekf);
        let (mut navigator, mut spared) = (started(&model, NavigationMode::Ekf), started(&model, NavigationMode::Ekf));
        let gap = u32::from(MAX_BRIDGED_FRAMES) + 5;
        for frame in 1..=100 {
            let now = MissionTime::of_frame(frame);
            let missing = (20..20 + gap).contains(&frame);
            let batch = if missing { Batch::default() } else { measured(frame) };
            let e = navigator.step(now, &batch, &context);
            let run = if missing { frame - 19 } else { 0 };
            let lost = (20 + u32::from(MAX_BRIDGED_FRAMES)..19 + gap + u32::from(RECOVERY_FRAMES)).contains(&frame);
            assert_eq!(e.valid, !lost, "{frame}");
            assert_eq!(u32::from(navigator.counters().bridged_run), run);
            spared.step(now, &measured(frame), &context);
        }
        assert_eq!(navigator.counters().bridged_total, gap);
        // Velocity variance along x is element (3, 3): the tenth of the lower triangle.
        assert!(navigator.telemetry().covariance[9] > 10.0 * spared.telemetry().covariance[9]);
    }

    #[test]
    fn a_measurement_of_an_empty_slot_is_recorded_as_out_of_validity() {
        let model = model();
        let mut navigator = started(&model, NavigationMode::Ekf);
        let now = MissionTime::of_frame(1);
        let mut batch = measured(1);
        batch.radio[2] = Some(RadioMeasurement { time: now, source: 2, range_m: 1e6, range_rate_mps: 0.0 });
        navigator.step(now, &batch, &context(&model, NavigationMode::Ekf));
        let told = navigator.telemetry().innovations;
        let records: std::vec::Vec<_> = told.iter().flatten().collect();
        assert_eq!(records.len(), 2);
        assert!(records.iter().all(|r| r.verdict == Verdict::OutOfValidity && r.source == 2 && r.time == now));
        assert!(navigator.telemetry().innovations.iter().all(Option::is_none));
    }
}
