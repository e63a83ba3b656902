//! The onboard model: what the flight software believes of planet, air and vehicle, and the equations that follow.
//!
//! * [`atmosphere`] density, temperature, speed of sound. * [`aero`] drag and lift coefficients.
//! * [`gravity`] central + J2 and its gradient. * [`entry`] 3-DOF equations of motion, generic in scalar and environment.
//! * [`loads`] sensed load, heat flux, dynamic pressure. * [`orbiter`] where the radio sources are.
//!
//! The predictor and the filters fly these same equations; the truth simulator never sees them.

pub mod aero;
pub mod atmosphere;
pub mod entry;
#[cfg(test)]
mod golden_entries;
pub mod gravity;
pub mod loads;
pub mod orbiter;
pub mod parameters;

use crate::math::{Scalar, TableError};
use crate::model::parameters::{AeroRow, AtmosphereParameters, AtmosphereRow, VehicleParameters};
use crate::planet::Planet;

use aero::Aerodynamics;
use atmosphere::Atmosphere;
use entry::{Constants, Environment};

/// Altitudes at which the density of the onboard model is tabulated for predictions: up to 130 km.
pub const DENSITY_NODES: usize = NODES_BELOW + 131;
/// Those of them below the reference sphere.
pub const NODES_BELOW: usize = 2;
/// Their spacing, m.
pub const DENSITY_SPACING_M: f64 = 1_000.0;

/// Why parameters do not make a model.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ModelError {
    /// A quantity that must be finite and positive is not.
    NotPositive {
        /// Which one, with its unit.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A quantity that must be finite is not.
    NotFinite {
        /// Which one, with its unit.
        quantity: &'static str,
    },
    /// The rows of the atmosphere do not make a table.
    AtmosphereTable(TableError),
    /// The rows of the Mach table do not make a table.
    AeroTable(TableError),
}

impl core::fmt::Display for ModelError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::NotPositive { quantity, value } => write!(f, "{quantity} must be above 0 and finite, not {value}"),
            Self::NotFinite { quantity } => write!(f, "{quantity} is not a finite number"),
            Self::AtmosphereTable(error) => write!(f, "atmosphere: {error}"),
            Self::AeroTable(error) => write!(f, "aerodynamics: {error}"),
        }
    }
}

impl core::error::Error for ModelError {}

/// `value` if it is finite and positive.
fn positive(quantity: &'static str, value: f64) -> Result<f64, ModelError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(ModelError::NotPositive { quantity, value }) }
}

/// `value` if it is finite.
fn finite(quantity: &'static str, value: f64) -> Result<f64, ModelError> {
    if value.is_finite() { Ok(value) } else { Err(ModelError::NotFinite { quantity }) }
}

/// Planet, vehicle, air and aerodynamics as the flight software believes them; checked once, when it is built, and read-only
/// from then on: another vehicle is another model.
#[derive(Clone, Debug, PartialEq)]
pub struct OnboardModel {
    /// The planet.
    pub planet: Planet,
    /// The vehicle.
    pub vehicle: VehicleParameters,
    /// The air.
    pub atmosphere: Atmosphere,
    /// Drag and lift coefficients.
    pub aero: Aerodynamics,
    constants: Constants,
    /// Density from two spacings below the reference sphere up, kg/m³.
    nominal_densities: [f64; DENSITY_NODES],
}

impl OnboardModel {
    /// A model from its parameter blocks; empty rows select the exponential atmosphere and constant coefficients.
    ///
    /// # Errors
    /// A quantity out of its physical range, or rows that are not sorted, positive and finite.
    pub fn new(
        planet: Planet,
        vehicle: &VehicleParameters,
        aero_rows: &[AeroRow],
        atmosphere: &AtmosphereParameters,
        atmosphere_rows: &[AtmosphereRow],
    ) -> Result<Self, ModelError> {
        let mut model = Self::none();
        model.set(planet, vehicle, aero_rows, atmosphere, atmosphere_rows)?;
        Ok(model)
    }

    /// Nothing: the state before parameters are known.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            planet: Planet { radius_m: 0.0, mu_m3ps2: 0.0, rotation_radps: 0.0, j2: 0.0 },
            vehicle: VehicleParameters {
                mass_kg: 0.0,
                reference_area_m2: 0.0,
                nose_radius_m: 0.0,
                drag_coefficient: 0.0,
                lift_to_drag: 0.0,
                trim_angle_of_attack_rad: 0.0,
            },
            atmosphere: Atmosphere::none(),
            aero: Aerodynamics::none(),
            constants: Constants::new(&Planet { radius_m: 0.0, mu_m3ps2: 0.0, rotation_radps: 0.0, j2: 0.0 }, 0.0),
            nominal_densities: [0.0; DENSITY_NODES],
        }
    }

    /// Becomes [`Self::new`] in place: on a small stack the tables must not travel.
    ///
    /// # Errors
    /// As [`Self::new`]; what is left then is not to be used.
    pub fn set(
        &mut self,
        planet: Planet,
        vehicle: &VehicleParameters,
        aero_rows: &[AeroRow],
        atmosphere: &AtmosphereParameters,
        atmosphere_rows: &[AtmosphereRow],
    ) -> Result<(), ModelError> {
        positive("planet radius (m)", planet.radius_m)?;
        positive("gravitational parameter (m3/s2)", planet.mu_m3ps2)?;
        finite("rotation rate (rad/s)", planet.rotation_radps)?;
        finite("J2", planet.j2)?;
        let mass_kg = positive("mass (kg)", vehicle.mass_kg)?;
        let area_m2 = positive("reference area (m2)", vehicle.reference_area_m2)?;
        positive("nose radius (m)", vehicle.nose_radius_m)?;
        finite("trim angle of attack (rad)", vehicle.trim_angle_of_attack_rad)?;
        self.planet = planet;
        self.vehicle = *vehicle;
        self.constants = Constants::new(&planet, area_m2 / mass_kg);
        self.atmosphere.set(atmosphere, atmosphere_rows)?;
        let mut altitude_m = -DENSITY_SPACING_M * NODES_BELOW as f64;
        for density in &mut self.nominal_densities {
            *density = self.atmosphere.density(altitude_m);
            altitude_m += DENSITY_SPACING_M;
        }
        self.aero.set(vehicle, aero_rows)
    }

    /// Density at nodes [`DENSITY_SPACING_M`] apart, the first [`NODES_BELOW`] of them below the reference sphere, kg/m³.
    #[must_use]
    pub const fn nominal_densities(&self) -> &[f64; DENSITY_NODES] {
        &self.nominal_densities
    }

    /// Constants of the equations of motion.
    #[must_use]
    pub const fn constants(&self) -> &Constants {
        &self.constants
    }

    /// Mach number of an air-relative speed at an altitude.
    #[must_use]
    pub fn mach(&self, altitude_m: f64, speed_mps: f64) -> f64 {
        speed_mps / self.atmosphere.speed_of_sound_mps(altitude_m)
    }
}

