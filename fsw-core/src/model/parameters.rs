//! What the onboard model is made from, as it travels in parameter blocks: vehicle, air, radio sources. SI and radians.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Rows of the Mach table of the aerodynamics, at most.
pub const MAX_AERO_ROWS: usize = 32;
/// Rows of the atmosphere table, at most.
pub const MAX_ATMOSPHERE_ROWS: usize = 64;

/// The vehicle as the flight software believes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VehicleParameters {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Aerodynamic reference area, m².
    pub reference_area_m2: f64,
    /// Nose radius, m.
    pub nose_radius_m: f64,
    /// Drag coefficient, used when the Mach table is empty.
    pub drag_coefficient: f64,
    /// Lift-to-drag ratio, used when the Mach table is empty.
    pub lift_to_drag: f64,
    /// Trim angle of attack, rad; negative is nose below the velocity, lift up at zero bank.
    pub trim_angle_of_attack_rad: f64,
}

/// One row of the Mach table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AeroRow {
    /// Mach number.
    pub mach: f64,
    /// Drag coefficient.
    pub drag_coefficient: f64,
    /// Lift coefficient.
    pub lift_coefficient: f64,
}

/// The air as the flight software believes it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtmosphereParameters {
    /// Density at the reference altitude, kg/m³; the exponential law is used when the table is empty.
    pub reference_density_kgpm3: f64,
    /// Reference altitude, m.
    pub reference_altitude_m: f64,
    /// Scale height, m.
    pub scale_height_m: f64,
    /// Temperature, K, for the speed of sound; used when the table is empty.
    pub temperature_k: f64,
    /// Specific gas constant, J/(kg·K).
    pub gas_constant_jpkgk: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
}

/// One row of the atmosphere table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtmosphereRow {
    /// Altitude, m.
    pub altitude_m: f64,
    /// Density, kg/m³.
    pub density_kgpm3: f64,
    /// Temperature, K.
    pub temperature_k: f64,
}

/// A source of radio ranges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RadioSource {
    /// The slot is empty.
    #[default]
    None,
    /// An orbiter, by its inertial state at t = 0, propagated on board with J2.
    Orbiter {
        /// Inertial position at t = 0, m.
        position_m: [f64; 3],
        /// Inertial velocity at t = 0, m/s.
        velocity_mps: [f64; 3],
    },
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
