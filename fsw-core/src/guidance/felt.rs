//! What the accelerometers say of the air, without knowing its density.

use crate::frames::Vec3;
use crate::math::fun::sin_cos;
use crate::model::OnboardModel;
use crate::nav::Estimate;

/// Felt and modelled dynamic pressure may differ by this factor; beyond it the felt one is taken to be a fault of the sensor.
const PLAUSIBLE_FACTOR: f64 = 2.0;

/// Specific force against the trimmed direction of flight, m/s².
#[must_use]
#[inline(never)] // of use in a few places
pub fn drag_mps2(estimate: &Estimate, model: &OnboardModel) -> f64 {
    let (sine, cosine) = sin_cos(model.vehicle.trim_angle_of_attack_rad);
    -estimate.specific_force_b.dot(&Vec3::new(cosine, 0.0, sine))
}

/// Dynamic pressure from the drag felt, D m / (S C_D), Pa. It holds in air of any density and in wind, to the accuracy of
/// C_D; where it is far from `modelled_pa`, that one.
#[must_use]
pub fn dynamic_pressure_pa(estimate: &Estimate, model: &OnboardModel, mach: f64, modelled_pa: f64) -> f64 {
    let (drag_coefficient, _) = model.aero.coefficients(mach);
    let per_pa = model.vehicle.reference_area_m2 * drag_coefficient / model.vehicle.mass_kg;
    let felt_pa = drag_mps2(estimate, model) / per_pa;
    // Written so that what is not a number is not taken.
    let plausible = felt_pa <= PLAUSIBLE_FACTOR * modelled_pa && felt_pa * PLAUSIBLE_FACTOR >= modelled_pa;
    if plausible { felt_pa } else { modelled_pa }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;

    #[test]
    fn pressure_is_felt_in_air_of_any_density_and_modelled_when_nothing_sane_is_felt() {
        let config = Config::DEFAULT;
        let model = OnboardModel::new(config.planet, &config.vehicle, &[], &config.atmosphere, &[]).unwrap();
        let (drag_coefficient, _) = model.aero.coefficients(2.0);
        let (sine, cosine) = sin_cos(config.vehicle.trim_angle_of_attack_rad);
        let felt = |pressure_pa: f64| {
            let drag = pressure_pa * config.vehicle.reference_area_m2 * drag_coefficient / config.vehicle.mass_kg;
            let specific_force_b = Vec3::new(-drag * cosine, 0.0, -drag * sine);
            dynamic_pressure_pa(&Estimate { specific_force_b, ..Estimate::default() }, &model, 2.0, 900.0)
        };
        for true_pa in [500.0, 700.0, 1700.0] {
            assert!((felt(true_pa) - true_pa).abs() < 1e-9 * true_pa, "{true_pa}");
        }
        for nonsense_pa in [0.0, 440.0, 1900.0, -700.0, f64::NAN, f64::INFINITY] {
            assert_eq!(felt(nonsense_pa), 900.0, "{nonsense_pa}");
        }
    }
}