impl<S: Scalar> Environment<S> for OnboardModel {
    #[inline(always)]
    fn planet(&self) -> &Planet {
        &self.planet
    }

    #[inline(always)]
    fn density_kgpm3(&self, altitude_m: S) -> S {
        self.atmosphere.density(altitude_m)
    }

    #[inline(always)]
    fn drag_and_lift_coefficients(&self, altitude_m: S, speed_mps: S) -> (S, S) {
        match self.aero.constant() {
            // The speed of sound costs a root and a table: only where a coefficient depends on it.
            Some((drag, lift)) => (S::from_f64(drag), S::from_f64(lift)),
            None => self.aero.coefficients(speed_mps / self.atmosphere.speed_of_sound(altitude_m)),
        }
    }

    #[inline(always)]
    fn constants(&self) -> &Constants {
        &self.constants
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Dual;
    use crate::planet::MARS;
    use std::string::ToString;

    const CAPSULE: VehicleParameters = VehicleParameters {
        mass_kg: 2804.0,
        reference_area_m2: 15.9,
        nose_radius_m: 1.125,
        drag_coefficient: 1.45,
        lift_to_drag: 0.24,
        trim_angle_of_attack_rad: -0.279,
    };
    const MODEL_C: AtmosphereParameters = AtmosphereParameters {
        reference_density_kgpm3: 0.0158,
        reference_altitude_m: 0.0,
        scale_height_m: 9354.0,
        temperature_k: 180.0,
        gas_constant_jpkgk: 188.92,
        heat_ratio: 1.3,
    };

    fn row(mach: f64, drag_coefficient: f64) -> AeroRow {
        AeroRow { mach, drag_coefficient, lift_coefficient: 0.24 * drag_coefficient }
    }

    #[test]
    fn a_flat_mach_table_flies_like_constant_coefficients() {
        let constant = OnboardModel::new(MARS, &CAPSULE, &[], &MODEL_C, &[]).unwrap();
        let flat = OnboardModel::new(MARS, &CAPSULE, &[row(1.0, 1.45), row(9.0, 1.45)], &MODEL_C, &[]).unwrap();
        let state = [3.41e6, 2e4, -3e4, -500.0, 1200.0, 300.0];
        let (a, b) =
            (entry::cartesian_rates(&constant, &state, 0.6, 0.8), entry::cartesian_rates(&flat, &state, 0.6, 0.8));
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn the_slope_of_the_mach_table_reaches_the_jacobian() {
        let sloped = OnboardModel::new(MARS, &CAPSULE, &[row(1.0, 1.0), row(9.0, 1.8)], &MODEL_C, &[]).unwrap();
        let speed_mps = Dual::<1>::variable(1000.0, 0);
        let (drag, lift) = sloped.drag_and_lift_coefficients(Dual::constant(20e3), speed_mps);
        // 0.1 per Mach number; the Mach number per m/s is the inverse of the speed of sound.
        let expected = 0.1 / sloped.atmosphere.speed_of_sound_mps(20e3);
        assert!((drag.partials[0] / expected - 1.0).abs() < 1e-13);
        assert!((lift.partials[0] / (0.24 * expected) - 1.0).abs() < 1e-13);
        assert!((drag.value - (1.0 + 0.1 * (sloped.mach(20e3, 1000.0) - 1.0))).abs() < 1e-14);
    }

    #[test]
    fn each_absurd_parameter_is_refused_by_name() {
        let refused = |planet: Planet, vehicle: &VehicleParameters| {
            OnboardModel::new(planet, vehicle, &[], &MODEL_C, &[]).unwrap_err().to_string()
        };
        let cases = [
            (
                refused(Planet { radius_m: -1.0, ..MARS }, &CAPSULE),
                "planet radius (m) must be above 0 and finite, not -1",
            ),
            (refused(Planet { j2: f64::NAN, ..MARS }, &CAPSULE), "J2 is not a finite number"),
            (
                refused(MARS, &VehicleParameters { mass_kg: 0.0, ..CAPSULE }),
                "mass (kg) must be above 0 and finite, not 0",
            ),
            (
                refused(MARS, &VehicleParameters { reference_area_m2: f64::INFINITY, ..CAPSULE }),
                "reference area (m2) must be above 0 and finite, not inf",
            ),
        ];
        for (message, expected) in cases {
            assert_eq!(message, expected);
        }
    }
}
