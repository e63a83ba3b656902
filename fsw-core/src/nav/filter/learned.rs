//! [`Learned`]: what the filter has found of sensors and air, and how a correction is added to it and to the strapdown solution.

use super::layout::{
    ACCELEROMETER_BIAS, ACCELEROMETER_MISALIGNMENT, ACCELEROMETER_SCALE, ATTITUDE, AXES, Full, GYRO_BIAS, GYRO_SCALE,
    LOG_DENSITY, POSITION, PRESSURE_OFFSET, PRESSURE_SCALE, VELOCITY,
};
use crate::frames::{Body, Inertial, Rot, Vec3};
use crate::nav::strapdown::{Increments, Nominal};

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

/// Adds an error to the nominal state and to what has been learned.
pub(super) fn inject(error: &Full, nominal: &mut Nominal, learned: &mut Learned) {
    nominal.r_i += Vec3::from_array(block(error, POSITION));
    nominal.v_i += Vec3::from_array(block(error, VELOCITY));
    let tilt = Vec3::<Inertial>::from_array(block(error, ATTITUDE));
    let tilt = Rot::<Inertial, Inertial>::from_rotation_vector(tilt.components());
    nominal.attitude_bi = nominal.attitude_bi.then(&tilt).normalised();
    learned.add(error);
}
