//! What the flight teaches of air, drag and lift: a small Kalman filter on the force that the inertial unit feels.
//!
//! The force, resolved at the trim angle of attack into drag and lift, over what the onboard model expects at the estimated
//! altitude and speed, is measured as
//!
//! ```text
//! ln (D / D_model) = bias + slope · z + Σ (aᵢ sin kᵢh + bᵢ cos kᵢh) + w(h),      z = (h − 20 km) / 40 km
//! ln (L / D) − ln (L / D)_model = constant
//! ```
//!
//! Source: the adaptation of `guidance.md` §4b, with waves added: bands of waves of 10–30 km length, the length of the gravity waves of a
//! planetary atmosphere. What they were above the vehicle says what they will be below it; a short process w alone
//! would forget them. The ratio holds density, drag coefficient, area and mass together, all that predictions need;
//! the density of navigation is used only where the drag is too weak to be felt, and never multiplies.

use crate::frames::{Body, Vec3};
use crate::math::fun::{exp, ln, sin_cos, sqrt};
use crate::math::num::{abs, clamp, max};
use crate::model::OnboardModel;
use crate::model::entry::Environment;
use crate::nav::Estimate;
use crate::time::FRAME;

use super::air::{AirProfile, RATIO_NODES, SPACING_M};
use super::density;

/// Bands of waves.
const BANDS: usize = 6;
/// Bias, slope, sine and cosine of each band, short process.
const STATES: usize = 2 + 2 * BANDS + 1;
/// Index of the short process.
const SHORT: usize = STATES - 1;
/// Wave numbers, rad/m: equal spacing between wavelengths of 30 and 10 km.
const WAVE_NUMBERS_PM: [f64; BANDS] = wave_numbers();
/// Standard deviation of the logarithm before anything is measured: of bias, of slope per 40 km, of all waves together.
const BIAS_SIGMA: f64 = 0.2;
const SLOPE_SIGMA: f64 = 0.1;
const WAVE_SIGMA: f64 = 0.02;
/// Short process: standard deviation and correlation length, m.
const SHORT_SIGMA: f64 = 0.004;
const SHORT_LENGTH_M: f64 = 2_000.0;
/// Where it has faded to less than a hundredth, m.
const SHORT_REACH_M: f64 = 5.0 * SHORT_LENGTH_M;
/// Standard deviation of one measurement beside the noise of the sensor: what neither model nor waves explain.
const MEASUREMENT_SIGMA: f64 = 0.002;
/// Standard deviation of the logarithm of lift over drag before anything is measured, and what it may drift per measurement.
const LIFT_SIGMA: f64 = 0.1;
const LIFT_DRIFT: f64 = 1e-4;
/// Drag below which the force says nothing, m/s².
const MIN_DRAG_MPS2: f64 = 0.3;
/// Minor frames that make one measurement.
const FRAMES_PER_MEASUREMENT: u32 = 10;
/// Nodes of the table of air that are found in one minor frame; 27 frames find them all.
const NODES_PER_FRAME: usize = 3;
/// Largest logarithm that is believed: a broken sensor must not steer.
const MAX_LOG_RATIO: f64 = 1.0;
/// Centre and scale of the slope, m, and the range of z in which it goes on.
const SLOPE_CENTRE_M: f64 = 20e3;
const SLOPE_SCALE_M: f64 = 40e3;

const fn wave_numbers() -> [f64; BANDS] {
    let mut numbers = [0.0; BANDS];
    let (longest, shortest) = (1.0 / 30e3, 1.0 / 10e3);
    let mut i = 0;
    while i < BANDS {
        #[allow(clippy::indexing_slicing, clippy::cast_precision_loss)] // i < BANDS, a small number
        {
            let share = i as f64 / (BANDS - 1) as f64;
            numbers[i] = 2.0 * core::f64::consts::PI * (longest + share * (shortest - longest));
        }
        i += 1;
    }
    numbers
}

type Row = [f64; STATES];

/// What was learned so far. Fixed size.
#[derive(Clone, Debug, PartialEq)]
pub struct Adaptation {
    mean: Row,
    /// Symmetric; both halves are kept.
    covariance: [Row; STATES],
    /// Logarithm of lift over drag over that of the model, and its variance.
    lift: f64,
    lift_variance: f64,
    /// Altitude of the last measurement, m; none yet.
    altitude_m: Option<f64>,
    window: Window,
    table: Tabulation,
}

