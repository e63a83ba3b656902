//! The filters of the papers in flight: [`Modelled`] runs any of them over the onboard model, on the packets that come.
//!
//! **What is used for what.** The gyros give the attitude (strapdown), from it the bank and the axes of the accelerometer. The
//! accelerometer is a measurement of the force that the model expects, and nothing else: position and velocity move by the
//! model alone. So no reading is used twice. Meanwhile the strapdown solution goes on by itself, dead reckoning; it is what
//! is fallen back upon when the filter fails or contradicts it beyond reason.
//!
//! **Windows.** As in the error-state [`filter`](super::filter): while a window of [`FRAMES_PER_EPOCH`] frames is flown, the one
//! before is worked on, a slice in each frame: prediction; force; the first and the second half of the other readings; and in
//! the last frame what was found is carried to the present by the model, 0.1 s late.

pub mod design;
mod divided;
pub mod engine;
mod gather;
mod linearised;
mod start;
pub mod watch;
pub mod window;
mod work;

use design::{Design, STATES};
use engine::{Beyond, Engine};
use watch::{GivenUp, Watch};
use window::Window;

use super::filter::measurement::Queue;
use super::filter::{FRAMES_PER_EPOCH, Learned, Uncertainty};
use super::strapdown::{Nominal, StepRecord};
use crate::frames::{Vec3, bank_from_attitude};
use crate::link::packet::Innovation;
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::math::fun::{sin_cos, sqrt};
use crate::math::num::{all_finite, max};
use crate::model::OnboardModel;
use crate::model::orbiter::SourceState;
use crate::nav::estimators::models::{AXES, Onboard, Process};
use crate::probe::{Kernel, Probe};
use crate::sensors::Batch;
use crate::time::FRAME;

/// Time between epochs, s; pressure comes as often.
const EPOCH_S: f64 = 0.1;

/// A model-based filter and its work space, in place.
#[derive(Clone, Debug)]
pub struct Modelled {
    engine: Engine,
    /// The window being flown, and the one before, which is worked on.
    window: Window,
    job: Window,
    /// Inertial acceleration of the model at the end of the job's window.
    acceleration_mps2: [f64; AXES],
    frame: u8,
    epochs: u16,
    /// Cosine and sine of the bank at the end of the frame before.
    bank: (f64, f64),
    /// Position and velocity, carried to the present by the model; parameters that it was carried with.
    now: [f64; STATES],
    beyond: Beyond,
    uncertainty: Uncertainty,
    innovations: Queue<Innovation>,
    watch: Watch,
}

/// What a frame brings to a model-based filter.
#[derive(Clone, Copy, Debug)]
pub struct Flown<'a> {
    /// The strapdown solution before and after the frame.
    pub before: &'a Nominal,
    /// After it.
    pub after: &'a Nominal,
    /// What the strapdown felt.
    pub record: &'a StepRecord,
    /// The frame had no inertial measurement of its own.
    pub bridged: bool,
}

/// What is lent to it.
#[derive(Clone, Copy, Debug)]
pub struct Lent<'a> {
    /// The filter's design.
    pub design: &'a Design<'a>,
    /// Planet and air.
    pub model: &'a OnboardModel,
    /// Settings.
    pub parameters: &'a NavigationParameters,
}

