//! Bridging of minor frames without a trustworthy inertial measurement, and what it does to the uncertainty.
//!
//! A missing frame is filled with what the vehicle most likely felt: the last force that was measured, followed along the path
//! by the onboard model of the air (or the model alone where nothing above the noise was measured), and the last turn, changed by the bank
//! acceleration that control commands meanwhile. So a bank reversal under way is finished, and neither a deceleration nor a
//! roll is repeated for ever. The growing doubt goes into the covariance, and long gaps invalidate the estimate.

use super::strapdown::{Increments, Nominal};
use crate::frames::{Body, Inertial, Vec3};
use crate::math::fun::{exp, sin_cos};
use crate::math::num::{clamp, min};
use crate::model::OnboardModel;
use crate::model::entry::Environment;
use crate::model::loads::dynamic_pressure_pa;
use crate::sensors::limits::ACCELEROMETER_LIMIT_MPS2;

/// Consecutive bridged frames after which the estimate is no longer valid: 0.5 s.
pub const MAX_BRIDGED_FRAMES: u16 = 25;
/// Consecutive measured frames after which it is, if its uncertainty allows: two windows of the filter, so that the covariance
/// that decides has taken the gap in.
pub const RECOVERY_FRAMES: u16 = 2 * super::filter::FRAMES_PER_EPOCH as u16;
/// Change of the specific force against the bridged one, m/s³: an entry's steepest build-up, about 1 g/s.
const JERK_MPS3: f64 = 10.0;
/// Change of the body rate against the bridged one, rad/s²: what lag and trim leave of a commanded bank acceleration.
const ANGULAR_ACCELERATION_RADPS2: f64 = 0.02;
/// The error of force and rate grows for so long, s, and then stays: both follow the model and the command.
const GROWTH_S: f64 = 1.0;
/// Largest error of the force that follows the model, as a share of it: the air may have changed by a tenth, and the lift, a
/// quarter of the drag, may be half a radian off …
const FORCE_SHARE: f64 = 0.15;
/// … and what there is besides, m/s².
const FORCE_FLOOR_MPS2: f64 = 1.0;
/// From [`GROWTH_S`] on the air is taken to bring the vehicle to its trim within about so long, s: without gyros nothing else is
/// known of pitch and yaw.
const TRIM_S: f64 = 1.0;
/// What remains unknown of the attitude then, rad: the bank above all.
const ATTITUDE_DOUBT_RAD: f64 = 0.1;
/// How long such an error of the force keeps its sign, s: what it has made of the velocity by then is all that the next frame's is of a
/// piece with.
const COHERENT_S: f64 = 20.0;
/// Specific force below which a measured one says nothing of the air, m/s²: far above bias and noise.
const MIN_FORCE_MPS2: f64 = 0.5;
/// What a saturated accelerometer may have missed, m/s² (5 g beyond its limit).
const ACCELEROMETER_EXCESS_MPS2: f64 = 50.0;
/// What a saturated gyro may have missed, rad/s (60°/s beyond its limit).
const GYRO_EXCESS_RADPS: f64 = 1.05;

/// Fills gaps and counts them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bridge {
    run: u16,
    total: u32,
    /// What the run may have done to the velocity so far, m/s.
    doubt_mps: f64,
    /// Measured frames since the last gap.
    measured_run: u16,
    lost: bool,
    reference: Reference,
    accelerometer_run: u16,
    gyro_run: u16,
}

/// What was measured last before a gap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Reference {
    delta_v_b: Vec3<Body>,
    /// The force that the onboard model expected then, m/s².
    expected_mps2: f64,
}

/// Increments of a frame as the sensors gave them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measured {
    pub increments: Increments,
    pub accelerometer_saturated: bool,
    pub gyro_saturated: bool,
}

/// What a bridge needs to know of the vehicle at the start of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surroundings<'a> {
    pub nominal: &'a Nominal,
    pub log_density: f64,
    pub model: &'a OnboardModel,
    /// Bank acceleration commanded over the frame, rad/s².
    pub bank_accel_radps2: f64,
    pub dt_s: f64,
}