/// The table of air in the making: all at once would be the dearest frame of the second.
#[derive(Clone, Debug, PartialEq)]
struct Tabulation {
    /// Nodes found so far.
    found: usize,
    /// Sine and cosine of each wave at the next node, turned on from node to node.
    waves: [(f64, f64); BANDS],
    /// Sine and cosine of what each wave turns from node to node.
    turns: [(f64, f64); BANDS],
    /// Density over that of the model, less one: nothing learned is all zeros.
    excess: [f32; RATIO_NODES],
}

/// Sums over the frames of one measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Window {
    frames: u32,
    drag_mps2: f64,
    lift_mps2: f64,
    altitude_m: f64,
    speed_mps: f64,
    climb_mps: f64,
}

impl Default for Adaptation {
    fn default() -> Self {
        Self::NEW
    }
}

impl Adaptation {
    /// Nothing learned.
    pub const NEW: Self = {
        let mut adaptation = Self::DORMANT;
        adaptation.wake();
        adaptation
    };

    /// All zero bytes, to become [`Self::NEW`] by [`Self::wake`].
    pub(super) const DORMANT: Self = Self {
        mean: [0.0; STATES],
        covariance: [[0.0; STATES]; STATES],
        lift: 0.0,
        lift_variance: 0.0,
        altitude_m: None,
        window: Window { frames: 0, drag_mps2: 0.0, lift_mps2: 0.0, altitude_m: 0.0, speed_mps: 0.0, climb_mps: 0.0 },
        table: Tabulation {
            found: 0,
            waves: [(0.0, 0.0); BANDS],
            turns: [(0.0, 0.0); BANDS],
            excess: [0.0; RATIO_NODES],
        },
    };

    /// Becomes [`Self::NEW`] from [`Self::DORMANT`], in place.
    #[allow(clippy::indexing_slicing)] // i < STATES
    #[allow(clippy::cast_precision_loss)] // a small number
    pub(super) const fn wake(&mut self) {
        self.lift_variance = LIFT_SIGMA * LIFT_SIGMA;
        let p = &mut self.covariance;
        let mut i = 0;
        while i < STATES {
            p[i][i] = WAVE_SIGMA * WAVE_SIGMA / BANDS as f64;
            i += 1;
        }
        p[0][0] = BIAS_SIGMA * BIAS_SIGMA;
        p[1][1] = SLOPE_SIGMA * SLOPE_SIGMA;
        p[SHORT][SHORT] = SHORT_SIGMA * SHORT_SIGMA;
    }

    /// One minor frame: gathers, and measures when enough is gathered. `noise_mps2` is the error of the force of one frame.
    #[inline(never)] // once in a frame
    pub fn observe(&mut self, estimate: &Estimate, model: &OnboardModel, noise_mps2: f64) {
        let finite = estimate.specific_force_b.is_finite() && estimate.altitude_m.is_finite();
        if !(estimate.valid && finite && estimate.speed_mps > 1.0) {
            self.window = Window::default();
            return;
        }
        let w = &mut self.window;
        let (sine, cosine) = sin_cos(model.vehicle.trim_angle_of_attack_rad);
        let forward = Vec3::<Body>::new(cosine, 0.0, sine);
        let up = Vec3::<Body>::new(sine, 0.0, -cosine);
        w.frames += 1;
        w.drag_mps2 -= estimate.specific_force_b.dot(&forward);
        w.lift_mps2 += estimate.specific_force_b.dot(&up);
        w.altitude_m += estimate.altitude_m;
        w.speed_mps += estimate.speed_mps;
        w.climb_mps += estimate.r_p.dot(&estimate.v_p) / estimate.r_p.norm();
        if w.frames == FRAMES_PER_MEASUREMENT {
            let mean = w.mean();
            *w = Window::default();
            self.take(&mean, model, noise_mps2 / sqrt(f64::from(FRAMES_PER_MEASUREMENT)), estimate);
        }
    }

