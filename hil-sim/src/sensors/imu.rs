//! Inertial measurement unit: velocity and angle increments over a minor frame, as integer counts.

use fsw_core::frames::{Body, Vec3};
use fsw_core::link::packet::{DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS, Imu};

use crate::noise::Stream;

/// Errors of the unit in one flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuErrors {
    /// Accelerometer bias, body axes, m/s².
    pub accelerometer_bias_mps2: [f64; 3],
    /// Accelerometer scale error per axis, fraction.
    pub accelerometer_scale: [f64; 3],
    /// Small rotation of the accelerometer triad against the body axes, rad.
    pub accelerometer_misalignment_rad: [f64; 3],
    /// Accelerometer white noise, (m/s²)/√Hz.
    pub accelerometer_noise: f64,
    /// Range of an accelerometer axis, m/s².
    pub accelerometer_limit_mps2: f64,
    /// Gyro bias, body axes, rad/s.
    pub gyro_bias_radps: [f64; 3],
    /// Gyro scale error per axis, fraction.
    pub gyro_scale: [f64; 3],
    /// Angle random walk, rad/√s.
    pub gyro_noise: f64,
    /// Range of a gyro axis, rad/s.
    pub gyro_limit_radps: f64,
}

impl ImuErrors {
    /// A perfect unit that never saturates (but still counts in integers).
    pub const PERFECT: Self = Self {
        accelerometer_bias_mps2: [0.0; 3],
        accelerometer_scale: [0.0; 3],
        accelerometer_misalignment_rad: [0.0; 3],
        accelerometer_noise: 0.0,
        accelerometer_limit_mps2: f64::INFINITY,
        gyro_bias_radps: [0.0; 3],
        gyro_scale: [0.0; 3],
        gyro_noise: 0.0,
        gyro_limit_radps: f64::INFINITY,
    };
}

/// The unit: its errors, its noise and what the last count left over.
#[derive(Clone, Debug)]
pub struct ImuSensor {
    errors: ImuErrors,
    noise: Stream,
    velocity: Counter,
    angle: Counter,
}

impl ImuSensor {
    /// A unit with the errors of one flight.
    #[must_use]
    pub fn new(errors: ImuErrors, noise: Stream) -> Self {
        Self { errors, noise, velocity: Counter::new(DELTA_V_LSB_MPS), angle: Counter::new(DELTA_THETA_LSB_RAD) }
    }

    /// The packet for true increments over a frame of `frame_s`.
    pub fn measure(&mut self, delta_v_b: &Vec3<Body>, delta_theta_b: &Vec3<Body>, frame_s: f64) -> Imu {
        let e = &self.errors;
        let root = frame_s.sqrt();
        // Components along axes turned by a small angle μ: f − μ × f.
        let turned = *delta_v_b - Vec3::from_array(e.accelerometer_misalignment_rad).cross(delta_v_b);
        let error = |x: f64, scale: f64, bias: f64, noise: f64| x * (1.0 + scale) + bias * frame_s + noise * root;
        let mut delta_v = turned.to_array();
        let mut delta_theta = delta_theta_b.to_array();
        for axis in 0..3 {
            let (a, g) = (e.accelerometer_noise * self.noise.normal(), e.gyro_noise * self.noise.normal());
            delta_v[axis] = error(delta_v[axis], e.accelerometer_scale[axis], e.accelerometer_bias_mps2[axis], a);
            delta_theta[axis] = error(delta_theta[axis], e.gyro_scale[axis], e.gyro_bias_radps[axis], g);
        }
        let (delta_v_counts, v_saturated) = self.velocity.count(delta_v, e.accelerometer_limit_mps2 * frame_s);
        let (delta_theta_counts, theta_saturated) = self.angle.count(delta_theta, e.gyro_limit_radps * frame_s);
        let status =
            u8::from(v_saturated) * Imu::ACCELEROMETER_SATURATED + u8::from(theta_saturated) * Imu::GYRO_SATURATED;
        Imu { delta_v_counts, delta_theta_counts, status }
    }
}

/// Integer counts of three sums; the remainder is carried over, so that rounding never adds up.
#[derive(Clone, Copy, Debug)]
struct Counter {
    lsb: f64,
    left: [f64; 3],
}

impl Counter {
    fn new(lsb: f64) -> Self {
        Self { lsb, left: [0.0; 3] }
    }

