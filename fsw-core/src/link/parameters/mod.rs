//! Parameter blocks: everything the flight software is told before it is armed. They are the flight software's own
//! belief of planet, air and vehicle, and the settings of every algorithm. SI units and radians.
//!
//! The same structs make the [`crate::config::Config`] tree; each has flight defaults and a range check there.

mod guidance;
mod navigation;

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

pub use crate::model::parameters::{
    AeroRow, AtmosphereParameters, AtmosphereRow, MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS, RadioSource, VehicleParameters,
};
use crate::planet::Planet;
pub use guidance::{ConstraintParameters, GuidanceMode, GuidanceParameters, TriggerKind};
pub use navigation::{EstimatorParameters, InitialKnowledge, NavigationMode, NavigationParameters};

/// Table rows in one block.
pub const ROWS_PER_BLOCK: usize = 4;

/// One parameter block as it travels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterBlock {
    /// Algorithms to run.
    Modes(Modes),
    /// Planet.
    Planet(Planet),
    /// Vehicle.
    Vehicle(VehicleParameters),
    /// Rows of the Mach table.
    AeroRows(AeroRows),
    /// Atmosphere.
    Atmosphere(AtmosphereParameters),
    /// Rows of the atmosphere table.
    AtmosphereRows(AtmosphereRows),
    /// Target.
    Target(Target),
    /// Parachute trigger.
    Deploy(DeployParameters),
    /// One radio source.
    Source {
        /// Slot, 0 to `MAX_SOURCES` − 1.
        slot: u8,
        /// What it is.
        source: RadioSource,
    },
    /// Initial knowledge.
    InitialKnowledge(InitialKnowledge),
    /// Filter settings.
    Navigation(NavigationParameters),
    /// Guidance settings.
    Guidance(GuidanceParameters),
    /// Limits of load, heat flux and dynamic pressure.
    Constraints(ConstraintParameters),
    /// Bank control.
    Control(ControlParameters),
    /// Settings of the filters over the onboard model.
    Estimators(EstimatorParameters),
}

/// Names one block, for read-back and refusals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BlockId {
    /// [`ParameterBlock::Modes`]
    Modes,
    /// [`ParameterBlock::Planet`]
    Planet,
    /// [`ParameterBlock::Vehicle`]
    Vehicle,
    /// [`ParameterBlock::AeroRows`], the block that starts at this row.
    AeroRows(u8),
    /// [`ParameterBlock::Atmosphere`]
    Atmosphere,
    /// [`ParameterBlock::AtmosphereRows`], the block that starts at this row.
    AtmosphereRows(u8),
    /// [`ParameterBlock::Target`]
    Target,
    /// [`ParameterBlock::Deploy`]
    Deploy,
    /// [`ParameterBlock::Source`], by slot.
    Source(u8),
    /// [`ParameterBlock::InitialKnowledge`]
    InitialKnowledge,
    /// [`ParameterBlock::Navigation`]
    Navigation,
    /// [`ParameterBlock::Guidance`]
    Guidance,
    /// [`ParameterBlock::Constraints`]
    Constraints,
    /// [`ParameterBlock::Control`]
    Control,
    /// [`ParameterBlock::Estimators`]
    Estimators,
}

/// Which algorithm of each kind flies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Modes {
    /// Navigation.
    pub navigation: NavigationMode,
    /// Guidance.
    pub guidance: GuidanceMode,
    /// Parachute trigger.
    pub trigger: TriggerKind,
}

/// Up to four rows of the Mach table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AeroRows {
    /// Index of the first row here; a multiple of [`ROWS_PER_BLOCK`].
    pub start: u8,
    /// Rows of the whole table.
    pub total: u8,
    /// The rows; those beyond `total` are ignored.
    pub rows: [AeroRow; ROWS_PER_BLOCK],
}

/// Up to four rows of the atmosphere table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AtmosphereRows {
    /// Index of the first row here; a multiple of [`ROWS_PER_BLOCK`].
    pub start: u8,
    /// Rows of the whole table.
    pub total: u8,
    /// The rows; those beyond `total` are ignored.
    pub rows: [AtmosphereRow; ROWS_PER_BLOCK],
}

/// Where the parachute should open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Target {
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Planetocentric latitude, rad.
    pub latitude_rad: f64,
}

/// Parachute trigger, deploy limits and the last-chance floor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DeployParameters {
    /// Trigger speed of the speed trigger, planet-relative, m/s; also where the predictor stops.
    pub speed_mps: f64,
    /// Range trigger: lowest speed; below it the parachute fires at once, m/s.
    pub window_min_speed_mps: f64,
    /// Range trigger: highest speed, m/s.
    pub window_max_speed_mps: f64,
    /// Below this altitude the parachute fires whatever the trigger says, m.
    pub floor_altitude_m: f64,
    /// Lowest altitude of the deploy box, m.
    pub min_altitude_m: f64,
    /// Highest altitude of the deploy box, m.
    pub max_altitude_m: f64,
    /// Lowest Mach number of the deploy box.
    pub min_mach: f64,
    /// Highest Mach number of the deploy box.
    pub max_mach: f64,
    /// Lowest dynamic pressure of the deploy box, Pa.
    pub min_dynamic_pressure_pa: f64,
    /// Highest dynamic pressure of the deploy box, Pa.
    pub max_dynamic_pressure_pa: f64,
}

/// Settings of the bank control.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ControlParameters {
    /// Bank held until range control begins, rad.
    pub initial_bank_rad: f64,
    /// Largest bank rate, rad/s.
    pub max_rate_radps: f64,
    /// Largest bank acceleration, rad/s².
    pub max_accel_radps2: f64,
    /// Lag of the actuator as the flight software believes it, s.
    pub lag_s: f64,
}