    #[inline(never)] // five times a second
    fn take(&mut self, mean: &Window, model: &OnboardModel, noise_mps2: f64, estimate: &Estimate) {
        let (drag, lift) = (mean.drag_mps2, mean.lift_mps2);
        if drag < MIN_DRAG_MPS2 {
            // Too thin to be felt: what navigation knows stands in, once, until the force takes over.
            if self.altitude_m.is_none() {
                self.set_bias(ln(density::ratio(estimate)));
            }
            return;
        }
        let (h, v) = (mean.altitude_m, mean.speed_mps);
        let (drag_coefficient, lift_coefficient) = model.drag_and_lift_coefficients(h, v);
        let per_coefficient = Environment::<f64>::density_kgpm3(model, h)
            * v
            * v
            * Environment::<f64>::constants(model).half_area_per_mass_m2pkg;
        let ratio = drag / (per_coefficient * drag_coefficient);
        let believable = ratio > 0.0 && ratio.is_finite();
        if !believable {
            return;
        }
        let relative = noise_mps2 / drag;
        self.update(h, ln(ratio), MEASUREMENT_SIGMA * MEASUREMENT_SIGMA + relative * relative);
        let lift_ratio = lift * drag_coefficient / (drag * lift_coefficient);
        if lift_ratio > 0.0 && lift_ratio.is_finite() {
            let relative = noise_mps2 / lift;
            let noise = MEASUREMENT_SIGMA * MEASUREMENT_SIGMA + relative * relative;
            self.lift_variance += LIFT_DRIFT * LIFT_DRIFT;
            let gain = self.lift_variance / (self.lift_variance + noise);
            self.lift += gain * (ln(lift_ratio) - self.lift);
            self.lift_variance *= 1.0 - gain;
        }
    }

    #[allow(clippy::indexing_slicing)] // the first of fifteen
    fn set_bias(&mut self, log_ratio: f64) {
        self.mean[0] = log_ratio;
    }

    /// A scalar measurement of the logarithm at an altitude.
    #[inline(never)] // five times a second
    fn update(&mut self, altitude_m: f64, measured: f64, variance: f64) {
        self.forget(altitude_m);
        let basis = basis(altitude_m);
        let mut along = [0.0; STATES];
        for (a, row) in along.iter_mut().zip(&self.covariance) {
            *a = dot(row, &basis);
        }
        let innovation = measured - dot(&self.mean, &basis);
        let total = variance + dot(&along, &basis);
        if !(total > 0.0 && innovation.is_finite()) {
            return;
        }
        let per_total = 1.0 / total;
        for ((mean, row), a) in self.mean.iter_mut().zip(&mut self.covariance).zip(&along) {
            let gain = a * per_total;
            *mean += gain * innovation;
            // Element by element the same product both ways round, so that the matrix stays symmetric to the last bit.
            for (p, b) in row.iter_mut().zip(&along) {
                *p -= a * b * per_total;
            }
        }
    }

    /// The short process on the way to another altitude.
    #[allow(clippy::indexing_slicing)] // constant index
    fn forget(&mut self, altitude_m: f64) {
        let moved_m = abs(altitude_m - self.altitude_m.unwrap_or(altitude_m));
        self.altitude_m = Some(altitude_m);
        let kept = exp(-moved_m / SHORT_LENGTH_M);
        self.mean[SHORT] *= kept;
        for i in 0..STATES {
            self.covariance[i][SHORT] *= kept;
            self.covariance[SHORT][i] *= kept;
        }
        self.covariance[SHORT][SHORT] += SHORT_SIGMA * SHORT_SIGMA * (1.0 - kept * kept);
    }

    /// Begins a table of what is believed of the air.
    pub fn begin_table(&mut self) {
        self.table.found = 0;
        self.table.waves = [(0.0, 1.0); BANDS];
        self.table.turns = WAVE_NUMBERS_PM.map(|k| sin_cos(k * SPACING_M));
    }

    /// Finds the next few nodes of the table, from the ground up; nothing when all are found.
    #[allow(clippy::indexing_slicing)] // constant indices and counters below BANDS
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // a small number; a table of single precision
    #[inline(never)] // once in a frame
    pub fn continue_table(&mut self) {
        let at_m = self.altitude_m.unwrap_or(0.0);
        let table = &mut self.table;
        for excess in table.excess.iter_mut().skip(table.found).take(NODES_PER_FRAME) {
            let altitude_m = table.found as f64 * SPACING_M;
            let mut log_ratio = self.mean[0] + self.mean[1] * slope_of(altitude_m);
            for i in 0..BANDS {
                let (sine, cosine) = table.waves[i];
                let (turn_sine, turn_cosine) = table.turns[i];
                log_ratio += self.mean[2 + 2 * i] * sine + self.mean[3 + 2 * i] * cosine;
                table.waves[i] = (sine * turn_cosine + cosine * turn_sine, cosine * turn_cosine - sine * turn_sine);
            }
            let away_m = abs(at_m - altitude_m);
            if away_m < SHORT_REACH_M {
                log_ratio += self.mean[SHORT] * exp(-away_m / SHORT_LENGTH_M);
            }
            *excess = (exp(clamp(log_ratio, -MAX_LOG_RATIO, MAX_LOG_RATIO)) - 1.0) as f32;
            table.found += 1;
        }
    }

