//! What is physically there: entry state, target, vehicle, planet, air, orbiters and beacons.

use fsw_core::frames::PlanetRelative;
use fsw_core::link::parameters::{AtmosphereParameters, VehicleParameters};
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

/// Where the parachute should open.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Longitude, positive east.
    pub longitude_deg: f64,
    /// Planetocentric latitude, positive north.
    pub latitude_deg: f64,
}

/// The vehicle: true nominal values under `[vehicle]`, the flight software's belief under `[onboard.vehicle]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vehicle {
    /// Mass.
    pub mass_kg: f64,
    /// Aerodynamic reference area.
    pub reference_area_m2: f64,
    /// Nose radius, for the heat flux.
    pub nose_radius_m: f64,
    /// Drag coefficient; not used when `aero_table` is given.
    pub drag_coefficient: f64,
    /// Lift-to-drag ratio; not used when `aero_table` is given.
    pub lift_to_drag: f64,
    /// Trim angle of attack; negative is nose below the velocity, lift up at zero bank.
    pub trim_angle_of_attack_deg: f64,
    /// Aerodynamics by Mach number, rising. In a file: the name of a CSV with columns mach, cd, cl, or rows in line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aero_table: Option<Vec<AeroRow>>,
}

impl Vehicle {
    /// SI values as the flight software takes them.
    #[must_use]
    pub fn parameters(&self) -> VehicleParameters {
        VehicleParameters {
            mass_kg: self.mass_kg,
            reference_area_m2: self.reference_area_m2,
            nose_radius_m: self.nose_radius_m,
            drag_coefficient: self.drag_coefficient,
            lift_to_drag: self.lift_to_drag,
            trim_angle_of_attack_rad: rad(self.trim_angle_of_attack_deg),
        }
    }
}

/// One row of an aerodynamic table: `[mach, cd, cl]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f64; 3]", into = "[f64; 3]")]
pub struct AeroRow {
    /// Mach number.
    pub mach: f64,
    /// Drag coefficient.
    pub drag_coefficient: f64,
    /// Lift coefficient.
    pub lift_coefficient: f64,
}

impl From<[f64; 3]> for AeroRow {
    fn from([mach, drag_coefficient, lift_coefficient]: [f64; 3]) -> Self {
        Self { mach, drag_coefficient, lift_coefficient }
    }
}

impl From<AeroRow> for [f64; 3] {
    fn from(row: AeroRow) -> Self {
        [row.mach, row.drag_coefficient, row.lift_coefficient]
    }
}

/// The planet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planet {
    /// Reference radius; altitude is counted from this sphere.
    pub radius_km: f64,
    /// Gravitational parameter.
    pub mu_m3ps2: f64,
    /// Rotation rate.
    pub rotation_radps: f64,
    /// Second zonal harmonic.
    pub j2: f64,
}

impl Planet {
    /// The same planet in SI units.
    #[must_use]
    pub fn si(&self) -> PlanetSi {
        PlanetSi {
            radius_m: self.radius_km * 1e3,
            mu_m3ps2: self.mu_m3ps2,
            rotation_radps: self.rotation_radps,
            j2: self.j2,
        }
    }
}

/// Law of the density.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AtmosphereKind {
    /// One exponential.
    Exponential,
    /// A table by altitude.
    Table,
}

/// The true air, before dispersions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Atmosphere {
    /// Exponential or table.
    pub kind: AtmosphereKind,
    /// Density at the reference altitude (exponential).
    pub reference_density_kgpm3: f64,
    /// Reference altitude (exponential).
    pub reference_altitude_km: f64,
    /// Scale height (exponential; also gives the default temperature).
    pub scale_height_km: f64,
    /// Rows of the table, by altitude, rising. In a file: `file = "….csv"` instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Vec<AtmosphereRow>>,
    /// Temperature; where missing the hydrostatic g·H/R of [`Atmosphere::temperature_k`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// Specific gas constant.
    pub gas_constant_jpkgk: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
    /// Factor on the true density that the flight software is not told of.
    pub density_scale: f64,
    /// Random density perturbation, correlated in altitude.
    pub perturbation: Perturbation,
}

impl Atmosphere {
    /// Temperature where the table gives none: as stated, else that of hydrostatic balance at the surface, g·H/R.
    #[must_use]
    pub fn temperature_k(&self, planet: &PlanetSi) -> f64 {
        self.temperature_k
            .unwrap_or_else(|| hydrostatic_temperature_k(planet, self.scale_height_km * 1e3, self.gas_constant_jpkgk))
    }

    /// The exponential law in SI units.
    #[must_use]
    pub fn parameters(&self, planet: &PlanetSi) -> AtmosphereParameters {
        AtmosphereParameters {
            reference_density_kgpm3: self.reference_density_kgpm3,
            reference_altitude_m: self.reference_altitude_km * 1e3,
            scale_height_m: self.scale_height_km * 1e3,
            temperature_k: self.temperature_k(planet),
            gas_constant_jpkgk: self.gas_constant_jpkgk,
            heat_ratio: self.heat_ratio,
        }
    }
}