impl Modelled {
    /// No filter; all zero bytes.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            engine: Engine::NONE,
            window: Window::new(),
            job: Window::new(),
            acceleration_mps2: [0.0; AXES],
            frame: 0,
            epochs: 0,
            bank: (0.0, 0.0),
            now: [0.0; STATES],
            beyond: Beyond { log_density: None, lift_error: 0.0, accelerometer_bias_mps2: [0.0; AXES] },
            uncertainty: Uncertainty::NONE,
            innovations: Queue::new(),
            watch: Watch::new(),
        }
    }

    /// Starts from the knowledge at the entry epoch.
    pub fn start(&mut self, design: &Design<'_>, knowledge: &InitialKnowledge, parameters: &NavigationParameters) {
        let ([x, y, z], [vx, vy, vz]) = (knowledge.position_m, knowledge.velocity_mps);
        self.now = [x, y, z, vx, vy, vz];
        self.window.clear();
        self.job.clear();
        self.innovations.clear();
        self.watch = Watch::new();
        self.beyond = Beyond::default();
        self.bank = (0.0, 0.0);
        (self.frame, self.epochs) = (0, 0);
        let started = self.engine.start(design, &self.now, knowledge, parameters);
        self.judge(started);
        self.publish(design, parameters);
    }

    /// Why the filter no longer flies, if it does not.
    #[must_use]
    pub fn given_up(&self) -> Option<GivenUp> {
        self.watch.given_up()
    }

    /// Position (m) and velocity (m/s) at present, inertial axes.
    #[must_use]
    pub fn state(&self) -> &[f64; STATES] {
        &self.now
    }

    /// What else it has learned.
    #[must_use]
    pub fn beyond(&self) -> &Beyond {
        &self.beyond
    }

    /// The same in the terms of telemetry.
    #[must_use]
    pub fn learned(&self) -> Learned {
        Learned {
            accelerometer_bias_mps2: self.beyond.accelerometer_bias_mps2,
            log_density: self.beyond.log_density.map_or(0.0, |(mean, _)| mean),
            ..Learned::default()
        }
    }

    /// Uncertainty as of the last finished epoch; that of the attitude is the strapdown's affair.
    #[must_use]
    pub fn uncertainty(&self) -> &Uncertainty {
        &self.uncertainty
    }

    /// Innovation records since they were cleared.
    pub fn innovations(&mut self) -> &mut Queue<Innovation> {
        &mut self.innovations
    }

    /// One frame: carries the estimate to its end, gathers what it brings, and does its slice of the work.
    #[inline(never)]
    pub fn step(
        &mut self,
        flown: &Flown<'_>,
        batch: &Batch,
        sources: &mut [SourceState],
        lent: &Lent<'_>,
        probe: &mut impl Probe,
    ) {
        let bank = self.mean_bank(flown, lent.model);
        let vehicle = Onboard::new(lent.model, bank, [[0.0; AXES]; AXES]);
        self.now = vehicle.step(&self.now, &self.path_parameters(), FRAME.as_s());
        self.window.add(flown.record, (&flown.before.attitude_bi, &flown.after.attitude_bi), bank, flown.bridged);
        self.gather(batch, sources, lent);
        probe.kernel_done(Kernel::FilterPredict, 0);
        let worked = self.slice(lent, probe);
        self.judge(worked);
        self.frame += 1;
        if self.frame >= FRAMES_PER_EPOCH {
            self.close(lent);
        }
        probe.kernel_done(Kernel::FilterUpdate, 0);
    }

    fn path_parameters(&self) -> [f64; 2] {
        [self.beyond.log_density.map_or(0.0, |(mean, _)| mean), self.beyond.lift_error]
    }

    /// Cosine and sine of the bank in the middle of the frame.
    fn mean_bank(&mut self, flown: &Flown<'_>, model: &OnboardModel) -> (f64, f64) {
        let after = self.bank_after(flown, model);
        let before = core::mem::replace(&mut self.bank, after);
        let (cosine, sine) = (before.0 + after.0, before.1 + after.1);
        let size = sqrt(cosine * cosine + sine * sine);
        if size > 1.0 { (cosine / size, sine / size) } else { after }
    }

    /// Cosine and sine of the bank: the strapdown's attitude about the filter's own velocity.
    fn bank_after(&self, flown: &Flown<'_>, model: &OnboardModel) -> (f64, f64) {
        let [x, y, z, vx, vy, vz] = self.now;
        let spin = model.planet.rotation_radps;
        let (r_i, v_rel) = (Vec3::new(x, y, z), Vec3::new(vx + y * spin, vy - x * spin, vz));
        let (sine, cosine) = sin_cos(bank_from_attitude(&flown.after.attitude_bi, &r_i, &v_rel).unwrap_or(0.0));
        (cosine, sine)
    }

    /// The work on a window is done.
    fn finish(&mut self, lent: &Lent<'_>) {
        self.epochs = self.epochs.saturating_add(1);
        self.publish(lent.design, lent.parameters);
    }

    /// Ends the window: what was found of the one before is carried to the present.
    fn close(&mut self, lent: &Lent<'_>) {
        self.frame = 0;
        if self.epochs > 0 && self.given_up().is_none() {
            let vehicle = Onboard::new(lent.model, self.window.bank(), [[0.0; AXES]; AXES]);
            self.now = vehicle.step(&self.engine.state(), &self.path_parameters(), self.window.length_s());
        }
        self.job.clear();
        core::mem::swap(&mut self.window, &mut self.job);
    }

    fn judge(&mut self, done: Result<(), GivenUp>) {
        if let Err(why) = done {
            self.watch.failed(why);
        }
        if !all_finite(&self.now) {
            self.watch.run_away();
        }
    }

    /// Compares with the strapdown solution and what it is worth.
    pub fn compare(&mut self, strapdown: &Nominal, reckoned: &Uncertainty) {
        if self.frame == 0 {
            self.watch.compare(&self.now, &self.uncertainty, strapdown, reckoned);
        }
    }

    fn publish(&mut self, design: &Design<'_>, parameters: &NavigationParameters) {
        self.beyond = self.engine.beyond(design, parameters);
        let engine = &self.engine;
        let sigma = |i: usize| sqrt(max(engine.covariance(i, i), 0.0));
        let lower = (0..STATES).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for (element, (i, j)) in self.uncertainty.covariance.iter_mut().zip(lower) {
            *element = engine.covariance(i, j);
        }
        let largest = |block: usize| (block..block + AXES).fold(0.0, |largest, k| max(largest, sigma(k)));
        self.uncertainty.position_sigma_m = largest(0);
        self.uncertainty.velocity_sigma_mps = largest(AXES);
        self.uncertainty.sound = self.uncertainty.covariance.iter().all(|c| c.is_finite());
        self.uncertainty.log_density_sigma = self.beyond.log_density.map_or(0.0, |(_, sigma)| sigma);
    }
}

impl Default for Modelled {
    fn default() -> Self {
        Self::new()
    }
}
