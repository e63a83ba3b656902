//! [`InertialBound`]: the posterior Cramér–Rao bound of inertial navigation along a true flight: what the best filter could
//! know that integrates its inertial unit and takes in radio and pressure, with every error of the sensors unknown.
//!
//! The equations of the errors are linear to all intents, so the bound is the covariance of the optimal filter of all
//! twenty-seven errors, linearised about the truth (Tichavský 1998 with the information inverted). Nothing of it comes from the
//! flight software's filter: the transition is made here from true positions, velocities and attitudes, densely, and no
//! state is merely considered. The air's prior is the filter's: a Gauss–Markov process of the altitude flown.

use fsw_core::link::parameters::{InitialKnowledge, NavigationParameters};
use fsw_core::model::gravity;
use fsw_core::planet::Planet;
use nalgebra::{Matrix3, SMatrix, SVector, UnitQuaternion, Vector3};

/// Errors: position, velocity, attitude (inertial axes); accelerometer bias, gyro bias; log-density; accelerometer scale and
/// misalignment, gyro scale (body axes); scale and offset of the pressure.
pub const ERRORS: usize = 27;
const VELOCITY: usize = 3;
const ATTITUDE: usize = 6;
const ACCELEROMETER_BIAS: usize = 9;
const GYRO_BIAS: usize = 12;
const LOG_DENSITY: usize = 15;
const ACCELEROMETER_SCALE: usize = 16;
const MISALIGNMENT: usize = 19;
const GYRO_SCALE: usize = 22;
const PRESSURE_SCALE: usize = 25;
const PRESSURE_OFFSET: usize = 26;

type Square = SMatrix<f64, ERRORS, ERRORS>;

/// A true state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instant {
    /// Time, s.
    pub time_s: f64,
    /// Inertial position, m.
    pub position_m: Vector3<f64>,
    /// Inertial velocity, m/s.
    pub velocity_mps: Vector3<f64>,
    /// Body → inertial.
    pub attitude: UnitQuaternion<f64>,
}

/// A measurement: derivatives of what is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// By position, 1/m.
    pub position: [f64; 3],
    /// By velocity, s/m.
    pub velocity: [f64; 3],
    /// By the log-density, and by the scale of the pressure; its offset counts 1 where this is not zero.
    pub pressure: f64,
}

/// The bound along a flight.
#[derive(Clone, Debug)]
pub struct InertialBound {
    covariance: Square,
    parameters: NavigationParameters,
    planet: Planet,
}

impl InertialBound {
    /// Before the first measurement.
    #[must_use]
    pub fn new(knowledge: &InitialKnowledge, parameters: &NavigationParameters, planet: &Planet) -> Self {
        let mut covariance = Square::zeros();
        let p = parameters;
        for (first, count, sigma) in [
            (0, 3, knowledge.position_sigma_m),
            (VELOCITY, 3, knowledge.velocity_sigma_mps),
            (ATTITUDE, 3, knowledge.attitude_sigma_rad),
            (ACCELEROMETER_BIAS, 3, p.accelerometer_bias_sigma_mps2),
            (GYRO_BIAS, 3, p.gyro_bias_sigma_radps),
            (LOG_DENSITY, 1, p.log_density_sigma),
            (ACCELEROMETER_SCALE, 3, p.accelerometer_scale_sigma),
            (MISALIGNMENT, 3, p.accelerometer_misalignment_sigma_rad),
            (GYRO_SCALE, 3, p.gyro_scale_sigma),
            (PRESSURE_SCALE, 1, p.pressure_scale_sigma),
            (PRESSURE_OFFSET, 1, p.pressure_offset_sigma_pa),
        ] {
            for i in first..first + count {
                covariance[(i, i)] = sigma * sigma;
            }
        }
        Self { covariance, parameters: *p, planet: *planet }
    }

