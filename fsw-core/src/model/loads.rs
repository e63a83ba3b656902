//! Loads along the path: what the constraints limit and the report shows.

use super::OnboardModel;
use crate::math::fun::{sin_cos, sqrt};
use crate::math::num::abs;
use crate::planet::SUTTON_GRAVES_MARS;

/// Dynamic pressure ½ ρ V², Pa.
#[must_use]
pub fn dynamic_pressure_pa(density_kgpm3: f64, speed_mps: f64) -> f64 {
    0.5 * density_kgpm3 * speed_mps * speed_mps
}

/// Sensed load √(L² + D²), m/s²: what an accelerometer triad feels.
#[must_use]
pub fn sensed_load_mps2(drag_mps2: f64, lift_mps2: f64) -> f64 {
    sqrt(drag_mps2 * drag_mps2 + lift_mps2 * lift_mps2)
}

/// Normal load |L cosα + D sinα|, m/s²: the component normal to the body axis (P4 eq. 9 as corrected in `doc/equations.md`).
#[must_use]
pub fn normal_load_mps2(drag_mps2: f64, lift_mps2: f64, angle_of_attack_rad: f64) -> f64 {
    let (sine, cosine) = sin_cos(angle_of_attack_rad);
    abs(lift_mps2 * cosine + drag_mps2 * sine)
}

/// Convective heat flux at the stagnation point, k √(ρ/R_n) V³, W/m² (Sutton–Graves; P4 eq. 8 as corrected).
#[must_use]
pub fn heat_flux_wpm2(density_kgpm3: f64, speed_mps: f64, nose_radius_m: f64) -> f64 {
    SUTTON_GRAVES_MARS * sqrt(density_kgpm3 / nose_radius_m) * speed_mps * speed_mps * speed_mps
}

/// All loads at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loads {
    /// Sensed load, m/s².
    pub sensed_load_mps2: f64,
    /// Load normal to the body axis, m/s².
    pub normal_load_mps2: f64,
    /// Convective heat flux at the stagnation point, W/m².
    pub heat_flux_wpm2: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Mach number.
    pub mach: f64,
}

impl Loads {
    /// The loads that the onboard model expects at an altitude and a speed relative to the air.
    #[must_use]
    pub fn expected(model: &OnboardModel, altitude_m: f64, speed_mps: f64) -> Self {
        let density_kgpm3 = model.atmosphere.density(altitude_m);
        let mach = model.mach(altitude_m, speed_mps);
        let (drag_coefficient, lift_coefficient) = model.aero.coefficients(mach);
        let dynamic_pressure_pa = dynamic_pressure_pa(density_kgpm3, speed_mps);
        let per_coefficient = dynamic_pressure_pa * model.vehicle.reference_area_m2 / model.vehicle.mass_kg;
        let (drag_mps2, lift_mps2) = (per_coefficient * drag_coefficient, per_coefficient * lift_coefficient);
        Self {
            sensed_load_mps2: sensed_load_mps2(drag_mps2, lift_mps2),
            normal_load_mps2: normal_load_mps2(drag_mps2, lift_mps2, model.vehicle.trim_angle_of_attack_rad),
            heat_flux_wpm2: heat_flux_wpm2(density_kgpm3, speed_mps, model.vehicle.nose_radius_m),
            dynamic_pressure_pa,
            mach,
        }
    }
}