/// Variances that one bridged or saturated frame adds, per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BridgeNoise {
    /// Of the velocity, (m/s)².
    pub velocity: f64,
    /// Of the attitude, rad².
    pub attitude: f64,
}

impl Bridge {
    /// A bridge before the first frame.
    pub const NEW: Self = Self {
        run: 0,
        total: 0,
        doubt_mps: 0.0,
        measured_run: 0,
        lost: false,
        reference: Reference { delta_v_b: Vec3::zero(), expected_mps2: 0.0 },
        accelerometer_run: 0,
        gyro_run: 0,
    };

    /// The increments to use this frame, and the noise that they add. `last` are those of the frame before, if any.
    pub fn choose(
        &mut self,
        measured: Option<Measured>,
        last: Option<Increments>,
        around: &Surroundings<'_>,
    ) -> (Increments, BridgeNoise) {
        let Some(measured) = measured else { return self.fill(last.unwrap_or_default(), around) };
        self.run = 0;
        self.measured_run = self.measured_run.saturating_add(1);
        self.lost = self.lost && self.measured_run < RECOVERY_FRAMES;
        (measured.increments, self.saturation(&measured, around.dt_s))
    }

    fn fill(&mut self, last: Increments, around: &Surroundings<'_>) -> (Increments, BridgeNoise) {
        let dt = around.dt_s;
        let expected = expected_force_b(around);
        if self.run == 0 {
            self.reference = Reference { delta_v_b: last.delta_v_b, expected_mps2: expected.norm() };
            self.doubt_mps = 0.0;
        }
        let before_s = f64::from(self.run) * dt;
        self.measured_run = 0;
        self.run = self.run.saturating_add(1);
        self.total = self.total.saturating_add(1);
        self.lost = self.lost || self.run > MAX_BRIDGED_FRAMES;
        let force_b = self.force_b(&expected, dt);
        let increments = Increments {
            delta_v_b: force_b * dt,
            delta_theta_b: turn_b(&last, before_s, around)
                + velocity_axis(around.model) * (around.bank_accel_radps2 * dt * dt),
        };
        // The error grows coherently over the run: each frame adds the difference of the squares.
        let doubt_rad = |t_s: f64| min(ANGULAR_ACCELERATION_RADPS2 * growth(t_s), ATTITUDE_DOUBT_RAD);
        let (before, after) = (doubt_rad(before_s), doubt_rad(f64::from(self.run) * dt));
        let noise = BridgeNoise {
            velocity: self.doubt_velocity(&force_b, before_s, dt),
            attitude: after * after - before * before,
        };
        (increments, noise)
    }

    /// Variance that a frame of a run adds to the velocity, whose errors are of a piece with those of the frames before.
    fn doubt_velocity(&mut self, force_b: &Vec3<Body>, before_s: f64, dt_s: f64) -> f64 {
        let grown = JERK_MPS3 * min(before_s + 0.5 * dt_s, GROWTH_S);
        let error_mps2 = min(grown, FORCE_SHARE * force_b.norm() + FORCE_FLOOR_MPS2);
        let before = min(self.doubt_mps, error_mps2 * COHERENT_S);
        self.doubt_mps = before + error_mps2 * dt_s;
        self.doubt_mps * self.doubt_mps - before * before
    }

    /// The measured force carried along by the model, or the model's own; never more than an accelerometer could measure.
    fn force_b(&self, expected: &Vec3<Body>, dt_s: f64) -> Vec3<Body> {
        let measured = self.reference.delta_v_b * (1.0 / dt_s);
        let carried = measured.norm() >= MIN_FORCE_MPS2 && self.reference.expected_mps2 > 0.0;
        let force = if carried { measured * (expected.norm() / self.reference.expected_mps2) } else { *expected };
        let size = force.norm();
        if !size.is_finite() {
            return Vec3::zero();
        }
        if size > ACCELEROMETER_LIMIT_MPS2 { force * (ACCELEROMETER_LIMIT_MPS2 / size) } else { force }
    }

