//! Scenarios: everything a flight needs, in one TOML file.

mod air;
mod blocks;
mod check;
mod dispersions;
mod entry;
mod error;
mod flight;
mod layers;
mod load;
mod ranges;
mod sensors;
mod sources;
mod table;
mod world;

use serde::{Deserialize, Serialize};

pub use air::{Atmosphere, AtmosphereKind, AtmosphereRow, Perturbation};
pub use dispersions::{Dispersion, Dispersions, Fault, FaultKind, FaultTarget};
pub use entry::{Entry, SphericalEntry};
pub use error::ScenarioError;
pub use flight::{Control, Deploy, DeployBox, Guidance, Limits, Navigation, Onboard, OnboardAtmosphere};
pub use ranges::{RANGES, Range, range_of};
pub use sensors::{Blackout, Imu, Pressure, Radio, Sensors};
pub use sources::{Beacon, Orbiter};
pub use world::{AeroRow, Planet, Target, Vehicle};

/// A whole scenario. Field names and units are those of the TOML file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name in reports.
    pub name: String,
    /// A flight that has not ended by then has failed.
    pub time_limit_s: f64,
    /// State at t = 0.
    pub entry: Entry,
    /// Target.
    pub target: Target,
    /// Parachute.
    pub deploy: Deploy,
    /// Vehicle.
    pub vehicle: Vehicle,
    /// Planet.
    pub planet: Planet,
    /// True air.
    pub atmosphere: Atmosphere,
    /// The flight software's belief.
    pub onboard: Onboard,
    /// Radio sources in orbit; they take the first slots.
    #[serde(default)]
    pub orbiter: Vec<Orbiter>,
    /// Radio sources on the surface; they take the slots after the orbiters.
    #[serde(default)]
    pub beacon: Vec<Beacon>,
    /// Sensors.
    pub sensors: Sensors,
    /// Navigation.
    pub navigation: Navigation,
    /// Guidance.
    pub guidance: Guidance,
    /// Bank control.
    pub control: Control,
    /// Run-to-run differences.
    pub dispersions: Dispersions,
    /// Faults on purpose.
    #[serde(default)]
    pub fault: Vec<Fault>,
}