    /// Counts of increments limited to ±`limit`; what lies beyond is lost, as in a real unit, and reported.
    fn count(&mut self, increments: [f64; 3], limit: f64) -> ([i32; 3], bool) {
        let mut saturated = false;
        let mut counts = [0; 3];
        for axis in 0..3 {
            let increment = increments[axis];
            let held = increment.clamp(-limit, limit);
            saturated |= held != increment;
            let exact = held / self.lsb + self.left[axis];
            let whole = libm::round(exact).clamp(f64::from(i32::MIN), f64::from(i32::MAX));
            self.left[axis] = exact - whole;
            counts[axis] = whole as i32;
        }
        (counts, saturated)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(errors: ImuErrors) -> ImuSensor {
        ImuSensor::new(errors, Stream::new(1, 1, "imu noise"))
    }

    #[test]
    fn rounding_to_counts_never_adds_up() {
        let mut imu = unit(ImuErrors::PERFECT);
        let (dv, dth) = (Vec3::new(1.234_567_89e-3, -3.3e-7, 0.0), Vec3::new(1.111_111e-5, -0.4e-8, 7e-3));
        let mut sum = [0i64; 6];
        for k in 1..=1000 {
            let m = imu.measure(&dv, &dth, 0.02);
            for axis in 0..3 {
                sum[axis] += i64::from(m.delta_v_counts[axis]);
                sum[axis + 3] += i64::from(m.delta_theta_counts[axis]);
                let (v, a) = (sum[axis] as f64 * DELTA_V_LSB_MPS, sum[axis + 3] as f64 * DELTA_THETA_LSB_RAD);
                // Half a count, whatever the number of frames.
                assert!((v - dv.to_array()[axis] * f64::from(k)).abs() < 0.51 * DELTA_V_LSB_MPS);
                assert!((a - dth.to_array()[axis] * f64::from(k)).abs() < 0.51 * DELTA_THETA_LSB_RAD);
            }
        }
    }

    #[test]
    fn saturation_clips_and_says_so() {
        let errors = ImuErrors { accelerometer_limit_mps2: 343.0, gyro_limit_radps: 5.2, ..ImuErrors::PERFECT };
        let mut imu = unit(errors);
        assert_eq!(imu.measure(&Vec3::new(6.8, 0.0, 0.0), &Vec3::zero(), 0.02).status, 0);
        let m = imu.measure(&Vec3::new(0.0, -7.0, 0.0), &Vec3::new(0.0, 0.0, 0.2), 0.02);
        assert_eq!(m.status, Imu::ACCELEROMETER_SATURATED | Imu::GYRO_SATURATED);
        assert_eq!((m.delta_v_counts[1], m.delta_theta_counts[2]), (-6_860_000, 10_400_000));
    }

    #[test]
    fn bias_scale_and_misalignment_enter_as_documented() {
        let errors = ImuErrors {
            accelerometer_bias_mps2: [1e-3, 0.0, 0.0],
            accelerometer_scale: [0.0, 1e-4, 0.0],
            accelerometer_misalignment_rad: [0.0, 0.0, 2e-4],
            gyro_bias_radps: [0.0, 5e-6, 0.0],
            gyro_scale: [1e-4, 0.0, 0.0],
            ..ImuErrors::PERFECT
        };
        let m = unit(errors).measure(&Vec3::new(1.0, 2.0, 0.0), &Vec3::new(0.01, 0.0, 0.0), 0.02);
        // x: 1 + 2e-4·2 + 1e-3·0.02; y: (2 − 2e-4·1)(1 + 1e-4).
        assert_eq!(m.delta_v_counts, [1_000_420, 2_000_000 - 200 + 200, 0]);
        assert_eq!(m.delta_theta_counts, [1_000_100, 10, 0]);
    }

    #[test]
    fn white_noise_has_its_density() {
        let errors = ImuErrors { accelerometer_noise: 5e-4, gyro_noise: 2e-5, ..ImuErrors::PERFECT };
        let mut imu = unit(errors);
        let (mut v2, mut a2) = (0.0, 0.0);
        let n = 20_000;
        for _ in 0..n {
            let m = imu.measure(&Vec3::zero(), &Vec3::zero(), 0.02);
            v2 += (f64::from(m.delta_v_counts[0]) * DELTA_V_LSB_MPS).powi(2);
            a2 += (f64::from(m.delta_theta_counts[2]) * DELTA_THETA_LSB_RAD).powi(2);
        }
        // Deviation of an increment over T is density·√T; 20 000 samples give 0.5 %, four of these allowed.
        let root = (0.02 * f64::from(n)).sqrt();
        assert!((v2.sqrt() / root / 5e-4 - 1.0).abs() < 0.02);
        assert!((a2.sqrt() / root / 2e-5 - 1.0).abs() < 0.02);
    }
}
