//! [`Filter`]: the error-state extended Kalman filter of all errors of the sensors around the strapdown solution.
//!
//! Windows of [`FRAMES_PER_EPOCH`] frames. While window k flies, its transition is accumulated and its measurements are queued as
//! innovations against the nominal state of their own frames; meanwhile the covariance of the window before is worked on in
//! slices, one per frame:
//!
//! | frame of the window | work on the epoch that ended the window before |
//! |---|---|
//! | 1 | prediction, Φ on columns |
//! | 2 | Φ on rows, process noise; a part of the check of positive definiteness |
//! | 3, 4, 5 | scalar updates, a third of them in each |
//!
//! At the end of frame 5 the correction found for the old epoch is carried to the present by the transition of the window
//! just flown and added to the nominal state: 0.1 s late, but exact to first order, and no frame costs much more than another.

pub mod covariance;
pub mod layout;
pub mod measurement;
pub mod pressure;
pub mod radio;
pub mod transition;

use covariance::{Covariance, ProcessNoise};
use layout::{
    ACCELEROMETER_BIAS, ACCELEROMETER_MISALIGNMENT, ACCELEROMETER_SCALE, ALL, ATTITUDE, AXES, Full, GYRO_BIAS,
    GYRO_SCALE, LOG_DENSITY, POSITION, PRESSURE_OFFSET, PRESSURE_SCALE, VELOCITY,
};
use measurement::{Observation, Queue, UpdateRule, update};
use transition::{FrameStep, Transition};

use super::bridge::BridgeNoise;
use super::strapdown::{Increments, Nominal};
use crate::frames::{Body, Inertial, Rot, Vec3};
use crate::link::packet::{COVARIANCE_ELEMENTS, Innovation, MAX_INNOVATIONS, Verdict};
use crate::link::parameters::{InitialKnowledge, NavigationMode, NavigationParameters};
use crate::math::fun::{exp, sqrt};
use crate::math::num::{abs, max};
use crate::planet::Planet;
use crate::probe::{Kernel, Probe};

/// Minor frames from epoch to epoch: the filter runs at 10 Hz.
pub const FRAMES_PER_EPOCH: u8 = 5;
/// Frames of a window with scalar updates, the last ones; they share evenly what is queued.
const UPDATING_FRAMES: usize = 3;

/// What the filter has learned besides position, velocity and attitude.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Learned {
    /// Accelerometer bias, body axes, m/s².
    pub accelerometer_bias_mps2: [f64; 3],
    /// Gyro bias, body axes, rad/s.
    pub gyro_bias_radps: [f64; 3],
    /// Logarithm of density over the onboard model.
    pub log_density: f64,
    /// Accelerometer scale factor less 1, body axes.
    pub accelerometer_scale: [f64; 3],
    /// Accelerometer misalignment, rotation vector in body axes, rad.
    pub accelerometer_misalignment_rad: [f64; 3],
    /// Gyro scale factor less 1, body axes.
    pub gyro_scale: [f64; 3],
    /// Scale factor of the pressure less 1.
    pub pressure_scale: f64,
    /// Offset of the pressure, Pa.
    pub pressure_offset_pa: f64,
}

impl Learned {
    /// Nothing yet.
    pub const NOTHING: Self = Self {
        accelerometer_bias_mps2: [0.0; 3],
        gyro_bias_radps: [0.0; 3],
        log_density: 0.0,
        accelerometer_scale: [0.0; 3],
        accelerometer_misalignment_rad: [0.0; 3],
        gyro_scale: [0.0; 3],
        pressure_scale: 0.0,
        pressure_offset_pa: 0.0,
    };

    /// Adds what was found of the errors.
    fn add(&mut self, error: &Full) {
        for (learned, first) in [
            (&mut self.accelerometer_bias_mps2, ACCELEROMETER_BIAS),
            (&mut self.gyro_bias_radps, GYRO_BIAS),
            (&mut self.accelerometer_scale, ACCELEROMETER_SCALE),
            (&mut self.accelerometer_misalignment_rad, ACCELEROMETER_MISALIGNMENT),
            (&mut self.gyro_scale, GYRO_SCALE),
        ] {
            for (learned, change) in learned.iter_mut().zip(block(error, first)) {
                *learned += change;
            }
        }
        for (learned, at) in [
            (&mut self.log_density, LOG_DENSITY),
            (&mut self.pressure_scale, PRESSURE_SCALE),
            (&mut self.pressure_offset_pa, PRESSURE_OFFSET),
        ] {
            *learned += error.get(at).copied().unwrap_or(0.0);
        }
    }