    /// A saturated axis missed an unknown part of the motion, all of one sign while it lasts.
    fn saturation(&mut self, measured: &Measured, dt_s: f64) -> BridgeNoise {
        BridgeNoise {
            velocity: coherent(
                &mut self.accelerometer_run,
                measured.accelerometer_saturated,
                ACCELEROMETER_EXCESS_MPS2 * dt_s,
            ),
            attitude: coherent(&mut self.gyro_run, measured.gyro_saturated, GYRO_EXCESS_RADPS * dt_s),
        }
    }

    /// True from a run of bridged frames too long to trust until [`RECOVERY_FRAMES`] measured ones have followed it.
    pub fn lost(&self) -> bool {
        self.lost
    }

    /// Bridged frames in the present run.
    pub fn run(&self) -> u16 {
        self.run
    }

    /// Bridged frames since the start.
    pub fn total(&self) -> u32 {
        self.total
    }
}

/// Error after a gap of `t_s` over the error of the rate of change: ½t², from [`GROWTH_S`] on a straight line.
fn growth(t_s: f64) -> f64 {
    let curved = min(t_s, GROWTH_S);
    0.5 * curved * curved + GROWTH_S * (t_s - curved)
}

/// Variance that one more frame of a run adds when its frames err alike by `sigma` each: n² − (n−1)² times its square.
fn coherent(run: &mut u16, present: bool, sigma: f64) -> f64 {
    *run = if present { run.saturating_add(1) } else { 0 };
    if present { sigma * sigma * (2.0 * f64::from(*run) - 1.0) } else { 0.0 }
}

/// Direction of the air-relative velocity at trim, body axes.
fn velocity_axis(model: &OnboardModel) -> Vec3<Body> {
    let (sine, cosine) = sin_cos(model.vehicle.trim_angle_of_attack_rad);
    Vec3::new(cosine, 0.0, sine)
}

/// The turn of a frame without gyros: that of the frame before, and after a while its roll, with pitch and yaw following the
/// velocity.
fn turn_b(last: &Increments, before_s: f64, around: &Surroundings<'_>) -> Vec3<Body> {
    if before_s < GROWTH_S {
        return last.delta_theta_b;
    }
    let axis = velocity_axis(around.model);
    let forward = around.nominal.attitude_bi.inverse().apply(&air_relative(around)).unit().unwrap_or(axis);
    axis * last.delta_theta_b.dot(&axis) + axis.cross(&forward) * (around.dt_s / TRIM_S)
}

/// Velocity relative to the air.
fn air_relative(around: &Surroundings<'_>) -> Vec3<Inertial> {
    let spin = Vec3::<Inertial>::new(0.0, 0.0, around.model.planet.rotation_radps);
    around.nominal.v_i - spin.cross(&around.nominal.r_i)
}