    /// The air of the table, and the lift.
    #[inline(never)] // once a second
    pub fn publish(&self, model: &OnboardModel, profile: &mut AirProfile) {
        profile.fill(model, exp(clamp(self.lift, -MAX_LOG_RATIO, MAX_LOG_RATIO)), &self.table.excess);
    }
}

impl Window {
    fn mean(&self) -> Self {
        let per_frame = 1.0 / f64::from(max_frames(self.frames));
        // The force is the mean over a frame, the state that of its end: half a frame of climb lies between.
        Self {
            frames: self.frames,
            drag_mps2: self.drag_mps2 * per_frame,
            lift_mps2: self.lift_mps2 * per_frame,
            altitude_m: (self.altitude_m - 0.5 * FRAME.as_s() * self.climb_mps) * per_frame,
            speed_mps: max((self.speed_mps + 0.5 * FRAME.as_s() * self.drag_mps2) * per_frame, 1.0),
            climb_mps: self.climb_mps * per_frame,
        }
    }
}

fn max_frames(frames: u32) -> u32 {
    if frames == 0 { 1 } else { frames }
}

#[inline(never)] // seventeen times in an update
fn dot(a: &Row, b: &Row) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b)
}

fn slope_of(altitude_m: f64) -> f64 {
    (altitude_m - SLOPE_CENTRE_M) / SLOPE_SCALE_M
}

