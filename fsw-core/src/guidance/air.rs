//! The air and the lift that predictions fly: the onboard model times what was learned of it in flight.

use crate::math::num::{clamp, max};
use crate::model::entry::{Constants, Environment};
use crate::model::{DENSITY_NODES, DENSITY_SPACING_M, NODES_BELOW, OnboardModel};
use crate::planet::Planet;

/// Altitudes at which what was learned is tabulated: from the reference sphere up; constant beyond.
pub const RATIO_NODES: usize = 81;
/// Their spacing, m.
pub const SPACING_M: f64 = DENSITY_SPACING_M;
/// One over the spacing.
const PER_SPACING_PM: f64 = 1.0 / SPACING_M;

/// The air of predictions: its density by altitude, of the onboard model times what was learned, and the ratio of lift
/// to drag over that of the model.
///
/// Density comes from the cubic through four nodes a kilometre apart, within 1e-5 of the exponential for any scale height
/// above 6 km, for half the price.
#[derive(Clone, Debug, PartialEq)]
pub struct AirProfile {
    /// Density at the nodes of [`OnboardModel::nominal_densities`], kg/m³.
    density: [f64; DENSITY_NODES],
    /// Lift over drag, over that of the model.
    lift_to_drag: f64,
}

impl AirProfile {
    /// No air: the state before a model is known.
    pub const NONE: Self = Self { density: [0.0; DENSITY_NODES], lift_to_drag: 0.0 };

    /// The onboard model as it is.
    #[must_use]
    pub fn nominal(model: &OnboardModel) -> Self {
        let mut air = Self::NONE;
        air.set_constant(model, 1.0);
        air
    }

    /// Whether there is no air in it yet.
    #[must_use]
    pub fn is_none(&self) -> bool {
        self.lift_to_drag == 0.0
    }

    /// The onboard model with the same density ratio everywhere.
    #[inline(never)] // once a second
    pub fn set_constant(&mut self, model: &OnboardModel, density_ratio: f64) {
        for (node, nominal) in self.density.iter_mut().zip(model.nominal_densities()) {
            *node = nominal * density_ratio;
        }
        self.lift_to_drag = 1.0;
    }

    /// Sets the ratio of lift to drag and, by the `excess` over one of its ratio at each node, the density.
    pub fn fill(&mut self, model: &OnboardModel, lift_to_drag: f64, excess: &[f32; RATIO_NODES]) {
        self.lift_to_drag = lift_to_drag;
        let (mut ratios, mut ratio) = (excess.iter(), 1.0);
        for (index, (node, nominal)) in self.density.iter_mut().zip(model.nominal_densities()).enumerate() {
            if index == 0 || index > NODES_BELOW {
                ratio = ratios.next().map_or(ratio, |excess| 1.0 + f64::from(*excess));
            }
            *node = nominal * ratio;
        }
    }

    /// Density at an altitude, kg/m³; that of the nearest node beyond the table.
    #[inline(always)]
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the table by the clamp
    #[allow(clippy::cast_precision_loss)] // a small number
    #[allow(clippy::indexing_slicing)] // 1 ≤ lower ≤ DENSITY_NODES − 3 by the clamps
    pub fn density_kgpm3(&self, altitude_m: f64) -> f64 {
        const TOP: usize = DENSITY_NODES - 3;
        let x = clamp(altitude_m * PER_SPACING_PM + NODES_BELOW as f64, 1.0, (TOP + 1) as f64);
        let lower = (x as usize).clamp(1, TOP);
        let share = x - lower as u32 as f64;
        let (before, a, b, after) =
            (self.density[lower - 1], self.density[lower], self.density[lower + 1], self.density[lower + 2]);
        // Newton's form through the nodes in the order a, b, before, after.
        let rise = b - a;
        let bend = (rise - (a - before)) * 0.5;
        let twist = ((after - before) - 3.0 * rise) * (1.0 / 6.0);
        a + share * (rise + (share - 1.0) * (bend + (share + 1.0) * twist))
    }

    /// Lift over drag, over that of the onboard model.
    #[must_use]
    pub fn lift_to_drag(&self) -> f64 {
        self.lift_to_drag
    }
}

/// The onboard model in this air.
#[derive(Clone, Copy, Debug)]
pub struct Adapted<'a> {
    /// The onboard model.
    pub model: &'a OnboardModel,
    /// What was learned.
    pub air: &'a AirProfile,
}

impl Adapted<'_> {
    /// Lift acceleration at an altitude and a planet-relative speed, m/s².
    #[must_use]
    pub fn lift_mps2(&self, altitude_m: f64, speed_mps: f64) -> f64 {
        let (_, lift) = self.drag_and_lift_coefficients(altitude_m, speed_mps);
        let pressure = self.density_kgpm3(altitude_m) * speed_mps * speed_mps;
        max(pressure * lift, 0.0) * self.constants().half_area_per_mass_m2pkg
    }
}

impl Environment<f64> for Adapted<'_> {
    #[inline(always)]
    fn planet(&self) -> &Planet {
        &self.model.planet
    }
    #[inline(always)]
    fn constants(&self) -> &Constants {
        self.model.constants()
    }
    #[inline(always)]
    fn density_kgpm3(&self, altitude_m: f64) -> f64 {
        self.air.density_kgpm3(altitude_m)
    }
    #[inline(always)]
    fn drag_and_lift_coefficients(&self, altitude_m: f64, speed_mps: f64) -> (f64, f64) {
        let (drag, lift) = self.model.drag_and_lift_coefficients(altitude_m, speed_mps);
        (drag, lift * self.air.lift_to_drag)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::model::parameters::AtmosphereParameters;

    fn model(scale_height_m: f64) -> OnboardModel {
        let c = Config::DEFAULT;
        let air = AtmosphereParameters { scale_height_m, ..c.atmosphere };
        OnboardModel::new(c.planet, &c.vehicle, &[], &air, &[]).unwrap()
    }

    #[test]
    fn tabulated_air_is_that_of_the_model_between_the_nodes_too() {
        for scale_height_m in [6_000.0, 9_354.0, 14_000.0] {
            let model = model(scale_height_m);
            let air = AirProfile::nominal(&model);
            let worst = (-900..128_900)
                .step_by(37)
                .map(|h| (air.density_kgpm3(f64::from(h)) / model.atmosphere.density(f64::from(h)) - 1.0).abs())
                .fold(0.0, f64::max);
            assert!(worst < 2e-5, "{scale_height_m} m: {worst:e}");
        }
    }

    #[test]
    fn beyond_the_table_and_for_nonsense_the_air_is_finite() {
        let model = model(9_354.0);
        let air = AirProfile::nominal(&model);
        for altitude_m in [-1e9, -5e3, 130e3, 1e9, f64::NAN] {
            let density = air.density_kgpm3(altitude_m);
            assert!(altitude_m.is_nan() || (density.is_finite() && density > 0.0), "{altitude_m}: {density}");
        }
    }

    #[test]
    fn what_was_learned_stands_at_its_altitude_and_goes_on_beyond() {
        let model = model(9_354.0);
        let mut air = AirProfile::NONE;
        air.fill(&model, 1.1, &std::array::from_fn(|k| 0.01 * k as f32));
        for (altitude_km, ratio) in [(-1.0, 1.0), (0.0, 1.0), (1.0, 1.01), (40.0, 1.4), (80.0, 1.8), (100.0, 1.8)] {
            let h = altitude_km * 1e3;
            assert!((air.density_kgpm3(h) / model.atmosphere.density(h) / ratio - 1.0).abs() < 1e-7, "{altitude_km}");
        }
    }
}
