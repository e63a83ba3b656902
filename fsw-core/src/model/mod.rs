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

use crate::link::parameters::{AeroRow, AtmosphereParameters, AtmosphereRow, VehicleParameters};
use crate::math::{Scalar, TableError};
use crate::planet::Planet;

use aero::Aerodynamics;
use atmosphere::Atmosphere;
use entry::Environment;

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
            Self::NotPositive { quantity, value } => write!(f, "{quantity} must be above 0, not {value}"),
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

/// Planet, vehicle, air and aerodynamics as the flight software believes them; checked once, when it is built.
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
        positive("planet radius (m)", planet.radius_m)?;
        positive("gravitational parameter (m3/s2)", planet.mu_m3ps2)?;
        finite("rotation rate (rad/s)", planet.rotation_radps)?;
        finite("J2", planet.j2)?;
        positive("mass (kg)", vehicle.mass_kg)?;
        positive("reference area (m2)", vehicle.reference_area_m2)?;
        positive("nose radius (m)", vehicle.nose_radius_m)?;
        finite("trim angle of attack (rad)", vehicle.trim_angle_of_attack_rad)?;
        Ok(Self {
            planet,
            vehicle: *vehicle,
            atmosphere: Atmosphere::new(atmosphere, atmosphere_rows)?,
            aero: Aerodynamics::new(vehicle, aero_rows)?,
        })
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
        match &self.aero {
            // The speed of sound costs a root and a table: only where a coefficient depends on it.
            Aerodynamics::Constant { drag, lift } => (S::from_f64(*drag), S::from_f64(*lift)),
            table => table.coefficients(speed_mps / self.atmosphere.speed_of_sound(altitude_m)),
        }
    }

    #[inline(always)]
    fn area_per_mass_m2pkg(&self) -> f64 {
        self.vehicle.reference_area_m2 / self.vehicle.mass_kg
    }
}
