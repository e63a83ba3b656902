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

use nalgebra::{ArrayStorage, Matrix3};

use super::layout::{
    ACCELEROMETER_BIAS, ACCELEROMETER_MISALIGNMENT, ACCELEROMETER_SCALE, ATTITUDE, Full, GYRO_BIAS, GYRO_SCALE,
    LOG_DENSITY, MOVING, Moving, POSITION, VELOCITY,
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
        Self::none()
    }
}

impl Transition {
    /// The transition over no time.
    pub const fn none() -> Self {
        Self { density_decay: 1.0, ..Self::unset() }
    }

    /// All zero: stands where no window has begun yet.
    pub(super) const fn unset() -> Self {
        let zero = Matrix3::from_array_storage(ArrayStorage([[0.0; 3]; 3]));
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
            density_decay: 0.0,
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

    /// The moving states at the end of the window from all at its start; the constants of the sensors stay and are not told.
    #[must_use]
    #[allow(clippy::indexing_slicing)] // constant block offsets within fixed arrays
    pub fn apply(&self, x: &Full) -> Moving {
        let at = |block: usize| [x[block], x[block + 1], x[block + 2]];
        let (accelerometer_bias, gyro_bias) = (at(ACCELEROMETER_BIAS), at(GYRO_BIAS));
        let (scale, misalignment, gyro_scale) =
            (at(ACCELEROMETER_SCALE), at(ACCELEROMETER_MISALIGNMENT), at(GYRO_SCALE));

        let mut turned = [0.0; 3];
        subtract_product(&mut turned, &self.turn, &gyro_bias);
        subtract_product(&mut turned, &self.gyro_scale, &gyro_scale);

        let mut gained = [0.0; 3];
        subtract_product(&mut gained, &self.turn, &accelerometer_bias);
        add_product(&mut gained, &self.velocity_from_gyro_bias, &gyro_bias);
        subtract_product(&mut gained, &self.scale, &scale);
        add_product(&mut gained, &self.misalignment, &misalignment);
        add_product(&mut gained, &self.velocity_from_gyro_scale, &gyro_scale);
        self.moved(x, gained, turned)
    }

    /// [`Transition::apply`] to errors of the moving states alone, with perfect sensors.
    #[must_use]
    pub fn apply_moving(&self, x: &Full) -> Moving {
        self.moved(x, [0.0; 3], [0.0; 3])
    }

    /// What the moving states become, given what velocity and attitude get from the sensors.
    #[inline(always)]
    #[allow(clippy::indexing_slicing)] // constant block offsets within fixed arrays
    fn moved(&self, x: &Full, mut gained: [f64; 3], turned: [f64; 3]) -> Moving {
        let at = |block: usize| [x[block], x[block + 1], x[block + 2]];
        let (r, v, phi) = (at(POSITION), at(VELOCITY), at(ATTITUDE));
        let ([ux, uy, uz], [px, py, pz]) = (self.velocity_increment, phi);
        let lifted = [py * uz - pz * uy, pz * ux - px * uz, px * uy - py * ux];
        for (sum, part) in gained.iter_mut().zip(lifted) {
            *sum += part;
        }
        add_product(&mut gained, &self.gravity, &r);

        let mut out: Moving = [0.0; MOVING];
        let t = self.elapsed_s;
        for k in 0..3 {
            out[POSITION + k] = r[k] + t * (v[k] + 0.5 * gained[k]);
            out[VELOCITY + k] = v[k] + gained[k];
            out[ATTITUDE + k] = phi[k] + turned[k];
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Inertial, Rot};
    use crate::nav::filter::layout::ALL;
    use crate::nav::strapdown::Strapdown;
    use crate::planet::MARS;

    const DT: f64 = 0.02;
    const FRAMES: u32 = 5;

    fn start() -> Nominal {
        Nominal {
            r_i: Vec3::new(2.0e6, -1.5e6, 2.3e6),
            v_i: Vec3::new(3000.0, 1000.0, -2000.0),
            attitude_bi: Rot::from_quaternion([0.5, -0.3, 0.7, 0.2]).unwrap(),
        }
    }

    fn increments(k: u32) -> Increments {
        let s = 1.0 + 0.002 * f64::from(k);
        Increments { delta_v_b: Vec3::new(-1.6 * s, 0.1, 0.3), delta_theta_b: Vec3::new(7e-3, -1e-3 * s, 2e-3) }
    }

    /// What the sensors would have given with an error of `x` taken out: see the module's error equations.
    fn corrected(k: u32, x: &Full) -> Increments {
        let i = increments(k);
        let part = |at: usize| Vec3::<Body>::new(x[at], x[at + 1], x[at + 2]);
        let scaled = |v: &Vec3<Body>, at: usize| Vec3::<Body>::new(v.x() * x[at], v.y() * x[at + 1], v.z() * x[at + 2]);
        Increments {
            delta_v_b: i.delta_v_b - part(ACCELEROMETER_BIAS) * DT - scaled(&i.delta_v_b, ACCELEROMETER_SCALE)
                + i.delta_v_b.cross(&part(ACCELEROMETER_MISALIGNMENT)),
            delta_theta_b: i.delta_theta_b - part(GYRO_BIAS) * DT - scaled(&i.delta_theta_b, GYRO_SCALE),
        }
    }

    fn flown(x: &Full) -> (Nominal, Transition) {
        let mut state = start();
        state.r_i += Vec3::new(x[0], x[1], x[2]);
        state.v_i += Vec3::new(x[3], x[4], x[5]);
        let tilt = nalgebra::Vector3::new(x[6], x[7], x[8]);
        state.attitude_bi = state.attitude_bi.then(&Rot::<Inertial, Inertial>::from_rotation_vector(&tilt));
        let (mut strapdown, mut transition) = (Strapdown::new(), Transition::default());
        for k in 0..FRAMES {
            let before = state;
            let increments = corrected(k, x);
            let record = strapdown.advance(&mut state, &increments, DT, &MARS);
            let frame = FrameStep {
                before: &before,
                after: &state,
                increments: &increments,
                record: &record,
                density_decay: 0.99,
                dt_s: DT,
            };
            transition.accumulate(&frame, &MARS);
        }
        (state, transition)
    }

    #[test]
    fn every_block_is_the_derivative_of_the_strapdown() {
        let (_, transition) = flown(&[0.0; ALL]);
        let window = DT * f64::from(FRAMES);
        // Steps that stay linear and far above rounding: 100 m, 1 m/s, 1 mrad, 0.01 m/s², 1e-4 rad/s, 1e-3.
        let steps = [(0, 100.0), (3, 1.0), (6, 1e-3), (10, 0.01), (13, 1e-4), (16, 1e-3), (19, 1e-3), (22, 1e-3)];
        for (block, step) in steps {
            for axis in 0..3 {
                let mut x: Full = [0.0; ALL];
                x[block + axis] = step;
                let plus = flown(&x).0;
                x[block + axis] = -step;
                let minus = flown(&x).0;
                let dr = (plus.r_i - minus.r_i) * 0.5;
                let dv = (plus.v_i - minus.v_i) * 0.5;
                let plus_turn = minus.attitude_bi.inverse().then(&plus.attitude_bi).rotation_vector() * 0.5;
                x[block + axis] = step;
                let predicted = transition.apply(&x);
                let close = |at: usize, v: [f64; 3], tolerance: f64| {
                    (0..3).for_each(|k| {
                        let miss = (predicted[at + k] - v[k]).abs();
                        assert!(miss <= tolerance, "block {block}+{axis} → {}: {} {}", at + k, predicted[at + k], v[k]);
                    });
                };
                let gained = dv - if block == VELOCITY { Vec3::new(x[3], x[4], x[5]) } else { Vec3::zero() };
                // 0.3 %: the attitude of a frame is taken at its middle, the specific force changes over the window.
                // The gravity that a velocity error meets within the window, T²/2·G, is left out: up to 7e-9.
                let floor = 1e-8 * step;
                close(VELOCITY, dv.to_array(), 3e-3 * gained.norm() + floor);
                close(ATTITUDE, plus_turn.into(), 3e-3 * plus_turn.dot(&plus_turn).sqrt() + floor);
                // The even spread over the window is coarse only for what acts on the velocity through the attitude.
                let spread = if block == GYRO_BIAS || block == GYRO_SCALE { 0.2 } else { 0.02 };
                close(POSITION, dr.to_array(), spread * window * gained.norm() + 1e-7 * step);
            }
        }
    }

    #[test]
    fn density_decays() {
        let mut x: Full = [0.0; ALL];
        x[LOG_DENSITY] = 1.0;
        let out = flown(&[0.0; ALL]).1.apply(&x);
        assert!((out[LOG_DENSITY] - 0.99f64.powi(5)).abs() < 1e-15);
    }
}
