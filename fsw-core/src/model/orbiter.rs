//! Where the radio sources are: orbiters propagated with J2, beacons carried around by the planet.

use super::gravity;
use crate::frames::{Inertial, PlanetFixed, Vec3, inertial_from_planet_relative, surface_point};
use crate::link::parameters::RadioSource;
use crate::math::{num, rk4};
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
