//! The air and the lift that predictions fly: the onboard model times what was learned of it in flight.

use crate::math::num::{clamp, max};
use crate::model::OnboardModel;
use crate::model::entry::{Constants, Environment};
use crate::planet::Planet;

/// Altitudes at which a profile is tabulated.
pub const NODES: usize = 81;
/// Their spacing, m; the lowest is at the reference sphere.
pub const SPACING_M: f64 = 1_000.0;
/// One over the spacing.
const PER_SPACING_PM: f64 = 1.0 / SPACING_M;

/// Ratios to the onboard model: of density by altitude, linear between nodes and constant beyond, and of lift to drag.
#[derive(Clone, Debug, PartialEq)]
pub struct AirProfile {
    /// Density over that of the model at each node; the last one twice, so that the top needs no test.
    density: [f64; NODES + 1],
    /// Lift over drag, over that of the model.
    lift_to_drag: f64,
}

impl AirProfile {
    /// The onboard model as it is.
    pub const NOMINAL: Self = Self { density: [1.0; NODES + 1], lift_to_drag: 1.0 };

    /// The same density ratio everywhere.
    pub fn set_constant(&mut self, density_ratio: f64) {
        self.density = [density_ratio; NODES + 1];
        self.lift_to_drag = 1.0;
    }

    /// Sets the ratio of lift to drag and, from `ratio(node)`, that of the density at each node.
    pub fn fill(&mut self, lift_to_drag: f64, mut ratio: impl FnMut() -> f64) {
        self.lift_to_drag = lift_to_drag;
        let [nodes @ .., beyond] = &mut self.density;
        for node in nodes.iter_mut() {
            *node = ratio();
            *beyond = *node;
        }
    }

    /// Density over that of the onboard model at an altitude.
    #[inline(always)]
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within the table by the clamp
    #[allow(clippy::cast_precision_loss)] // a small number
    #[allow(clippy::indexing_slicing)] // lower ≤ NODES − 1 by the clamp, and there is one node more
    pub fn density_ratio(&self, altitude_m: f64) -> f64 {
        let x = clamp(altitude_m * PER_SPACING_PM, 0.0, (NODES - 1) as f64);
        let lower = x as u32;
        let share = x - f64::from(lower);
        let lower = (lower as usize).min(NODES - 1);
        let (a, b) = (self.density[lower], self.density[lower + 1]);
        a + (b - a) * share
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
        self.model.atmosphere.density(altitude_m) * self.air.density_ratio(altitude_m)
    }
    #[inline(always)]
    fn drag_and_lift_coefficients(&self, altitude_m: f64, speed_mps: f64) -> (f64, f64) {
        let (drag, lift) = self.model.drag_and_lift_coefficients(altitude_m, speed_mps);
        (drag, lift * self.air.lift_to_drag)
    }
}
