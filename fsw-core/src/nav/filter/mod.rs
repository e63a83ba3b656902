//! [`Filter`]: the error-state extended Kalman filter of all errors of the sensors around the strapdown solution.
//!
//! Windows of [`FRAMES_PER_EPOCH`] frames. While window k flies, its transition is accumulated and its measurements are queued as
//! innovations against the nominal state of their own frames; meanwhile the covariance of the window before is worked on in
//! slices, one per frame:
//!
//! | frame of the window | work on the epoch that ended the window before |
//! |---|---|
//! | 1 | prediction, first half |
//! | 2 | prediction, second half; scalar updates |
//! | 3 | scalar updates |
//! | 4 | scalar updates; uncertainty, unless there are more |
//! | 5 | scalar updates when there are many, uncertainty then |
//!
//! At the end of frame 5 the correction found for the old epoch is carried to the present by the transition of the window
//! just flown and added to the nominal state: 0.1 s late, but exact to first order, and no frame costs much more than another.

pub mod covariance;
pub mod layout;
mod learned;
pub mod measurement;
pub mod pressure;
pub mod radio;
pub mod transition;
mod uncertainty;

use covariance::{Covariance, ProcessNoise};
use layout::{
    ACCELEROMETER_BIAS, ACCELEROMETER_MISALIGNMENT, ACCELEROMETER_SCALE, ALL, ATTITUDE, AXES, Full, GYRO_BIAS,
    GYRO_SCALE, LOG_DENSITY, POSITION, PRESSURE_OFFSET, PRESSURE_SCALE, VELOCITY,
};
pub use learned::Learned;
use learned::inject;
use measurement::{Observation, Queue, UpdateRule, update};
use transition::{FrameStep, Transition};
pub use uncertainty::Uncertainty;

use super::bridge::BridgeNoise;
use super::strapdown::Nominal;
use crate::link::packet::{Innovation, MAX_INNOVATIONS, Verdict};
use crate::link::parameters::{InitialKnowledge, NavigationMode, NavigationParameters};
use crate::math::fun::{exp, sqrt};
use crate::math::num::{abs, max};
use crate::planet::Planet;
use crate::probe::{Kernel, Probe};

/// Minor frames from epoch to epoch: the filter runs at 10 Hz.
pub const FRAMES_PER_EPOCH: u8 = 5;
/// Scalar updates in the second to fifth frame, by how many are queued. The second ends the prediction besides, the fourth
/// often sends telemetry, and a fifth is that in which guidance begins its cycle.
const UPDATES: [[usize; 4]; MAX_INNOVATIONS + 1] = [
    [0, 0, 0, 0],
    [0, 1, 0, 0],
    [0, 2, 0, 0],
    [0, 2, 1, 0],
    [0, 2, 1, 1],
    [0, 3, 1, 1],
    [0, 3, 1, 2],
    [1, 3, 1, 2],
    [1, 3, 2, 2],
    [1, 3, 3, 2],
];

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
    /// That of the epoch being worked on, told together with its correction.
    found: Uncertainty,
    innovations: Queue<Innovation>,
    /// Scalar updates made in this frame.
    updates: usize,
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
            found: Uncertainty::NONE,
            innovations: Queue::new(),
            updates: 0,
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
        self.assess();
        self.uncertainty = self.found;
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
        self.updates = 0;
        if self.epoch.is_some() {
            self.slice(&rule, probe);
        }
        if last {
            self.uncertainty = self.found;
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
                let is_restarted = !self.covariance.end_prediction(transition, noise);
                self.restored = self.restored.saturating_add(is_restarted.into());
                probe.kernel_done(Kernel::FilterPredict, 1);
            }
            _ => {}
        }
        self.update_some(rule, probe);
    }

    /// The scalar updates of this frame, and the uncertainty when they are the last ones.
    fn update_some(&mut self, rule: &UpdateRule, probe: &mut impl Probe) {
        let Some([second, third, fourth, fifth]) = UPDATES.get(self.processing.items().len()) else { return };
        let (done, now, is_last) = match self.frame {
            1 => (0, *second, false),
            2 => (*second, *third, false),
            3 => (second + third, *fourth, *fifth == 0),
            4 => (second + third + fourth, *fifth, *fifth > 0),
            _ => return,
        };
        for observation in self.processing.items().iter().skip(done).take(now) {
            let record = update(observation, rule, &self.injected, &mut self.error, &mut self.covariance);
            self.innovations.push(record);
            self.updates += 1;
            probe.kernel_done(Kernel::FilterUpdate, 1);
        }
        if is_last {
            self.assess();
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

    /// How well the epoch is known now that its measurements are taken in.
    fn assess(&mut self) {
        let (covariance, variances) = self.covariance.told();
        let sigma = |i: usize| variances.get(i).map_or(0.0, |variance| sqrt(*variance));
        let largest = |block: usize| (0..AXES).fold(0.0, |largest, k| max(largest, sigma(block + k)));
        self.found = Uncertainty {
            covariance,
            attitude_sigma_rad: [sigma(ATTITUDE), sigma(ATTITUDE + 1), sigma(ATTITUDE + 2)],
            log_density_sigma: sigma(LOG_DENSITY),
            position_sigma_m: largest(POSITION),
            velocity_sigma_mps: largest(VELOCITY),
            sound: variances.iter().all(|variance| variance.is_finite()),
        };
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

    /// Scalar updates made in the last frame.
    #[must_use]
    pub fn updates(&self) -> usize {
        self.updates
    }

    /// Times the covariance had to be restarted.
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