    /// The increments of a frame as a faultless unit would have given them, by what is known of this one.
    #[must_use]
    pub fn compensated(&self, delta_v_b: &Vec3<Body>, delta_theta_b: &Vec3<Body>, dt_s: f64) -> Increments {
        let part = |v: [f64; 3]| Vec3::<Body>::from_array(v);
        let scaled = |v: &Vec3<Body>, [x, y, z]: [f64; 3]| Vec3::<Body>::new(v.x() * x, v.y() * y, v.z() * z);
        Increments {
            delta_v_b: *delta_v_b
                - part(self.accelerometer_bias_mps2) * dt_s
                - scaled(delta_v_b, self.accelerometer_scale)
                + delta_v_b.cross(&part(self.accelerometer_misalignment_rad)),
            delta_theta_b: *delta_theta_b - part(self.gyro_bias_radps) * dt_s - scaled(delta_theta_b, self.gyro_scale),
        }
    }
}

/// Three states from one on.
fn block(error: &Full, first: usize) -> [f64; AXES] {
    let mut v = [0.0; AXES];
    for (to, from) in v.iter_mut().zip(error.iter().skip(first)) {
        *to = *from;
    }
    v
}

/// Uncertainty as of the last finished epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertainty {
    /// Lower triangle, row by row, of the covariance of position and velocity.
    pub covariance: [f64; COVARIANCE_ELEMENTS],
    /// Attitude, rad.
    pub attitude_sigma_rad: [f64; 3],
    /// Log-density.
    pub log_density_sigma: f64,
    /// Largest standard deviation of position along an axis, m.
    pub position_sigma_m: f64,
    /// Largest standard deviation of velocity along an axis, m/s.
    pub velocity_sigma_mps: f64,
    /// False while a variance is negative or not a number, until the next check restores it.
    pub sound: bool,
}

impl Uncertainty {
    /// None known, and not sound.
    pub const NONE: Self = Self {
        covariance: [0.0; COVARIANCE_ELEMENTS],
        attitude_sigma_rad: [0.0; 3],
        log_density_sigma: 0.0,
        position_sigma_m: 0.0,
        velocity_sigma_mps: 0.0,
        sound: false,
    };
}

/// The filter and all its work space, used in place.
#[derive(Clone, Debug)]
pub struct Filter {
    covariance: Covariance,
    /// The window being flown.
    window: Transition,
    window_noise: ProcessNoise,
    /// The window before, whose end is the epoch being worked on; `None` in the first window.
    epoch: Option<(Transition, ProcessNoise)>,
    /// Innovations of the window being flown, and of the epoch being worked on.
    arriving: Queue<Observation>,
    processing: Queue<Observation>,
    /// Correction added to the nominal state at the epoch being worked on.
    injected: Full,
    /// Error about the corrected nominal state of that epoch, as found so far.
    error: Full,
    frame: u8,
    learned: Learned,
    uncertainty: Uncertainty,
    innovations: Queue<Innovation>,
    restored: u16,
}

impl Default for Filter {
    fn default() -> Self {
        Self::new()
    }
}

