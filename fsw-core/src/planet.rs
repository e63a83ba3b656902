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

/// Step in Mach number of [`PITOT_COEFFICIENT`].
pub const PITOT_MACH_STEP: f64 = 0.25;
/// Stagnation pressure coefficient C_p,max at Mach 0, 0.25, … 5.0: p_t = p∞ + C_p,max(M)·q with p∞ = ρ·R·T.
///
/// Rayleigh's pitot formula for γ = 1.3, (p_t/p∞ − 1)·2/(γM²), isentropic below Mach 1, normalised to 1.85 at Mach 5
/// (factor 1.0049). Linear between the nodes; above Mach 5 the last value, 1.85, holds. A constant of nature shared by
/// flight software and truth; each has its own look-up.
#[rustfmt::skip]
pub const PITOT_COEFFICIENT: [f64; 21] = [
    1.0049, 1.0207, 1.0696, 1.1558, 1.2869, 1.4417, 1.5566,
    1.6349, 1.6890, 1.7276, 1.7559, 1.7772, 1.7935, 1.8064,
    1.8167, 1.8251, 1.8319, 1.8376, 1.8424, 1.8465, 1.8500,
];