/// Specific force that the onboard model expects at trim in the air that navigation found, body axes, m/s².
fn expected_force_b(around: &Surroundings<'_>) -> Vec3<Body> {
    let (nominal, model) = (around.nominal, around.model);
    let altitude_m = nominal.r_i.norm() - model.planet.radius_m;
    let speed_mps = air_relative(around).norm();
    let density = model.atmosphere.density(altitude_m) * exp(clamp(around.log_density, -1.0, 1.0));
    let (drag, lift) = model.drag_and_lift_coefficients(altitude_m, speed_mps);
    let scale = dynamic_pressure_pa(density, speed_mps) * model.vehicle.reference_area_m2 / model.vehicle.mass_kg;
    let forward = velocity_axis(model);
    let up = Vec3::new(forward.z(), 0.0, -forward.x());
    forward * (-scale * drag) + up * (scale * lift)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::Rot;
    use crate::math::fun::sqrt;

    fn model() -> OnboardModel {
        let c = Config::DEFAULT;
        OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    /// In thick air at an altitude, or in none.
    fn nominal(altitude_m: f64) -> Nominal {
        Nominal {
            r_i: Vec3::new(Config::DEFAULT.planet.radius_m + altitude_m, 0.0, 0.0),
            v_i: Vec3::new(-1000.0, 3000.0, 0.0),
            ..Nominal::default()
        }
    }

    fn around<'a>(model: &'a OnboardModel, nominal: &'a Nominal) -> Surroundings<'a> {
        Surroundings { nominal, log_density: 0.0, model, bank_accel_radps2: 0.0, dt_s: 0.02 }
    }

    fn some() -> Increments {
        Increments { delta_v_b: Vec3::new(0.1, 0.2, 0.3), delta_theta_b: Vec3::new(0.1, 0.0, 0.0) }
    }

    fn measured(increments: Increments) -> Option<Measured> {
        Some(Measured { increments, ..Measured::default() })
    }

    #[test]
    fn a_missing_frame_repeats_the_last_increments_and_is_counted() {
        let (model, nominal) = (model(), nominal(20e3));
        let around = around(&model, &nominal);
        let mut bridge = Bridge::default();
        let (used, noise) = bridge.choose(None, Some(some()), &around);
        assert!((used.delta_v_b - some().delta_v_b).norm() < 1e-12 && used.delta_theta_b == some().delta_theta_b);
        assert!(noise.velocity > 0.0 && noise.attitude > 0.0);
        bridge.choose(measured(some()), None, &around);
        assert_eq!((bridge.run(), bridge.total()), (0, 1));
    }

    #[test]
    fn the_force_follows_the_air_and_the_turn_follows_the_command() {
        let (model, low, high) = (model(), nominal(20e3), nominal(30e3));
        let mut bridge = Bridge::default();
        bridge.choose(None, Some(some()), &around(&model, &high));
        let command = Surroundings { bank_accel_radps2: -0.08, ..around(&model, &low) };
        let (used, _) = bridge.choose(None, Some(some()), &command);
        let thicker = exp(10e3 / Config::DEFAULT.atmosphere.scale_height_m);
        // The air that turns with the planet is 0.7 m/s slower ten kilometres lower.
        assert!((used.delta_v_b.norm() / some().delta_v_b.norm() / thicker - 1.0).abs() < 1e-3);
        let turned = used.delta_theta_b - some().delta_theta_b;
        assert!((turned.norm() - 0.08 * 0.02 * 0.02).abs() < 1e-15 && turned.x() < 0.0);
    }

    #[test]
    fn where_nothing_was_measured_the_model_flies_and_never_above_the_range_of_the_sensor() {
        let (model, thick) = (model(), nominal(20e3));
        let (used, _) = Bridge::default().choose(None, None, &around(&model, &thick));
        let c = Config::DEFAULT;
        let q = dynamic_pressure_pa(
            model.atmosphere.density(20e3),
            sqrt(1000.0f64.powi(2) + (3000.0 - 7.088_218e-5 * thick.r_i.x()).powi(2)),
        );
        let drag = q * c.vehicle.drag_coefficient * c.vehicle.reference_area_m2 / c.vehicle.mass_kg;
        // Lift adds √(1 + 0.24²) and tilts; the sensed force at α −16° is along (−1.490, 0, 0.065) for C_D 1.45.
        assert!((used.delta_v_b.x() / 0.02 / drag + 1.490 / 1.45).abs() < 1e-3);
        assert!((used.delta_v_b.z() / 0.02 / drag - 0.065 / 1.45).abs() < 1e-3);
        let deep = nominal(-60e3);
        let (used, _) = Bridge::default().choose(None, Some(some()), &around(&model, &deep));
        assert!(used.delta_v_b.norm() <= 1.000_001 * ACCELEROMETER_LIMIT_MPS2 * 0.02);
    }

    #[test]
    fn a_long_gap_is_lost_until_the_covariance_has_taken_it_in() {
        let (model, nominal) = (model(), nominal(20e3));
        let around = around(&model, &nominal);
        let mut bridge = Bridge::default();
        for _ in 0..MAX_BRIDGED_FRAMES {
            bridge.choose(None, Some(some()), &around);
            assert!(!bridge.lost());
        }
        bridge.choose(None, Some(some()), &around);
        for _ in 0..RECOVERY_FRAMES {
            assert!(bridge.lost());
            bridge.choose(measured(some()), Some(some()), &around);
        }
        assert!(!bridge.lost());
    }

    /// Ten times as much as [`some`]: a third of it is more than any jerk makes in a second.
    fn much() -> Increments {
        Increments { delta_v_b: some().delta_v_b * 10.0, ..some() }
    }

    #[test]
    fn the_variance_of_a_run_is_that_of_its_whole_length() {
        let (model, nominal) = (model(), nominal(20e3));
        let around = around(&model, &nominal);
        // ½·J·t² at first, J·(t − ½) after a second.
        for (frames, error) in [(10, 0.5 * JERK_MPS3 * 0.2 * 0.2), (150, JERK_MPS3 * 2.5)] {
            let mut bridge = Bridge::default();
            let sum: f64 = (0..frames).map(|_| bridge.choose(None, Some(much()), &around).1.velocity).sum();
            assert!((sum / (error * error) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_small_force_is_doubted_little_and_a_long_run_no_longer_coherently() {
        let (model, nominal) = (model(), nominal(20e3));
        let around = around(&model, &nominal);
        let error_mps2 = FORCE_SHARE * some().delta_v_b.norm() / 0.02 + FORCE_FLOOR_MPS2;
        let mut bridge = Bridge::default();
        let noises: std::vec::Vec<f64> =
            (0..5_000).map(|_| bridge.choose(None, Some(some()), &around).1.velocity).collect();
        let first: f64 = noises.iter().take(500).sum();
        assert!(sqrt(first) < error_mps2 * 10.0 && sqrt(first) > error_mps2 * 9.0);
        let last = noises.last().copied().unwrap();
        assert!((last / (2.0 * COHERENT_S * error_mps2 * error_mps2 * 0.02) - 1.0).abs() < 1e-2, "{last}");
    }

    #[test]
    fn without_gyros_the_vehicle_comes_to_its_trim_and_no_more_is_doubted_than_its_bank() {
        let (model, mut state) = (model(), nominal(20e3));
        let axis = velocity_axis(&model);
        let off_trim = |state: &Nominal| {
            let forward = state.attitude_bi.inverse().apply(&air_relative(&around(&model, state))).unit().unwrap();
            axis.cross(&forward).norm()
        };
        let (mut bridge, mut last, mut doubt) = (Bridge::default(), Increments::default(), 0.0);
        state.attitude_bi = Rot::from_columns(
            &Vec3::<Inertial>::new(-0.1, 0.994_987_437_106_62, 0.0),
            &Vec3::new(-0.994_987_437_106_62, -0.1, 0.0),
            &Vec3::new(0.0, 0.0, 1.0),
        )
        .unwrap();
        assert!(off_trim(&state) > 0.05);
        for _ in 0..500 {
            let (used, noise) = bridge.choose(None, Some(last), &around(&model, &state));
            let turn = Rot::<Body, Body>::from_rotation_vector(used.delta_theta_b.components());
            state.attitude_bi = turn.then(&state.attitude_bi);
            (last, doubt) = (used, doubt + noise.attitude);
        }
        assert!(off_trim(&state) < 1e-3, "{}", off_trim(&state));
        assert!(sqrt(doubt) < 1.001 * ATTITUDE_DOUBT_RAD);
    }

    #[test]
    fn a_saturated_axis_widens_its_own_uncertainty_coherently() {
        let (model, nominal) = (model(), nominal(20e3));
        let around = around(&model, &nominal);
        let mut bridge = Bridge::default();
        let clipped = Measured { increments: some(), gyro_saturated: true, ..Measured::default() };
        let noises: [BridgeNoise; 5] = core::array::from_fn(|_| bridge.choose(Some(clipped), None, &around).1);
        let sum: f64 = noises.iter().map(|n| n.attitude).sum();
        assert!((sqrt(sum) - 5.0 * GYRO_EXCESS_RADPS * 0.02).abs() < 1e-12);
        assert!(noises.iter().all(|n| n.velocity == 0.0));
        assert_eq!(bridge.choose(measured(some()), None, &around).1, BridgeNoise::default());
    }
}