#[allow(clippy::indexing_slicing)] // constant indices and counters below BANDS
#[inline(never)]
fn basis(altitude_m: f64) -> Row {
    let mut row = [1.0; STATES];
    row[1] = slope_of(altitude_m);
    for i in 0..BANDS {
        let (sine, cosine) = sin_cos(WAVE_NUMBERS_PM[i] * altitude_m);
        row[2 + 2 * i] = sine;
        row[3 + 2 * i] = cosine;
    }
    row
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::PlanetFixed;

    fn model() -> OnboardModel {
        let c = Config::DEFAULT;
        OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    /// What a vehicle feels that falls through air of this log-ratio with this lift over drag over that of the model.
    fn felt(model: &OnboardModel, altitude_m: f64, log_ratio: f64, lift_ratio: f64) -> Estimate {
        let speed_mps = 3e3;
        let (cd, cl) = model.drag_and_lift_coefficients(altitude_m, speed_mps);
        let per_coefficient = model.atmosphere.density(altitude_m)
            * exp(log_ratio)
            * speed_mps
            * speed_mps
            * model.constants().half_area_per_mass_m2pkg;
        let (sine, cosine) = sin_cos(model.vehicle.trim_angle_of_attack_rad);
        let (forward, up) = (Vec3::<Body>::new(cosine, 0.0, sine), Vec3::<Body>::new(sine, 0.0, -cosine));
        Estimate {
            specific_force_b: up * (per_coefficient * cl * lift_ratio) - forward * (per_coefficient * cd),
            r_p: Vec3::<PlanetFixed>::new(model.planet.radius_m + altitude_m, 0.0, 0.0),
            v_p: Vec3::<PlanetFixed>::new(0.0, speed_mps, 0.0),
            altitude_m,
            speed_mps,
            valid: true,
            ..Estimate::default()
        }
    }

    /// Falls from 60 km to an altitude at 100 m/s.
    fn taught(model: &OnboardModel, to_m: f64, lift_ratio: f64, log_ratio: impl Fn(f64) -> f64) -> Adaptation {
        let mut adaptation = Adaptation::NEW;
        let frames = ((60e3 - to_m) / 2.0) as u32;
        for frame in 0..frames {
            let h = 60e3 - 2.0 * f64::from(frame);
            // The force is that of the frame, the altitude that of its end: level flight makes them the same.
            adaptation.observe(&felt(model, h, log_ratio(h), lift_ratio), model, 1e-3);
        }
        adaptation
    }

    fn air(adaptation: &mut Adaptation, model: &OnboardModel) -> AirProfile {
        let mut air = AirProfile::NONE;
        adaptation.begin_table();
        for _ in 0..RATIO_NODES.div_ceil(NODES_PER_FRAME) {
            adaptation.continue_table();
        }
        adaptation.publish(model, &mut air);
        air
    }

    /// Logarithm of the density over that of the model.
    fn learned(air: &AirProfile, model: &OnboardModel, altitude_m: f64) -> f64 {
        ln(air.density_kgpm3(altitude_m) / model.atmosphere.density(altitude_m))
    }

    #[test]
    fn a_bias_and_a_slope_are_learned_and_go_on_below_the_vehicle() {
        let model = model();
        let truth = |h: f64| -0.15 + 0.08 * slope_of(h);
        let air = air(&mut taught(&model, 25e3, 1.0, truth), &model);
        for h in [50e3, 25e3, 15e3, 8e3] {
            assert!((learned(&air, &model, h) - truth(h)).abs() < 0.01, "{h}: {}", learned(&air, &model, h));
        }
    }

    #[test]
    fn a_wave_seen_above_is_expected_below() {
        let model = model();
        let truth = |h: f64| 0.04 * (2.0 * core::f64::consts::PI * h / 18e3 + 0.7).sin();
        let air = air(&mut taught(&model, 18e3, 1.0, truth), &model);
        for h in [17e3, 15e3, 13e3, 12e3] {
            let (error, held) = (learned(&air, &model, h) - truth(h), truth(18e3) - truth(h));
            assert!(error.abs() < 0.5 * held.abs(), "{h}: {error} against {held} with the ratio held");
        }
    }

    #[test]
    fn lift_over_drag_is_learned_apart_from_the_air() {
        let model = model();
        let air = air(&mut taught(&model, 30e3, 0.93, |_| 0.1), &model);
        assert!((air.lift_to_drag() - 0.93).abs() < 1e-3, "{}", air.lift_to_drag());
        assert!((learned(&air, &model, 30e3) - 0.1).abs() < 2e-3);
    }

    #[test]
    fn before_any_drag_is_felt_the_density_of_navigation_stands_in() {
        let model = model();
        let mut adaptation = Adaptation::NEW;
        let thin = Estimate { log_density: -0.2, log_density_sigma: 0.01, ..felt(&model, 110e3, 0.0, 1.0) };
        for _ in 0..FRAMES_PER_MEASUREMENT {
            adaptation.observe(&thin, &model, 1e-3);
        }
        assert!((learned(&air(&mut adaptation, &model), &model, 30e3) + 0.2).abs() < 1e-6);
    }

    #[test]
    fn nonsense_is_not_learned_and_the_covariance_stays_symmetric() {
        let model = model();
        let mut adaptation = taught(&model, 40e3, 1.0, |_| 0.05);
        let before = adaptation.mean;
        let good = felt(&model, 40e3, 0.05, 1.0);
        let nan = Vec3::<Body>::new(f64::NAN, 0.0, 0.0);
        for bad in [
            Estimate { valid: false, ..good },
            Estimate { altitude_m: f64::NAN, ..good },
            Estimate { specific_force_b: nan, ..good },
            Estimate { specific_force_b: good.specific_force_b * -1.0, ..good },
        ] {
            for _ in 0..50 {
                adaptation.observe(&bad, &model, 1e-3);
            }
        }
        assert_eq!(adaptation.mean, before);
        let p = &adaptation.covariance;
        assert!((0..STATES).all(|i| p[i][i] > 0.0 && (0..STATES).all(|j| p[i][j] == p[j][i])));
    }

    #[test]
    fn a_table_whose_frames_were_skipped_keeps_what_it_knew() {
        let model = model();
        let mut adaptation = taught(&model, 30e3, 1.0, |_| 0.1);
        let whole = air(&mut adaptation, &model);
        adaptation.begin_table();
        adaptation.continue_table();
        let mut partly = AirProfile::NONE;
        adaptation.publish(&model, &mut partly);
        assert_eq!(partly, whole);
    }
}
