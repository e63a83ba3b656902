//! [`Estimate`]: what navigation tells guidance, control and fault protection, and how it follows from a nominal state.

use crate::frames::{Body, Inertial, PlanetFixed, Rot, Vec3, bank_from_attitude, planet_relative_from_inertial};
use crate::math::fun::asin;
use crate::math::num::clamp;
use crate::planet::Planet;
use crate::time::MissionTime;

/// The navigated state at one instant. When `valid` is false the numbers are the last propagated ones: finite, but not
/// to be steered by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Instant of the state.
    pub time: MissionTime,
    /// Inertial position, m.
    pub r_i: Vec3<Inertial>,
    /// Inertial velocity, m/s.
    pub v_i: Vec3<Inertial>,
    /// Attitude, body → inertial.
    pub attitude_bi: Rot<Body, Inertial>,
    /// Planet-fixed position, m.
    pub r_p: Vec3<PlanetFixed>,
    /// Velocity relative to the rotating planet, planet-fixed axes, m/s.
    pub v_p: Vec3<PlanetFixed>,
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Planet-relative flight-path angle, rad, positive up.
    pub flight_path_angle_rad: f64,
    /// Specific force in body axes, mean over the last frame, compensated, m/s².
    pub specific_force_b: Vec3<Body>,
    /// Bank angle about the planet-relative velocity, rad; see [`bank_from_attitude`].
    pub bank_rad: f64,
    /// Bank rate about the planet-relative velocity, rad/s.
    pub bank_rate_radps: f64,
    /// Natural logarithm of density over that of the onboard model.
    pub log_density: f64,
    /// Its standard deviation; that of the parameters where nothing measures it.
    pub log_density_sigma: f64,
    /// True when the estimate may be steered by.
    pub valid: bool,
}

impl Default for Estimate {
    fn default() -> Self {
        Self::none()
    }
}

impl Estimate {
    /// No estimate.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            time: MissionTime::ZERO,
            r_i: Vec3::zero(),
            v_i: Vec3::zero(),
            attitude_bi: Rot::identity(),
            r_p: Vec3::zero(),
            v_p: Vec3::zero(),
            altitude_m: 0.0,
            speed_mps: 0.0,
            flight_path_angle_rad: 0.0,
            specific_force_b: Vec3::zero(),
            bank_rad: 0.0,
            bank_rate_radps: 0.0,
            log_density: 0.0,
            log_density_sigma: 0.0,
            valid: false,
        }
    }
}

impl Estimate {
    /// Sets position and velocity and everything that follows from them alone.
    pub(super) fn set_trajectory(
        &mut self,
        time: MissionTime,
        r_i: &Vec3<Inertial>,
        v_i: &Vec3<Inertial>,
        planet: &Planet,
    ) {
        let (r_p, v_p) = planet_relative_from_inertial(r_i, v_i, time, planet.rotation_radps);
        let (radius, speed) = (r_p.norm(), v_p.norm());
        self.time = time;
        self.r_i = *r_i;
        self.v_i = *v_i;
        self.r_p = r_p;
        self.v_p = v_p;
        self.altitude_m = radius - planet.radius_m;
        self.speed_mps = speed;
        let product = radius * speed;
        self.flight_path_angle_rad = if product > 0.0 { asin(clamp(r_p.dot(&v_p) / product, -1.0, 1.0)) } else { 0.0 };
    }

    /// Sets bank angle and bank rate from attitude and body rate; keeps the old ones where they are undefined.
    ///
    /// `omega_b` is the body rate (rad/s, inertial, body axes) and `acceleration_i` the inertial acceleration (m/s²).
    pub(super) fn set_bank(&mut self, omega_b: &Vec3<Body>, acceleration_i: &Vec3<Inertial>, planet: &Planet) {
        let spin = Vec3::<Inertial>::new(0.0, 0.0, planet.rotation_radps);
        let v_rel = self.v_i - spin.cross(&self.r_i);
        let a_rel = *acceleration_i - spin.cross(&self.v_i);
        if let Some(bank_rad) = bank_from_attitude(&self.attitude_bi, &self.r_i, &v_rel) {
            self.bank_rad = bank_rad;
        }
        if let Some(plane_rate) = vertical_plane_rate(&self.r_i, &self.v_i, &v_rel, &a_rel) {
            let along = self.attitude_bi.apply(omega_b).dot(&v_rel) / v_rel.norm();
            self.bank_rate_radps = along - plane_rate;
        }
    }
}

