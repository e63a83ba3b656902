//! Radio sources: orbiters on perturbed two-body orbits, beacons on the turning surface.

use fsw_core::frames::{Inertial, Vec3, surface_point};
use fsw_core::planet::Planet;
use libm::{cos, sin};

use crate::dynamics::{gravity, surface_velocity};

/// Classical orbital elements at the entry epoch, in the inertial axes (the planet-fixed axes at t = 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elements {
    /// Semi-major axis, m.
    pub semi_major_axis_m: f64,
    /// Eccentricity, in [0, 1).
    pub eccentricity: f64,
    /// Inclination, rad.
    pub inclination_rad: f64,
    /// Right ascension of the ascending node, rad.
    pub raan_rad: f64,
    /// Argument of periapsis, rad.
    pub arg_periapsis_rad: f64,
    /// True anomaly, rad.
    pub true_anomaly_rad: f64,
}

/// Inertial position and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position, m.
    pub r_i: Vec3<Inertial>,
    /// Velocity, m/s.
    pub v_i: Vec3<Inertial>,
}

/// A radio source as it really moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Source {
    /// An orbiter, by its state at t = 0.
    Orbiter(State),
    /// A beacon fixed to the surface.
    Beacon {
        /// Longitude, rad.
        longitude_rad: f64,
        /// Planetocentric latitude, rad.
        latitude_rad: f64,
        /// Altitude over the reference sphere, m.
        altitude_m: f64,
    },
}

impl Elements {
    /// Position and velocity at the epoch.
    #[must_use]
    pub fn state(&self, planet: &Planet) -> State {
        let p = self.semi_major_axis_m * (1.0 - self.eccentricity * self.eccentricity);
        let (sin_nu, cos_nu) = (sin(self.true_anomaly_rad), cos(self.true_anomaly_rad));
        let radius = p / (1.0 + self.eccentricity * cos_nu);
        let speed = (planet.mu_m3ps2 / p).sqrt();
        // Perifocal axes: towards periapsis and a quarter turn ahead of it.
        let (sin_w, cos_w) = (sin(self.arg_periapsis_rad), cos(self.arg_periapsis_rad));
        let (sin_n, cos_n) = (sin(self.raan_rad), cos(self.raan_rad));
        let (sin_i, cos_i) = (sin(self.inclination_rad), cos(self.inclination_rad));
        let periapsis = Vec3::<Inertial>::new(
            cos_n * cos_w - sin_n * sin_w * cos_i,
            sin_n * cos_w + cos_n * sin_w * cos_i,
            sin_w * sin_i,
        );
        let ahead = Vec3::<Inertial>::new(
            -cos_n * sin_w - sin_n * cos_w * cos_i,
            -sin_n * sin_w + cos_n * cos_w * cos_i,
            cos_w * sin_i,
        );
        State {
            r_i: periapsis * (radius * cos_nu) + ahead * (radius * sin_nu),
            v_i: periapsis * (-speed * sin_nu) + ahead * (speed * (self.eccentricity + cos_nu)),
        }
    }
}

/// Longest step of the orbit integration, s; its error is below a micrometre over an entry.
const ORBIT_STEP_S: f64 = 1.0;

impl State {
    /// The state `duration_s` later under central gravity and J2.
    #[must_use]
    pub fn after(&self, duration_s: f64, planet: &Planet) -> Self {
        let steps = (duration_s.abs() / ORBIT_STEP_S).ceil().max(1.0);
        let h = duration_s / steps;
        (0..steps as u64).fold(*self, |state, _| state.step(h, planet))
    }

    /// One step of Runge–Kutta–Nyström of fourth order (the acceleration does not depend on velocity).
    fn step(&self, h: f64, planet: &Planet) -> Self {
        let (r, v) = (self.r_i, self.v_i);
        let a1 = gravity(&r, planet);
        let a2 = gravity(&(r + v * (0.5 * h) + a1 * (h * h / 8.0)), planet);
        let a3 = gravity(&(r + v * h + a2 * (0.5 * h * h)), planet);
        Self { r_i: r + v * h + (a1 + a2 * 2.0) * (h * h / 6.0), v_i: v + (a1 + a2 * 4.0 + a3) * (h / 6.0) }
    }
}

impl Source {
    /// State at a time after the epoch, going on from a state already known at an earlier time.
    #[must_use]
    pub fn state_at(&self, t_s: f64, known: Option<(f64, State)>, planet: &Planet) -> State {
        match self {
            Self::Orbiter(epoch) => {
                let (since, state) = known.unwrap_or((0.0, *epoch));
                state.after(t_s - since, planet)
            }
            Self::Beacon { longitude_rad, latitude_rad, altitude_m } => {
                let point = surface_point(longitude_rad + planet.rotation_radps * t_s, *latitude_rad);
                let r_i = Vec3::from_components(*point.components()) * (planet.radius_m + altitude_m);
                State { r_i, v_i: surface_velocity(&r_i, planet) }
            }
        }
    }
}

/// Geometric range, m, and range-rate, m/s, between two moving points.
#[must_use]
pub fn range_and_rate(a: &State, b: &State) -> (f64, f64) {
    let (dr, dv) = (b.r_i - a.r_i, b.v_i - a.v_i);
    let range = dr.norm();
    (range, if range > 0.0 { dr.dot(&dv) / range } else { 0.0 })
}