/// Temperature of an isothermal atmosphere in hydrostatic balance with the gravity at the reference radius, K.
pub(super) fn hydrostatic_temperature_k(planet: &PlanetSi, scale_height_m: f64, gas_constant_jpkgk: f64) -> f64 {
    planet.mu_m3ps2 / (planet.radius_m * planet.radius_m) * scale_height_m / gas_constant_jpkgk
}

/// One row of an atmosphere table: `[altitude_km, density_kgpm3, temperature_k, wind_east_mps, wind_north_mps]`; the
/// last three may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct AtmosphereRow {
    /// Altitude.
    pub altitude_km: f64,
    /// Density.
    pub density_kgpm3: f64,
    /// Temperature.
    pub temperature_k: Option<f64>,
    /// Wind towards east.
    pub wind_east_mps: f64,
    /// Wind towards north.
    pub wind_north_mps: f64,
}

impl TryFrom<Vec<f64>> for AtmosphereRow {
    type Error = String;

    fn try_from(v: Vec<f64>) -> Result<Self, String> {
        let row = |temperature_k, wind_east_mps, wind_north_mps| Self {
            altitude_km: v[0],
            density_kgpm3: v[1],
            temperature_k,
            wind_east_mps,
            wind_north_mps,
        };
        match v.len() {
            2 => Ok(row(None, 0.0, 0.0)),
            3 => Ok(row(Some(v[2]), 0.0, 0.0)),
            5 => Ok(row(Some(v[2]), v[3], v[4])),
            n => Err(format!(
                "a row has {n} values where 2 (altitude_km, density_kgpm3), 3 (and temperature_k) or 5 (and wind_east_mps, wind_north_mps) are expected"
            )),
        }
    }
}

impl From<AtmosphereRow> for Vec<f64> {
    fn from(row: AtmosphereRow) -> Self {
        let mut values = vec![row.altitude_km, row.density_kgpm3];
        if let Some(temperature_k) = row.temperature_k {
            values.push(temperature_k);
            if row.wind_east_mps != 0.0 || row.wind_north_mps != 0.0 {
                values.extend([row.wind_east_mps, row.wind_north_mps]);
            }
        }
        values
    }
}

/// Random density perturbation, a first-order Gauss–Markov process in altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perturbation {
    /// Standard deviation of the logarithm of the density; 0 turns it off.
    pub sigma: f64,
    /// Correlation length in altitude.
    pub correlation_km: f64,
}

/// A radio source in orbit, by osculating elements at t = 0 in inertial axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbiter {
    /// Name in reports.
    pub name: String,
    /// Semi-major axis.
    pub semi_major_axis_km: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination.
    pub inclination_deg: f64,
    /// Right ascension of the ascending node; from the inertial x axis, the planet's prime meridian at t = 0.
    pub raan_deg: f64,
    /// Argument of periapsis.
    pub arg_periapsis_deg: f64,
    /// True anomaly at t = 0.
    pub true_anomaly_deg: f64,
}

impl Orbiter {
    /// Inertial position (m) and velocity (m/s) at t = 0.
    ///
    /// Perifocal state turned by R3(−Ω) R1(−i) R3(−ω); any textbook, e.g. Vallado, Algorithm COE2RV.
    #[must_use]
    pub fn inertial_state(&self, planet: &PlanetSi) -> ([f64; 3], [f64; 3]) {
        let (sin_i, cos_i) = libm::sincos(rad(self.inclination_deg));
        let (sin_node, cos_node) = libm::sincos(rad(self.raan_deg));
        let (sin_peri, cos_peri) = libm::sincos(rad(self.arg_periapsis_deg));
        let (sin_nu, cos_nu) = libm::sincos(rad(self.true_anomaly_deg));
        let e = self.eccentricity;
        let parameter_m = self.semi_major_axis_km * 1e3 * (1.0 - e * e);
        let radius_m = parameter_m / (1.0 + e * cos_nu);
        let speed = libm::sqrt(planet.mu_m3ps2 / parameter_m);
        let to_periapsis = [
            cos_node * cos_peri - sin_node * sin_peri * cos_i,
            sin_node * cos_peri + cos_node * sin_peri * cos_i,
            sin_peri * sin_i,
        ];
        let across = [
            -cos_node * sin_peri - sin_node * cos_peri * cos_i,
            -sin_node * sin_peri + cos_node * cos_peri * cos_i,
            cos_peri * sin_i,
        ];
        let combine = |p: f64, q: f64| [0, 1, 2].map(|k: usize| p * to_periapsis[k] + q * across[k]);
        (combine(radius_m * cos_nu, radius_m * sin_nu), combine(-speed * sin_nu, speed * (e + cos_nu)))
    }
}

/// A radio source fixed to the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beacon {
    /// Name in reports.
    pub name: String,
    /// Longitude, positive east.
    pub longitude_deg: f64,
    /// Planetocentric latitude, positive north.
    pub latitude_deg: f64,
    /// Altitude over the reference sphere.
    pub altitude_km: f64,
}
