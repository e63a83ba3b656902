//! The entry state, in either of its two forms.

use fsw_core::frames::PlanetRelative;
use fsw_core::planet::Planet as PlanetSi;
use fsw_core::units::rad;
use serde::{Deserialize, Serialize};

/// State of the vehicle at t = 0, before dispersions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "EntryFields", into = "EntryFields")]
pub enum Entry {
    /// Planet-relative spherical state.
    Spherical(SphericalEntry),
    /// Inertial Cartesian state; inertial axes are the planet-fixed axes at t = 0.
    Cartesian {
        /// Position, km.
        position_km: [f64; 3],
        /// Inertial velocity, m/s.
        velocity_mps: [f64; 3],
    },
}

/// Planet-relative spherical entry state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalEntry {
    /// Longitude, positive east.
    pub longitude_deg: f64,
    /// Planetocentric latitude, positive north.
    pub latitude_deg: f64,
    /// Altitude over the reference sphere.
    pub altitude_km: f64,
    /// Speed relative to the rotating planet.
    pub speed_mps: f64,
    /// Flight-path angle, positive up.
    pub flight_path_angle_deg: f64,
    /// Heading, clockwise from north.
    pub heading_deg: f64,
}

impl SphericalEntry {
    /// The same state in SI units and radians.
    #[must_use]
    pub fn planet_relative(&self, planet: &PlanetSi) -> PlanetRelative {
        PlanetRelative {
            radius_m: planet.radius_m + self.altitude_km * 1e3,
            longitude_rad: rad(self.longitude_deg),
            latitude_rad: rad(self.latitude_deg),
            speed_mps: self.speed_mps,
            flight_path_angle_rad: rad(self.flight_path_angle_deg),
            heading_rad: rad(self.heading_deg),
        }
    }
}

impl Entry {
    /// The planet-relative spherical state, whichever form the scenario gives.
    #[must_use]
    pub fn planet_relative(&self, planet: &PlanetSi) -> PlanetRelative {
        match self {
            Self::Spherical(entry) => entry.planet_relative(planet),
            Self::Cartesian { position_km, velocity_mps } => {
                let r_i = fsw_core::frames::Vec3::from_array(position_km.map(|km| km * 1e3));
                let v_i = fsw_core::frames::Vec3::from_array(*velocity_mps);
                let (r_p, v_p) = fsw_core::frames::planet_relative_from_inertial(
                    &r_i,
                    &v_i,
                    fsw_core::time::MissionTime::ZERO,
                    planet.rotation_radps,
                );
                PlanetRelative::from_cartesian(&r_p, &v_p)
            }
        }
    }
}

/// `[entry]` as written: either all six spherical fields or both Cartesian ones.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct EntryFields {
    longitude_deg: Option<f64>,
    latitude_deg: Option<f64>,
    altitude_km: Option<f64>,
    speed_mps: Option<f64>,
    flight_path_angle_deg: Option<f64>,
    heading_deg: Option<f64>,
    position_km: Option<[f64; 3]>,
    velocity_mps: Option<[f64; 3]>,
}

impl TryFrom<EntryFields> for Entry {
    type Error = String;

    fn try_from(f: EntryFields) -> Result<Self, String> {
        let spherical = [
            ("longitude_deg", f.longitude_deg),
            ("latitude_deg", f.latitude_deg),
            ("altitude_km", f.altitude_km),
            ("speed_mps", f.speed_mps),
            ("flight_path_angle_deg", f.flight_path_angle_deg),
            ("heading_deg", f.heading_deg),
        ];
        let given = spherical.iter().find(|(_, value)| value.is_some()).map(|(name, _)| *name);
        match (given, f.position_km, f.velocity_mps) {
            (Some(name), Some(_), _) => Err(format!(
                "`position_km` and `{name}` exclude each other: give the inertial Cartesian state or the planet-relative one, not both"
            )),
            (Some(name), _, Some(_)) => Err(format!(
                "`velocity_mps` and `{name}` exclude each other: give the inertial Cartesian state or the planet-relative one, not both"
            )),
            (None, Some(position_km), Some(velocity_mps)) => Ok(Self::Cartesian { position_km, velocity_mps }),
            (None, Some(_), None) => Err("`position_km` needs `velocity_mps` beside it".into()),
            (None, None, Some(_)) => Err("`velocity_mps` needs `position_km` beside it".into()),
            (_, None, None) => {
                let mut values = [0.0; 6];
                for (slot, (name, value)) in values.iter_mut().zip(spherical) {
                    *slot = value.ok_or_else(|| format!("`{name}` is missing"))?;
                }
                let [longitude_deg, latitude_deg, altitude_km, speed_mps, flight_path_angle_deg, heading_deg] = values;
                Ok(Self::Spherical(SphericalEntry {
                    longitude_deg,
                    latitude_deg,
                    altitude_km,
                    speed_mps,
                    flight_path_angle_deg,
                    heading_deg,
                }))
            }
        }
    }
}

impl From<Entry> for EntryFields {
    fn from(entry: Entry) -> Self {
        match entry {
            Entry::Spherical(s) => Self {
                longitude_deg: Some(s.longitude_deg),
                latitude_deg: Some(s.latitude_deg),
                altitude_km: Some(s.altitude_km),
                speed_mps: Some(s.speed_mps),
                flight_path_angle_deg: Some(s.flight_path_angle_deg),
                heading_deg: Some(s.heading_deg),
                ..Self::default()
            },
            Entry::Cartesian { position_km, velocity_mps } => {
                Self { position_km: Some(position_km), velocity_mps: Some(velocity_mps), ..Self::default() }
            }
        }
    }
}
