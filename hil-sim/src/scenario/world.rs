//! What is physically there: target, vehicle and planet; [`entry`](super::entry), [`air`](super::air) and
//! [`sources`](super::sources) have files of their own.

use fsw_core::link::parameters::VehicleParameters;
use fsw_core::planet::Planet as PlanetSi;
use fsw_core::units::rad;
use serde::{Deserialize, Serialize};

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
