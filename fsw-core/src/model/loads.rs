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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::{AtmosphereParameters, VehicleParameters};
    use crate::planet::{MARS, STANDARD_GRAVITY_MPS2};
    use crate::units::rad;

    const MODEL_C: AtmosphereParameters = AtmosphereParameters {
        reference_density_kgpm3: 0.0158,
        reference_altitude_m: 0.0,
        scale_height_m: 9354.0,
        temperature_k: 180.0,
        gas_constant_jpkgk: 188.92,
        heat_ratio: 1.3,
    };
    const CAPSULE: VehicleParameters = VehicleParameters {
        mass_kg: 2804.0,
        reference_area_m2: 15.9,
        nose_radius_m: 1.125,
        drag_coefficient: 1.45,
        lift_to_drag: 0.24,
        trim_angle_of_attack_rad: rad(-16.0),
    };

    #[test]
    fn the_normal_load_is_the_body_z_force_of_the_trimmed_capsule() {
        // truth-and-flight.md §3: at −16° and L/D 0.24 the sensed force is along (−1.490, 0, +0.065) per C_D of 1.45.
        let (drag, lift) = (1.45, 1.45 * 0.24);
        assert!((normal_load_mps2(drag, lift, rad(-16.0)) - 0.065).abs() < 5e-4);
        let axial = (sensed_load_mps2(drag, lift).powi(2) - normal_load_mps2(drag, lift, rad(-16.0)).powi(2)).sqrt();
        assert!((axial - 1.490).abs() < 5e-4);
    }

    #[test]
    fn expected_loads_at_one_point_agree_with_numbers_worked_by_hand() {
        let model = OnboardModel::new(MARS, &CAPSULE, &[], &MODEL_C, &[]).unwrap();
        let loads = Loads::expected(&model, 30e3, 4000.0);
        // ρ = 0.0158 e^(−30000/9354) = 6.3943e-4 kg/m³; q = ½ρV² = 5115.5 Pa; D = q·1.45·15.9/2804 = 42.060 m/s².
        let density = 0.0158 * (-30e3_f64 / 9354.0).exp();
        assert!((density - 6.3943e-4).abs() < 5e-8);
        assert!((loads.dynamic_pressure_pa - 5115.5).abs() < 0.5, "{}", loads.dynamic_pressure_pa);
        assert!((loads.sensed_load_mps2 / STANDARD_GRAVITY_MPS2 - 4.4107).abs() < 1e-4, "{}", loads.sensed_load_mps2);
        // 1.9027e-4 √(6.3943e-4/1.125) 4000³ = 2.9032e5 W/m².
        assert!((loads.heat_flux_wpm2 - 2.9032e5).abs() < 1e1, "{}", loads.heat_flux_wpm2);
        assert!((loads.mach - 4000.0 / (1.3 * 188.92 * 180.0_f64).sqrt()).abs() < 1e-12);
    }
}
