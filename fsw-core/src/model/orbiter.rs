//! Where the radio sources are: orbiters propagated with J2, beacons carried around by the planet.

use super::gravity;
use crate::frames::{Inertial, PlanetFixed, Vec3, inertial_from_planet_relative, surface_point};
use crate::math::{num, rk4};
use crate::model::parameters::RadioSource;
use crate::planet::Planet;
use crate::time::{Micros, MissionTime};

/// Distance in time between the knots of the propagation. One Runge–Kutta step of it is good to micrometres in low orbit.
pub const KNOT_SPACING: Micros = Micros(10_000_000);
/// Knots that one call may compute: 21 minutes of flight, more than an entry lasts.
pub const MAX_KNOTS_PER_CALL: u32 = 128;

/// Why a source has no position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SourceError {
    /// The slot is empty.
    Empty,
    /// The instant is too far after the last one asked for; asking again goes on from where this call stopped.
    TooFarAhead,
    /// The instant lies before the last knot.
    InThePast,
    /// The orbit has become absurd: a number that is not finite, or a position inside the planet.
    Lost,
}

impl core::fmt::Display for SourceError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Empty => "the source slot is empty",
            Self::TooFarAhead => "the instant is too far ahead of the last one",
            Self::InThePast => "the instant lies before the last knot of the orbit",
            Self::Lost => "the orbit is not finite or inside the planet",
        })
    }
}

impl core::error::Error for SourceError {}

/// An orbiter: its inertial state at the last knot. Its state at an instant depends on that instant alone, not on
/// what was asked before, because a call steps from knot to knot and only then to the instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbiterState {
    knot: MissionTime,
    state: [f64; 6],
}

impl OrbiterState {
    /// An orbiter by its inertial state at t = 0.
    #[must_use]
    pub fn new(position_m: [f64; 3], velocity_mps: [f64; 3]) -> Self {
        let ([x, y, z], [vx, vy, vz]) = (position_m, velocity_mps);
        Self { knot: MissionTime::ZERO, state: [x, y, z, vx, vy, vz] }
    }

    /// Inertial position (m) and velocity (m/s) at `now`, two-body + J2.
    ///
    /// # Errors
    /// `now` lies before the last knot or more than [`MAX_KNOTS_PER_CALL`] knots after it, or the orbit is absurd.
    pub fn at(&mut self, planet: &Planet, now: MissionTime) -> Result<(Vec3<Inertial>, Vec3<Inertial>), SourceError> {
        let mut ahead = now.since(self.knot).ok_or(SourceError::InThePast)?;
        for _ in 0..MAX_KNOTS_PER_CALL {
            if ahead < KNOT_SPACING {
                break;
            }
            self.state = stepped(planet, &self.state, KNOT_SPACING.as_s());
            self.knot = self.knot.plus(KNOT_SPACING);
            ahead = now.since(self.knot).unwrap_or_default();
        }
        if ahead >= KNOT_SPACING {
            return Err(SourceError::TooFarAhead);
        }
        let [x, y, z, vx, vy, vz] = stepped(planet, &self.state, ahead.as_s());
        let (r_i, v_i) = (Vec3::new(x, y, z), Vec3::new(vx, vy, vz));
        let sane = num::all_finite(&[x, y, z, vx, vy, vz]) && r_i.norm() > planet.radius_m;
        if sane { Ok((r_i, v_i)) } else { Err(SourceError::Lost) }
    }
}

/// One Runge–Kutta step of free fall in inertial axes.
fn stepped(planet: &Planet, state: &[f64; 6], step_s: f64) -> [f64; 6] {
    rk4(state, step_s, |_, &[x, y, z, vx, vy, vz]| {
        let [ax, ay, az] = gravity::acceleration(planet, &[x, y, z]);
        [vx, vy, vz, ax, ay, az]
    })
}

/// One radio source, ready to say where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SourceState {
    /// The slot is empty.
    #[default]
    None,
    /// An orbiter.
    Orbiter(OrbiterState),
    /// A beacon fixed to the surface, planet-fixed position in m.
    Beacon(Vec3<PlanetFixed>),
}