impl Filter {
    /// A filter before its start. `const`, because it is too large to be built on a small stack.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            covariance: Covariance::none(),
            window: Transition::unset(),
            window_noise: ProcessNoise::NONE,
            epoch: None,
            arriving: Queue::new(),
            processing: Queue::new(),
            injected: [0.0; ALL],
            error: [0.0; ALL],
            frame: 0,
            learned: Learned::NOTHING,
            uncertainty: Uncertainty::NONE,
            innovations: Queue::new(),
            restored: 0,
        }
    }

    /// Starts from the uncertainty of the initial knowledge and of the sensors.
    #[inline(never)] // as is that of the start …
    pub fn start(&mut self, knowledge: &InitialKnowledge, parameters: &NavigationParameters) {
        let mut sigmas: Full = [0.0; ALL];
        for (block, length, sigma) in [
            (POSITION, AXES, knowledge.position_sigma_m),
            (VELOCITY, AXES, knowledge.velocity_sigma_mps),
            (ATTITUDE, AXES, knowledge.attitude_sigma_rad),
            (ACCELEROMETER_BIAS, AXES, parameters.accelerometer_bias_sigma_mps2),
            (GYRO_BIAS, AXES, parameters.gyro_bias_sigma_radps),
            (LOG_DENSITY, 1, parameters.log_density_sigma),
            (ACCELEROMETER_SCALE, AXES, parameters.accelerometer_scale_sigma),
            (ACCELEROMETER_MISALIGNMENT, AXES, parameters.accelerometer_misalignment_sigma_rad),
            (GYRO_SCALE, AXES, parameters.gyro_scale_sigma),
            (PRESSURE_SCALE, 1, parameters.pressure_scale_sigma),
            (PRESSURE_OFFSET, 1, parameters.pressure_offset_sigma_pa),
        ] {
            sigmas.iter_mut().skip(block).take(length).for_each(|s| *s = sigma);
        }
        self.covariance.start(&sigmas);
        self.window = Transition::default();
        self.window_noise = ProcessNoise::default();
        self.epoch = None;
        self.arriving.clear();
        self.processing.clear();
        self.innovations.clear();
        self.injected = [0.0; ALL];
        self.error = [0.0; ALL];
        self.frame = 0;
        self.learned = Learned::default();
        self.publish();
    }

    /// Takes one frame of strapdown into the window. The log-density decays with the altitude flown.
    #[inline(never)] // … and of the window
    pub fn propagate(
        &mut self,
        mut frame: FrameStep<'_>,
        bridge: &BridgeNoise,
        parameters: &NavigationParameters,
        planet: &Planet,
    ) {
        let climb = frame.after.r_i.norm() - frame.before.r_i.norm();
        frame.density_decay = exp(-abs(climb) / parameters.log_density_length_m);
        self.learned.log_density *= frame.density_decay;
        self.window.accumulate(&frame, planet);
        let sigma2 = parameters.log_density_sigma * parameters.log_density_sigma;
        let decay2 = frame.density_decay * frame.density_decay;
        let noise = &mut self.window_noise;
        noise.velocity +=
            parameters.accelerometer_noise * parameters.accelerometer_noise * frame.dt_s + bridge.velocity;
        noise.attitude += parameters.gyro_noise * parameters.gyro_noise * frame.dt_s + bridge.attitude;
        noise.log_density = decay2 * noise.log_density + sigma2 * (1.0 - decay2);
    }

    /// Takes an observation made in the current frame: queued when valid, recorded at once when not.
    pub fn take(&mut self, observation: &Observation) {
        if !(observation.valid && observation.innovation.is_finite()) {
            let record = observation.record(observation.innovation, 0.0, Verdict::OutOfValidity);
            self.innovations.push(record);
            return;
        }
        let frames_left = FRAMES_PER_EPOCH.saturating_sub(1).saturating_sub(self.frame);
        let age_s = f64::from(frames_left) * crate::time::FRAME.as_s();
        let sensitivity = observation.sensitivity.seen_from_later(age_s);
        self.arriving.push(Observation { sensitivity, ..*observation });
    }

    /// This frame's slice of the covariance work; at the end of a window corrects the nominal state.
    #[inline(never)] // its scratch is not kept on the stack while the other slots run
    pub fn work(
        &mut self,
        nominal: &mut Nominal,
        mode: NavigationMode,
        parameters: &NavigationParameters,
        probe: &mut impl Probe,
    ) {
        let rule = UpdateRule { correcting: mode == NavigationMode::Ekf, gate_sigma: parameters.gate_sigma };
        let last = self.frame + 1 >= FRAMES_PER_EPOCH;
        if self.epoch.is_some() {
            self.slice(&rule, probe);
            if last {
                self.publish();
            }
        }
        if last {
            self.close_window(nominal);
        }
        self.frame = if last { 0 } else { self.frame + 1 };
        probe.kernel_done(Kernel::FilterUpdate, 0);
    }

    fn slice(&mut self, rule: &UpdateRule, probe: &mut impl Probe) {
        probe.kernel_done(Kernel::FilterUpdate, 0);
        let Some((transition, noise)) = &self.epoch else { return };
        match self.frame {
            0 => {
                self.covariance.begin_prediction(transition);
                probe.kernel_done(Kernel::FilterPredict, 1);
            }
            1 => {
                self.covariance.end_prediction(transition, noise);
                probe.kernel_done(Kernel::FilterPredict, 1);
                let (mended, raised) = (self.covariance.check(), self.covariance.sweep());
                self.restored = self.restored.saturating_add((mended | raised).into());
            }
            frame => self.update_some(usize::from(frame.saturating_sub(2)), rule, probe),
        }
    }

    /// The scalar updates of one of the [`UPDATING_FRAMES`].
    fn update_some(&mut self, turn: usize, rule: &UpdateRule, probe: &mut impl Probe) {
        let share = self.processing.items().len().div_ceil(UPDATING_FRAMES);
        for observation in self.processing.items().iter().skip(turn * share).take(share) {
            let record = update(observation, rule, &self.injected, &mut self.error, &mut self.covariance);
            self.innovations.push(record);
            probe.kernel_done(Kernel::FilterUpdate, 1);
        }
    }

    /// Carries the correction to the present, adds it to the nominal state and begins the next window.
    fn close_window(&mut self, nominal: &mut Nominal) {
        self.injected = self.error;
        for (now, carried) in self.injected.iter_mut().zip(self.window.apply(&self.error)) {
            *now = carried;
        }
        self.error = [0.0; ALL];
        inject(&self.injected, nominal, &mut self.learned);
        self.epoch = Some((core::mem::take(&mut self.window), core::mem::take(&mut self.window_noise)));
        // Copied, not swapped: few of the places are taken.
        self.processing.clear();
        self.arriving.items().iter().for_each(|observation| self.processing.push(*observation));
        self.arriving.clear();
    }

    fn publish(&mut self) {
        let p = &self.covariance;
        let sigma = |i: usize| if p.at(i, i) > 0.0 { sqrt(p.at(i, i)) } else { 0.0 };
        let lower = (0..2 * AXES).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for (element, (i, j)) in self.uncertainty.covariance.iter_mut().zip(lower) {
            *element = p.at(POSITION + i, POSITION + j);
        }
        for (k, element) in self.uncertainty.attitude_sigma_rad.iter_mut().enumerate() {
            *element = sigma(ATTITUDE + k);
        }
        self.uncertainty.log_density_sigma = sigma(LOG_DENSITY);
        let largest = |block: usize| (0..AXES).fold(0.0, |largest, k| max(largest, sigma(block + k)));
        self.uncertainty.position_sigma_m = largest(POSITION);
        self.uncertainty.velocity_sigma_mps = largest(VELOCITY);
        self.uncertainty.sound = (0..ALL).all(|i| p.at(i, i) >= 0.0);
    }

    /// What has been learned of sensors and air.
    #[must_use]
    pub fn learned(&self) -> &Learned {
        &self.learned
    }

    /// Uncertainty as of the last finished epoch.
    #[must_use]
    pub fn uncertainty(&self) -> &Uncertainty {
        &self.uncertainty
    }

    /// Moves the innovation records gathered so far into `out`.
    pub fn drain(&mut self, out: &mut [Option<Innovation>; MAX_INNOVATIONS]) {
        for (slot, record) in out.iter_mut().zip(self.innovations.items()) {
            *slot = Some(*record);
        }
        self.innovations.clear();
    }

    /// Innovation records gathered since the last [`Filter::drain`].
    #[must_use]
    pub fn innovations(&self) -> &[Innovation] {
        self.innovations.items()
    }

    /// Times the covariance had to be restored.
    #[must_use]
    pub fn restored(&self) -> u16 {
        self.restored
    }

    /// Measurements or records lost because a queue was full.
    #[must_use]
    pub fn overflow(&self) -> u16 {
        self.arriving.overflow().saturating_add(self.processing.overflow()).saturating_add(self.innovations.overflow())
    }
}

/// Adds an error to the nominal state and to what has been learned.
fn inject(error: &Full, nominal: &mut Nominal, learned: &mut Learned) {
    nominal.r_i += Vec3::from_array(block(error, POSITION));
    nominal.v_i += Vec3::from_array(block(error, VELOCITY));
    let tilt = Vec3::<Inertial>::from_array(block(error, ATTITUDE));
    let tilt = Rot::<Inertial, Inertial>::from_rotation_vector(tilt.components());
    nominal.attitude_bi = nominal.attitude_bi.then(&tilt).normalised();
    learned.add(error);
}
