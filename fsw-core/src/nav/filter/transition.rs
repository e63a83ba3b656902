//! [`Transition`]: how the errors at the start of a window become those at its end, accumulated frame by frame.
//!
//! Error equations of inertial-axes strapdown navigation (Savage 2000, ch. 12; Groves 2013, §14.2.2, without the rotation of the
//! planet because the axes are inertial), with f the specific force, ω the body rate, C body → inertial, G the gravity gradient:
//!
//! ```text
//! δr' = δv      δv' = G δr + φ×Cf − C(δb_a + diag(f) s_a − f×m)      φ' = −C(δb_g + diag(ω) s_g)
//! ```
//!
//! The position takes the velocity change of the window as spread evenly: T·δv₀ + T/2·(change), whose error is the change
//! of the specific force within 0.1 s.

use nalgebra::Matrix3;

use super::layout::{
    ACCELEROMETER_BIAS, ACCELEROMETER_MISALIGNMENT, ACCELEROMETER_SCALE, ATTITUDE, ESTIMATED, Estimated, Full,
    GYRO_BIAS, GYRO_SCALE, LOG_DENSITY, POSITION, VELOCITY,
};
use crate::frames::{Body, Vec3};
use crate::model::gravity;
use crate::nav::strapdown::{Increments, Nominal, StepRecord};
use crate::planet::Planet;

/// Transition over a window; all blocks that are neither zero nor identity.
#[derive(Clone, Debug, PartialEq)]
pub struct Transition {
    /// Length T of the window, s.
    pub elapsed_s: f64,
    /// ∫G dt: velocity from position, 1/s.
    gravity: Matrix3<f64>,
    /// ∫Cf dt: the velocity increment, whose cross product takes attitude to velocity, m/s.
    velocity_increment: [f64; 3],
    /// ∫C dt: attitude from gyro bias and, negative alike, velocity from accelerometer bias, s.
    turn: Matrix3<f64>,
    /// ∫C diag(f) dt: velocity from accelerometer scale, m/s.
    scale: Matrix3<f64>,
    /// ∫[Cf×]C dt: velocity from accelerometer misalignment, m/s.
    misalignment: Matrix3<f64>,
    /// ∫C diag(ω) dt: attitude from gyro scale, rad.
    gyro_scale: Matrix3<f64>,
    /// ∫[Cf×]∫C: velocity from gyro bias, m.
    velocity_from_gyro_bias: Matrix3<f64>,
    /// ∫[Cf×]∫C diag(ω): velocity from gyro scale, m/s.
    velocity_from_gyro_scale: Matrix3<f64>,
    /// Factor of the log-density error.
    pub density_decay: f64,
}

impl Default for Transition {
    fn default() -> Self {
        let zero = Matrix3::zeros();
        Self {
            elapsed_s: 0.0,
            gravity: zero,
            velocity_increment: [0.0; 3],
            turn: zero,
            scale: zero,
            misalignment: zero,
            gyro_scale: zero,
            velocity_from_gyro_bias: zero,
            velocity_from_gyro_scale: zero,
            density_decay: 1.0,
        }
    }
}

impl Transition {
    /// Adds one frame: the nominal states before and after it, its compensated increments and what the strapdown made of them.
    pub fn accumulate(&mut self, frame: &FrameStep<'_>, planet: &Planet) {
        let dt = frame.dt_s;
        let dcm = (frame.before.attitude_bi.dcm() + frame.after.attitude_bi.dcm()) * 0.5;
        let increment = frame.record.delta_v_i.to_array();
        let cross = cross_matrix(&increment);
        let turn = dcm * dt;
        let gyro_scale = columns_times(&dcm, &frame.increments.delta_theta_b);

        self.velocity_from_gyro_bias += cross * (self.turn + turn * 0.5);
        self.velocity_from_gyro_scale += cross * (self.gyro_scale + gyro_scale * 0.5);
        self.turn += turn;
        self.gyro_scale += gyro_scale;
        self.scale += columns_times(&dcm, &frame.increments.delta_v_b);
        self.misalignment += cross * dcm;
        self.gravity += gravity::gradient(planet, &frame.after.r_i.to_array()) * dt;
        let ([ux, uy, uz], [x, y, z]) = (self.velocity_increment, increment);
        self.velocity_increment = [ux + x, uy + y, uz + z];
        self.density_decay *= frame.density_decay;
        self.elapsed_s += dt;
    }