impl SourceState {
    /// The state at t = 0 of a source as the parameters describe it.
    #[must_use]
    pub fn new(source: &RadioSource, planet: &Planet) -> Self {
        match *source {
            RadioSource::None => Self::None,
            RadioSource::Orbiter { position_m, velocity_mps } => {
                Self::Orbiter(OrbiterState::new(position_m, velocity_mps))
            }
            RadioSource::Beacon { longitude_rad, latitude_rad, altitude_m } => {
                Self::Beacon(surface_point(longitude_rad, latitude_rad) * (planet.radius_m + altitude_m))
            }
        }
    }

    /// Inertial position (m) and velocity (m/s) at `now`.
    ///
    /// # Errors
    /// The slot is empty, or the orbiter cannot say (see [`OrbiterState::at`]).
    pub fn at(&mut self, planet: &Planet, now: MissionTime) -> Result<(Vec3<Inertial>, Vec3<Inertial>), SourceError> {
        match self {
            Self::None => Err(SourceError::Empty),
            Self::Orbiter(orbiter) => orbiter.at(planet, now),
            Self::Beacon(r_p) => Ok(inertial_from_planet_relative(r_p, &Vec3::zero(), now, planet.rotation_radps)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planet::MARS;
    use crate::units::rad;

    /// Default orbiter of `msl`: a 3700 km, e 0, i 80.4°, node 96.8°, argument of latitude −145.9° at t = 0.
    fn default_orbiter(planet: &Planet) -> ([f64; 3], [f64; 3]) {
        let (i, node, u) = (rad(80.4), rad(96.8), rad(-145.9));
        let (a, n) = (3.7e6_f64, (planet.mu_m3ps2 / 3.7e6_f64.powi(3)).sqrt());
        let in_plane = |along: f64, across: f64| {
            [
                along * node.cos() - across * i.cos() * node.sin(),
                along * node.sin() + across * i.cos() * node.cos(),
                across * i.sin(),
            ]
        };
        (in_plane(a * u.cos(), a * u.sin()), in_plane(-a * n * u.sin(), a * n * u.cos()))
    }

    fn node_rad(r: &Vec3<Inertial>, v: &Vec3<Inertial>) -> f64 {
        let h = r.cross(v);
        h.x().atan2(-h.y())
    }

    fn fly(planet: &Planet, seconds: u32) -> (Vec3<Inertial>, Vec3<Inertial>) {
        let (r, v) = default_orbiter(planet);
        let mut orbiter = OrbiterState::new(r, v);
        for thousand in 0..=seconds / 1000 {
            orbiter.at(planet, MissionTime(thousand * 1_000_000_000)).unwrap();
        }
        orbiter.at(planet, MissionTime(seconds * 1_000_000)).unwrap()
    }

    #[test]
    fn energy_and_axial_momentum_are_kept_for_an_hour() {
        let (r0, v0) = fly(&MARS, 0);
        let (r1, v1) = fly(&MARS, 3600);
        let energy = |r: &Vec3<Inertial>, v: &Vec3<Inertial>| {
            let sine = r.z() / r.norm();
            let j2 = MARS.j2 * (MARS.radius_m / r.norm()).powi(2) * (1.5 * sine * sine - 0.5);
            0.5 * v.dot(v) - MARS.mu_m3ps2 / r.norm() * (1.0 - j2)
        };
        // Step error (0.01 rad of arc)⁵/120 per step, 360 steps: below 1e-10.
        assert!((energy(&r1, &v1) / energy(&r0, &v0) - 1.0).abs() < 1e-10);
        assert!((r1.cross(&v1).z() / r0.cross(&v0).z() - 1.0).abs() < 1e-10);
    }

    #[test]
    fn the_node_regresses_at_the_rate_of_first_order_theory() {
        // Half a revolution is one whole period of the node's short-period motion, so what remains is the secular rate
        // −3/2 n J2 (R/p)² cos i; theory of first order is good to a few J2, 1 % is asked.
        let n = (MARS.mu_m3ps2 / 3.7e6_f64.powi(3)).sqrt();
        let seconds = (core::f64::consts::PI / n) as u32;
        let (r0, v0) = fly(&MARS, 0);
        let (r1, v1) = fly(&MARS, seconds);
        let rate = (node_rad(&r1, &v1) - node_rad(&r0, &v0)) / f64::from(seconds);
        let theory = -1.5 * n * MARS.j2 * (MARS.radius_m / 3.7e6).powi(2) * rad(80.4).cos();
        assert!((rate / theory - 1.0).abs() < 0.01, "{rate} {theory}");
    }

    #[test]
    fn two_body_motion_is_four_hundred_metres_off_after_324_seconds() {
        // truth-and-flight.md §3: 400 m and 2.5 m/s, two figures each.
        let sphere = Planet { j2: 0.0, ..MARS };
        let ((r, v), (r2, v2)) = (fly(&MARS, 324), fly(&sphere, 324));
        let (dr, dv) = ((r - r2).norm(), (v - v2).norm());
        assert!((350.0..450.0).contains(&dr) && (2.25..2.75).contains(&dv), "{dr} {dv}");
    }

    #[test]
    fn knots_of_ten_seconds_are_as_good_as_steps_of_a_tenth() {
        let (r, v) = default_orbiter(&MARS);
        let mut fine = [r[0], r[1], r[2], v[0], v[1], v[2]];
        for _ in 0..10_000 {
            fine = stepped(&MARS, &fine, 0.1);
        }
        let (r, v) = fly(&MARS, 1000);
        let error = (r - Vec3::new(fine[0], fine[1], fine[2])).norm();
        assert!(error < 1e-2, "{error} m after 1000 s"); // a hundredth of what navigation could notice
        assert!((v - Vec3::new(fine[3], fine[4], fine[5])).norm() < 1e-5);
    }

    #[test]
    fn the_state_depends_on_the_instant_and_not_on_what_was_asked_before() {
        let (r, v) = default_orbiter(&MARS);
        let (mut often, mut once) = (OrbiterState::new(r, v), OrbiterState::new(r, v));
        for frame in 0..5_123 {
            often.at(&MARS, MissionTime::of_frame(frame)).unwrap();
        }
        let now = MissionTime::of_frame(5_123);
        assert_eq!(often.at(&MARS, now), once.at(&MARS, now));
    }

    #[test]
    fn a_source_that_cannot_say_says_why() {
        let (r, v) = default_orbiter(&MARS);
        let mut orbiter = OrbiterState::new(r, v);
        assert_eq!(orbiter.at(&MARS, MissionTime(u32::MAX)), Err(SourceError::TooFarAhead));
        assert_eq!(orbiter.at(&MARS, MissionTime(0)), Err(SourceError::InThePast));
        assert_eq!(SourceState::None.at(&MARS, MissionTime::ZERO), Err(SourceError::Empty));
        for position_m in [[0.0; 3], [f64::NAN, 0.0, 0.0], [1e6, 0.0, 0.0]] {
            let mut lost = SourceState::new(&RadioSource::Orbiter { position_m, velocity_mps: v }, &MARS);
            assert_eq!(lost.at(&MARS, MissionTime(5_000_000)), Err(SourceError::Lost));
        }
    }

    #[test]
    fn a_beacon_turns_with_the_planet() {
        let beacon = RadioSource::Beacon { longitude_rad: 0.3, latitude_rad: -0.2, altitude_m: 1e3 };
        let mut source = SourceState::new(&beacon, &MARS);
        let (r0, v0) = source.at(&MARS, MissionTime::ZERO).unwrap();
        assert!((r0.norm() - MARS.radius_m - 1e3).abs() < 1e-8);
        let spin = Vec3::<Inertial>::new(0.0, 0.0, MARS.rotation_radps);
        assert!((v0 - spin.cross(&r0)).norm() < 1e-10);
        let (r1, _) = source.at(&MARS, MissionTime(600_000_000)).unwrap();
        assert!((r1.y().atan2(r1.x()) - 0.3 - 600.0 * MARS.rotation_radps).abs() < 1e-14);
    }
}
