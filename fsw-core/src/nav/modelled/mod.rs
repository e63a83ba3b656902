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
pub mod engine;
pub mod watch;
pub mod window;

use design::{Design, EXPERTS, STATES, as_white};
use engine::{BATCH, Beyond, Engine, Step};
use watch::{GivenUp, Watch};
use window::{MAX_SIGHTS, Sight, Window};

use super::filter::measurement::Queue;
use super::filter::pressure::Pitot;
use super::filter::{FRAMES_PER_EPOCH, Learned, Uncertainty, radio};
use super::strapdown::{Nominal, StepRecord};
use crate::frames::{Inertial, Vec3, bank_from_attitude};
use crate::link::packet::{Innovation, MeasurementKind, Verdict};
use crate::link::parameters::{InitialKnowledge, NavigationParameters};
use crate::math::fun::{exp, ln, sin_cos, sqrt};
use crate::math::num::{abs, all_finite, max};
use crate::model::OnboardModel;
use crate::model::orbiter::SourceState;
use crate::nav::estimators::models::{AXES, Noise, Onboard, Process, Quantity};
use crate::nav::estimators::weights::{Channels, Rule};
use crate::probe::{Kernel, Probe};
use crate::sensors::Batch;
use crate::time::{FRAME, MissionTime};

/// Epochs before the input of a self-calibrating filter is at work: 20 s, after the first pull-in (P1 starts at the third).
const CALIBRATION_EPOCHS: u16 = 200;
/// Readings taken in in the third frame of a window; the rest in the fourth.
const EARLY_SIGHTS: usize = 2 * BATCH;
/// Experts of a bank worked on in one frame, and the frames that takes.
const EXPERTS_PER_FRAME: usize = 2;
/// Of a window; the last frame is for the fusion.
const FRAMES_OF_EXPERTS: usize = EXPERTS.div_ceil(EXPERTS_PER_FRAME);
/// The expert whose innovations are told: it believes in the onboard model.
const MIDDLE_EXPERT: usize = EXPERTS / 2;
/// P3's units of dynamic pressure (Pa), acceleration (m/s²), range (m) and range-rate (m/s).
const CHANNEL_UNITS: Channels = [636.0, 3.711, 3.711, 3.711, 3_389_500.0, 3_546.6];
/// Time between epochs, s; pressure comes as often.
const EPOCH_S: f64 = 0.1;
/// White noise that a pressure reading has at least, as a share: no transducer and no pitot formula is exact.
const MIN_PRESSURE_SHARE: f64 = 1e-3;

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
    pub design: &'a Design,
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
    pub fn start(&mut self, design: &Design, knowledge: &InitialKnowledge, parameters: &NavigationParameters) {
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

    /// Readings of this frame.
    #[inline(never)]
    fn gather(&mut self, batch: &Batch, sources: &mut [SourceState], lent: &Lent<'_>) {
        let frames_left = FRAMES_PER_EPOCH.saturating_sub(1).saturating_sub(self.frame);
        let age_s = f64::from(frames_left) * FRAME.as_s();
        if let Some(p) = &batch.pressure {
            self.gather_pressure(p.time, p.stagnation_pa, age_s, lent);
        }
        for (measured, state) in batch.radio.iter().zip(sources.iter_mut()) {
            let Some(m) = measured else { continue };
            let found = state.at(&lent.model.planet, m.time);
            let quantities = found.map(|(r_s, v_s)| {
                let (source_m, source_mps) = (r_s.to_array(), v_s.to_array());
                (Quantity::Range { source_m }, Quantity::RangeRate { source_m, source_mps }, r_s)
            });
            let nowhere = Quantity::Range { source_m: [0.0; AXES] };
            let (range, rate, seen) = match quantities {
                Ok((range, rate, r_s)) => (range, rate, self.sees(state, &r_s, lent)),
                Err(_) => (nowhere, nowhere, false),
            };
            for (kind, quantity, value, sigma) in [
                (MeasurementKind::Range, range, m.range_m, lent.parameters.range_noise_m),
                (MeasurementKind::RangeRate, rate, m.range_rate_mps, lent.parameters.range_rate_noise_mps),
            ] {
                let noise = Noise::of(sigma);
                self.take(Sight { time: m.time, kind, source: m.source, quantity, noise, value, age_s }, seen);
            }
        }
    }

    fn sees(&self, state: &SourceState, r_s: &Vec3<Inertial>, lent: &Lent<'_>) -> bool {
        let [x, y, z, ..] = self.now;
        let r_i = Vec3::new(x, y, z);
        (r_i - *r_s).unit().is_some_and(|u| radio::is_visible(state, &r_i, r_s, &u, lent.parameters))
    }

    /// A stagnation pressure, as its logarithm: what is known of its noise is relative, and it is linear in altitude then.
    fn gather_pressure(&mut self, time: MissionTime, value_pa: f64, age_s: f64, lent: &Lent<'_>) {
        let [x, y, z, vx, vy, vz] = self.now;
        let planet = &lent.model.planet;
        let altitude_m = Vec3::<Inertial>::new(x, y, z).norm() - planet.radius_m;
        let spin = planet.rotation_radps;
        let speed_mps = Vec3::<Inertial>::new(vx + y * spin, vy - x * spin, vz).norm();
        let pitot = Pitot::at(lent.model, altitude_m, speed_mps);
        let [log_density, _] = self.path_parameters();
        let density = lent.model.atmosphere.density(altitude_m) * exp(log_density);
        let dynamic_pa = 0.5 * density * speed_mps * speed_mps;
        let p = lent.parameters;
        let offset = p.pressure_offset_sigma_pa / max(value_pa, p.pressure_min_dynamic_pa);
        let constant = p.pressure_scale_sigma * p.pressure_scale_sigma + offset * offset;
        let share = sqrt(p.pressure_noise * p.pressure_noise + as_white(constant) / EPOCH_S);
        let (static_square, coefficient) = (pitot.static_square(), pitot.coefficient);
        let sight = Sight {
            time,
            kind: MeasurementKind::Pressure,
            source: 0,
            quantity: Quantity::LogPressure { static_square, coefficient },
            noise: Noise::of(max(share, MIN_PRESSURE_SHARE)),
            value: ln(max(value_pa, f64::MIN_POSITIVE)),
            age_s,
        };
        self.take(sight, dynamic_pa >= p.pressure_min_dynamic_pa && value_pa > 0.0);
    }

    fn take(&mut self, sight: Sight, valid: bool) {
        if valid && sight.value.is_finite() {
            self.window.sights.push(sight);
        } else {
            self.innovations.push(sight.record(0.0, 0.0, Verdict::OutOfValidity));
        }
    }

    /// This frame's part of the work on the window before.
    fn slice(&mut self, lent: &Lent<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let length_s = self.job.length_s();
        if length_s <= 0.0 || self.given_up().is_some() {
            return Ok(());
        }
        let vehicle = Onboard::new(lent.model, self.job.bank(), self.job.body_axes());
        let [x, y, z, vx, vy, vz] = self.engine.state();
        let radial = (x * vx + y * vy + z * vz) / Vec3::<Inertial>::new(x, y, z).norm();
        let persistence = exp(-abs(radial) * length_s / lent.parameters.log_density_length_m);
        let step = Step {
            vehicle: &vehicle,
            design: lent.design,
            parameters: lent.parameters,
            step_s: length_s,
            force_mps2: self.job.force_mps2(),
            persistence,
        };
        if self.engine.experts() > 0 {
            return self.work_on_bank(&step, probe);
        }
        match self.frame {
            0 => {
                if self.epochs < CALIBRATION_EPOCHS && matches!(lent.design.family, design::Family::Tied(_)) {
                    self.engine.forget_input();
                }
                self.predict(&step, probe)?;
            }
            1 => self.correct_by_force(&step, probe)?,
            2 => self.correct_some(0, EARLY_SIGHTS, &step, true, probe)?,
            3 => self.correct_some(EARLY_SIGHTS, MAX_SIGHTS, &step, true, probe)?,
            _ => self.finish(lent),
        }
        Ok(())
    }

    /// A bank of filters: some experts in each frame but the last, one after the other from prediction to last reading.
    #[inline(never)]
    fn work_on_bank(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let frame = usize::from(self.frame);
        if frame >= FRAMES_OF_EXPERTS {
            self.engine.fuse()?;
            self.epochs = self.epochs.saturating_add(1);
            self.publish(step.design, step.parameters);
            return Ok(());
        }
        let first = frame * EXPERTS_PER_FRAME;
        for expert in first..first + EXPERTS_PER_FRAME {
            if expert < self.engine.experts() {
                self.engine.turn_to(expert);
                self.predict(step, probe)?;
                self.correct_by_force(step, probe)?;
                self.correct_some(0, MAX_SIGHTS, step, expert == MIDDLE_EXPERT, probe)?;
            }
        }
        if frame + 1 == FRAMES_OF_EXPERTS {
            self.engine.weigh(&self.channels(step.design))?;
        }
        Ok(())
    }

    /// The readings of the window as a gating network sees them: P3 brings them to order one, and the bare form does not.
    fn channels(&self, design: &Design) -> Channels {
        let [fx, fy, fz] = self.job.specific_force_mps2().unwrap_or([0.0; AXES]);
        let value = |kind| self.job.sights.items().iter().find(|sight| sight.kind == kind).map_or(0.0, |s| s.value);
        let pressure = self.job.sights.items().iter().find(|sight| sight.kind == MeasurementKind::Pressure);
        let pressure_pa = pressure.map_or(0.0, |sight| exp(sight.value));
        let raw = [pressure_pa, fx, fy, fz, value(MeasurementKind::Range), value(MeasurementKind::RangeRate)];
        if matches!(design.family, design::Family::Bank(Rule::BareGating { .. })) {
            return raw;
        }
        let mut scaled = raw;
        scaled.iter_mut().zip(CHANNEL_UNITS).for_each(|(channel, unit)| *channel /= unit);
        scaled
    }

    #[inline(never)]
    fn predict(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        self.engine.predict(step)?;
        self.acceleration_mps2 = step.vehicle.total_acceleration(&self.engine.working_state(), &self.path_parameters());
        probe.kernel_done(Kernel::FilterPredict, 1);
        Ok(())
    }

    #[inline(never)]
    fn correct_by_force(&mut self, step: &Step<'_>, probe: &mut impl Probe) -> Result<(), GivenUp> {
        let Some([x, y, z]) = self.job.specific_force_mps2() else { return Ok(()) };
        let sigma = step.design.force_reading_sigma(step.step_s, step.force_mps2, step.parameters);
        let sight = |axis, value| Sight {
            time: MissionTime::ZERO,
            kind: MeasurementKind::default(),
            source: 0,
            quantity: Quantity::SpecificForce { axis },
            noise: Noise::of(sigma),
            value,
            age_s: 0.5 * step.step_s,
        };
        let sights = [sight(0, x), sight(1, y), sight(2, z)];
        self.engine.correct(step, &sights, &self.acceleration_mps2, step.parameters.gate_sigma)?;
        probe.kernel_done(Kernel::FilterUpdate, AXES as u32);
        Ok(())
    }

    /// Radio and pressure from index `first` up to `end`, in batches.
    #[inline(never)]
    fn correct_some(
        &mut self,
        first: usize,
        end: usize,
        step: &Step<'_>,
        is_told: bool,
        probe: &mut impl Probe,
    ) -> Result<(), GivenUp> {
        let Self { engine, job, innovations, acceleration_mps2, .. } = self;
        let sights = job.sights.items();
        let some = sights.get(first..).unwrap_or_default();
        let some = some.get(..end.saturating_sub(first)).unwrap_or(some);
        for batch in some.chunks(BATCH) {
            let told = engine.correct(step, batch, acceleration_mps2, step.parameters.gate_sigma)?;
            for (sight, told) in batch.iter().zip(told.iter().flatten()) {
                if is_told {
                    let verdict = if told.used { Verdict::Used } else { Verdict::Gated };
                    innovations.push(sight.record(told.value, told.variance, verdict));
                }
                probe.kernel_done(Kernel::FilterUpdate, 1);
            }
        }
        Ok(())
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

    fn publish(&mut self, design: &Design, parameters: &NavigationParameters) {
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