    /// The estimated states at the end of the window from all states at its start.
    #[must_use]
    #[allow(clippy::indexing_slicing)] // constant block offsets within fixed arrays
    pub fn apply(&self, x: &Full) -> Estimated {
        let at = |block: usize| [x[block], x[block + 1], x[block + 2]];
        let (r, v, phi) = (at(POSITION), at(VELOCITY), at(ATTITUDE));
        let (accelerometer_bias, gyro_bias) = (at(ACCELEROMETER_BIAS), at(GYRO_BIAS));
        let (scale, misalignment, gyro_scale) =
            (at(ACCELEROMETER_SCALE), at(ACCELEROMETER_MISALIGNMENT), at(GYRO_SCALE));

        let mut turned = [0.0; 3];
        subtract_product(&mut turned, &self.turn, &gyro_bias);
        subtract_product(&mut turned, &self.gyro_scale, &gyro_scale);

        let ([ux, uy, uz], [px, py, pz]) = (self.velocity_increment, phi);
        let mut gained = [py * uz - pz * uy, pz * ux - px * uz, px * uy - py * ux];
        add_product(&mut gained, &self.gravity, &r);
        subtract_product(&mut gained, &self.turn, &accelerometer_bias);
        add_product(&mut gained, &self.velocity_from_gyro_bias, &gyro_bias);
        subtract_product(&mut gained, &self.scale, &scale);
        add_product(&mut gained, &self.misalignment, &misalignment);
        add_product(&mut gained, &self.velocity_from_gyro_scale, &gyro_scale);

        let mut out: Estimated = [0.0; ESTIMATED];
        let t = self.elapsed_s;
        for k in 0..3 {
            out[POSITION + k] = r[k] + t * (v[k] + 0.5 * gained[k]);
            out[VELOCITY + k] = v[k] + gained[k];
            out[ATTITUDE + k] = phi[k] + turned[k];
            out[ACCELEROMETER_BIAS + k] = accelerometer_bias[k];
            out[GYRO_BIAS + k] = gyro_bias[k];
        }
        out[LOG_DENSITY] = self.density_decay * x[LOG_DENSITY];
        out
    }
}

/// One frame as the transition sees it.
#[derive(Clone, Copy, Debug)]
pub struct FrameStep<'a> {
    /// Nominal state before the frame.
    pub before: &'a Nominal,
    /// Nominal state after the frame.
    pub after: &'a Nominal,
    /// Compensated increments of the frame.
    pub increments: &'a Increments,
    /// What the strapdown made of them.
    pub record: &'a StepRecord,
    /// Factor of the log-density error over the frame.
    pub density_decay: f64,
    /// Length of the frame, s.
    pub dt_s: f64,
}

fn cross_matrix(v: &[f64; 3]) -> Matrix3<f64> {
    let [x, y, z] = *v;
    Matrix3::new(0.0, -z, y, z, 0.0, -x, -y, x, 0.0)
}

/// C·diag(v).
fn columns_times(dcm: &Matrix3<f64>, v: &Vec3<Body>) -> Matrix3<f64> {
    let (x, y, z) = (v.x(), v.y(), v.z());
    Matrix3::new(
        dcm.m11 * x,
        dcm.m12 * y,
        dcm.m13 * z, //
        dcm.m21 * x,
        dcm.m22 * y,
        dcm.m23 * z, //
        dcm.m31 * x,
        dcm.m32 * y,
        dcm.m33 * z,
    )
}

#[inline(always)]
fn product(m: &Matrix3<f64>, v: &[f64; 3]) -> [f64; 3] {
    let [x, y, z] = *v;
    [m.m11 * x + m.m12 * y + m.m13 * z, m.m21 * x + m.m22 * y + m.m23 * z, m.m31 * x + m.m32 * y + m.m33 * z]
}

#[inline(always)]
fn add_product(sum: &mut [f64; 3], m: &Matrix3<f64>, v: &[f64; 3]) {
    let ([a, b, c], [x, y, z]) = (*sum, product(m, v));
    *sum = [a + x, b + y, c + z];
}

#[inline(always)]
fn subtract_product(sum: &mut [f64; 3], m: &Matrix3<f64>, v: &[f64; 3]) {
    let ([a, b, c], [x, y, z]) = (*sum, product(m, v));
    *sum = [a - x, b - y, c - z];
}