/// Rate (rad/s) at which the plane of position and velocity `v_rel`, from which bank is counted, turns about the velocity.
///
/// With u the direction of `v_rel`, n the part of r normal to u, and right = u × n/|n|: rate = d(n/|n|)/dt · right,
/// where d(n)/dt · right = (v_i − a_rel (u·r)/|v_rel|) · right; the terms along n and u vanish.
fn vertical_plane_rate(
    r: &Vec3<Inertial>,
    v_i: &Vec3<Inertial>,
    v_rel: &Vec3<Inertial>,
    a_rel: &Vec3<Inertial>,
) -> Option<f64> {
    let u = v_rel.unit()?;
    let along = u.dot(r);
    let normal = *r - u * along;
    let right = u.cross(&normal.unit()?);
    Some((*v_i - *a_rel * (along / v_rel.norm())).dot(&right) / normal.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::inertial_from_planet_relative;
    use crate::planet::MARS;

    /// Attitude at a bank angle and trim angle zero: nose along the planet-relative velocity.
    fn attitude(r: &Vec3<Inertial>, v: &Vec3<Inertial>, bank: f64) -> Rot<Body, Inertial> {
        let forward = (*v - Vec3::new(0.0, 0.0, MARS.rotation_radps).cross(r)).unit().unwrap();
        let up = (*r - forward * forward.dot(r)).unit().unwrap();
        let right = forward.cross(&up);
        let y = right * bank.cos() - up * bank.sin();
        Rot::from_columns(&forward, &y, &forward.cross(&y)).unwrap()
    }

    #[test]
    fn bank_rate_is_the_derivative_of_bank() {
        // A curved path: gravity plus 30 m/s² to the side; bank turns at 0.2 rad/s. Central difference over 2 ms.
        let (r0, v0) = inertial_from_planet_relative(
            &Vec3::new(2.0e6, -1.0e6, 2.5e6),
            &Vec3::new(1500.0, 3000.0, -900.0),
            MissionTime::ZERO,
            MARS.rotation_radps,
        );
        let a = Vec3::new(30.0, -12.0, 9.0);
        let at = |t: f64| (r0 + v0 * t + a * (0.5 * t * t), v0 + a * t);
        let bank = |t: f64| 0.6 + 0.2 * t;
        let h = 1e-3;
        let [before, after] = [-h, h].map(|t| attitude(&at(t).0, &at(t).1, bank(t)));
        // Turn from after to before, body axes: the rotation vector is the body's turn.
        let turn = after.then(&before.inverse()).rotation_vector();
        let mut e = Estimate::default();
        e.set_trajectory(MissionTime::ZERO, &r0, &v0, &MARS);
        e.attitude_bi = attitude(&r0, &v0, bank(0.0));
        e.set_bank(&(Vec3::from_components(turn) * (0.5 / h)), &a, &MARS);
        assert!((e.bank_rad - 0.6).abs() < 1e-12);
        // The second difference of the path leaves about 1e-9.
        assert!((e.bank_rate_radps - 0.2).abs() < 1e-7, "{}", e.bank_rate_radps);
    }

    #[test]
    fn the_path_angle_is_negative_on_the_way_down() {
        let mut e = Estimate::default();
        e.set_trajectory(
            MissionTime::ZERO,
            &Vec3::new(MARS.radius_m + 5e4, 0.0, 0.0),
            &Vec3::new(-300.0, 1e3, 0.0),
            &MARS,
        );
        assert!(e.flight_path_angle_rad < -0.2 && (e.altitude_m - 5e4).abs() < 1e-6);
    }
}
