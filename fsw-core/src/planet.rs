//! Constants of the planet and of nature, and the planet record shared by model, packets and truth.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Standard gravity, m/s², the unit of sensed load.
pub const STANDARD_GRAVITY_MPS2: f64 = 9.806_65;
/// Specific gas constant of the Martian atmosphere, J/(kg·K).
pub const MARS_GAS_CONSTANT_JPKGK: f64 = 188.92;
/// Ratio of specific heats of the Martian atmosphere.
pub const MARS_HEAT_RATIO: f64 = 1.3;
/// Sutton–Graves constant for Mars, SI: q = k √(ρ/R_n) V³ in W/m². Source: P4 eq. 8 as corrected in doc/equations.md.
pub const SUTTON_GRAVES_MARS: f64 = 1.9027e-4;

/// A rotating oblate planet; z is the spin axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Planet {
    /// Reference (mean) radius, m; altitude is counted from this sphere.
    pub radius_m: f64,
    /// Gravitational parameter, m³/s².
    pub mu_m3ps2: f64,
    /// Rotation rate about +z, rad/s.
    pub rotation_radps: f64,
    /// Second zonal harmonic, dimensionless, referred to `radius_m`.
    pub j2: f64,
}

/// Mars as the papers take it: sphere of 3397.2 km, with rotation and J2.
pub const MARS: Planet =
    Planet { radius_m: 3_397_200.0, mu_m3ps2: 4.282_83e13, rotation_radps: 7.088_218e-5, j2: 1.960_45e-3 };