    /// From one true state to the next, some tenths of a second later at most.
    pub fn advance(&mut self, before: &Instant, after: &Instant) {
        let dt = after.time_s - before.time_s;
        let middle = (before.position_m + after.position_m) * 0.5;
        let array = [middle.x, middle.y, middle.z];
        let g = Vector3::from(gravity::acceleration(&self.planet, &array));
        let gradient = gravity::gradient(&self.planet, &array);
        let force = (after.velocity_mps - before.velocity_mps) / dt - g;
        let half = before.attitude.slerp(&after.attitude, 0.5);
        let c = half.to_rotation_matrix().into_inner();
        let force_b = c.transpose() * force;
        let rate_b = (before.attitude.inverse() * after.attitude).scaled_axis() / dt;

        let mut rates = Square::zeros();
        let mut block = |row: usize, column: usize, m: Matrix3<f64>| {
            rates.fixed_view_mut::<3, 3>(row, column).copy_from(&m);
        };
        block(0, VELOCITY, Matrix3::identity());
        block(VELOCITY, 0, gradient);
        block(VELOCITY, ATTITUDE, -force.cross_matrix());
        block(VELOCITY, ACCELEROMETER_BIAS, -c);
        block(VELOCITY, ACCELEROMETER_SCALE, -c * Matrix3::from_diagonal(&force_b));
        block(VELOCITY, MISALIGNMENT, c * force_b.cross_matrix());
        block(ATTITUDE, GYRO_BIAS, -c);
        block(ATTITUDE, GYRO_SCALE, -c * Matrix3::from_diagonal(&rate_b));
        // Three terms of the exponential: the fourth is (dt·0.03/s)³ of what it changes.
        let small = rates * dt;
        let mut phi = Square::identity() + small + small * small * 0.5 + small * small * small / 6.0;
        let climb = (after.position_m.norm() - before.position_m.norm()).abs();
        let decay = (-climb / self.parameters.log_density_length_m).exp();
        phi[(LOG_DENSITY, LOG_DENSITY)] = decay;

        let mut next = phi * self.covariance * phi.transpose();
        let p = &self.parameters;
        let (velocity, attitude) = (p.accelerometer_noise.powi(2) * dt, p.gyro_noise.powi(2) * dt);
        for k in 0..3 {
            next[(VELOCITY + k, VELOCITY + k)] += velocity;
            next[(ATTITUDE + k, ATTITUDE + k)] += attitude;
        }
        next[(LOG_DENSITY, LOG_DENSITY)] += p.log_density_sigma.powi(2) * (1.0 - decay * decay);
        self.covariance = (next + next.transpose()) * 0.5;
    }

    /// A measurement with white noise of this variance.
    pub fn inform(&mut self, row: &Row, variance: f64) {
        let mut h = SVector::<f64, ERRORS>::zeros();
        h.fixed_rows_mut::<3>(0).copy_from_slice(&row.position);
        h.fixed_rows_mut::<3>(VELOCITY).copy_from_slice(&row.velocity);
        if row.pressure != 0.0 {
            (h[LOG_DENSITY], h[PRESSURE_SCALE], h[PRESSURE_OFFSET]) = (row.pressure, row.pressure, 1.0);
        }
        let u = self.covariance * h;
        let s = h.dot(&u) + variance;
        self.covariance -= u * u.transpose() / s;
    }

    /// Least covariance of the position (m²) and of the velocity ((m/s)²), inertial axes.
    #[must_use]
    pub fn covariances(&self) -> [Matrix3<f64>; 2] {
        [0, VELOCITY].map(|first| self.covariance.fixed_view::<3, 3>(first, first).into_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::config::Config;
    use fsw_core::planet::MARS;

    fn fall(seconds: u32) -> InertialBound {
        let c = Config::DEFAULT;
        let mut bound = InertialBound::new(&c.initial_knowledge, &c.navigation, &MARS);
        let at = |k: u32| Instant {
            time_s: 0.1 * f64::from(k),
            position_m: Vector3::new(3.5e6, 300.0 * f64::from(k), 0.0),
            velocity_mps: Vector3::new(0.0, 3000.0, 0.0),
            attitude: UnitQuaternion::identity(),
        };
        (0..10 * seconds).for_each(|k| bound.advance(&at(k), &at(k + 1)));
        bound
    }

    #[test]
    fn without_measurements_the_errors_grow_as_those_of_a_bias_and_a_velocity() {
        let c = Config::DEFAULT;
        let [position, velocity] = fall(20).covariances().map(|least| least.trace());
        let (bias, speed) = (c.navigation.accelerometer_bias_sigma_mps2, c.initial_knowledge.velocity_sigma_mps);
        // Per axis; scale and misalignment of 4 m/s² of level flight add a percent, the gravity gradient less.
        let expected = speed.powi(2) + (20.0 * bias).powi(2);
        assert!((velocity / 3.0 / expected - 1.0).abs() < 0.05, "{velocity} {expected}");
        let expected = 500f64.powi(2) + (20.0 * speed).powi(2) + (200.0 * bias).powi(2);
        assert!((position / 3.0 / expected - 1.0).abs() < 0.01, "{position} {expected}");
    }

    #[test]
    fn a_reading_removes_what_it_tells() {
        let mut bound = fall(1);
        let [before, _] = bound.covariances().map(|least| least.trace());
        bound.inform(&Row { position: [1.0, 0.0, 0.0], ..Row::default() }, 1.0);
        let [after, _] = bound.covariances().map(|least| least.trace());
        assert!((before - after - 500f64.powi(2)).abs() < 2.0, "{before} {after}");
    }
}