/// Elevation of the higher of two points above the horizontal plane of the lower one, rad.
#[must_use]
pub fn elevation_rad(a: &Vec3<Inertial>, b: &Vec3<Inertial>) -> f64 {
    let (low, high) = if a.dot(a) <= b.dot(b) { (a, b) } else { (b, a) };
    let sight = *high - *low;
    let sine = sight.dot(low) / (sight.norm() * low.norm());
    libm::asin(sine.clamp(-1.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::planet::MARS;
    use fsw_core::units::rad;

    fn default_orbiter() -> State {
        let elements = Elements {
            semi_major_axis_m: 3.7e6,
            eccentricity: 0.0,
            inclination_rad: rad(80.4),
            raan_rad: rad(96.8),
            arg_periapsis_rad: 0.0,
            true_anomaly_rad: rad(-145.9),
        };
        elements.state(&MARS)
    }

    fn energy(s: &State, planet: &Planet) -> f64 {
        let (r2, z) = (s.r_i.dot(&s.r_i), s.r_i.z());
        let r = r2.sqrt();
        let oblate = 0.5 * planet.j2 * planet.radius_m * planet.radius_m / r2 * (3.0 * z * z / r2 - 1.0);
        0.5 * s.v_i.dot(&s.v_i) - planet.mu_m3ps2 / r * (1.0 - oblate)
    }

    #[test]
    fn elements_give_the_radius_speed_and_inclination_they_name() {
        let s = default_orbiter();
        assert!((s.r_i.norm() - 3.7e6).abs() < 1e-6);
        assert!((s.v_i.norm() - (MARS.mu_m3ps2 / 3.7e6f64).sqrt()).abs() < 1e-9);
        let h = s.r_i.cross(&s.v_i);
        assert!((h.z() / h.norm() - rad(80.4).cos()).abs() < 1e-12);
        assert!((s.r_i.z() - 3.7e6 * rad(80.4).sin() * rad(-145.9).sin()).abs() < 1e-6);
    }

    #[test]
    fn an_orbit_keeps_its_energy_and_axial_angular_momentum() {
        let (s, t) = (default_orbiter(), default_orbiter().after(600.0, &MARS));
        assert!((energy(&t, &MARS) / energy(&s, &MARS) - 1.0).abs() < 1e-13);
        assert!((t.r_i.cross(&t.v_i).z() / s.r_i.cross(&s.v_i).z() - 1.0).abs() < 1e-13);
    }

    #[test]
    fn the_orbit_has_converged_in_its_step() {
        let coarse = default_orbiter().after(600.0, &MARS);
        let fine = (0..6000).fold(default_orbiter(), |s, _| s.after(0.1, &MARS));
        assert!((coarse.r_i - fine.r_i).norm() < 1e-5, "{}", (coarse.r_i - fine.r_i).norm());
    }

    #[test]
    fn without_j2_the_orbit_is_keplerian_and_j2_moves_it_by_the_known_amount() {
        let round = Planet { j2: 0.0, ..MARS };
        let s = default_orbiter();
        let period = 2.0 * core::f64::consts::PI * (3.7e6f64.powi(3) / MARS.mu_m3ps2).sqrt();
        let again = s.after(period, &round);
        assert!((again.r_i - s.r_i).norm() < 1e-3);
        // The specification: two-body is 400 m and 2.5 m/s off after 324 s.
        let (a, b) = (s.after(324.0, &MARS), s.after(324.0, &round));
        assert!(((a.r_i - b.r_i).norm() - 400.0).abs() < 60.0, "{}", (a.r_i - b.r_i).norm());
        assert!(((a.v_i - b.v_i).norm() - 2.5).abs() < 0.4, "{}", (a.v_i - b.v_i).norm());
    }

    #[test]
    fn range_rate_is_the_derivative_of_range() {
        let orbiter = Source::Orbiter(default_orbiter());
        let beacon = Source::Beacon { longitude_rad: rad(-73.0), latitude_rad: rad(-41.0), altitude_m: 0.0 };
        let range = |t: f64| range_and_rate(&beacon.state_at(t, None, &MARS), &orbiter.state_at(t, None, &MARS));
        // Central difference over ±0.1 s: its error is h²/6 of the third derivative, far below 1e-3 m/s.
        let difference = (range(100.1).0 - range(99.9).0) / 0.2;
        assert!((difference - range(100.0).1).abs() < 1e-3, "{difference} {}", range(100.0).1);
    }

    #[test]
    fn elevation_is_seen_from_the_lower_end() {
        let ground = Vec3::<Inertial>::new(3.4e6, 0.0, 0.0);
        let above = Vec3::<Inertial>::new(3.41e6, 0.0, 0.0);
        let far = Vec3::<Inertial>::new(3.4e6 + 5e3, 5e3, 0.0);
        assert!((elevation_rad(&ground, &above) - rad(90.0)).abs() < 1e-7);
        assert!((elevation_rad(&far, &ground) - rad(45.0)).abs() < 1e-9);
    }
}
