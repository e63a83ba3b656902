//! What a flight leaves behind: [`FlightRecord`] in memory and [`Summary`], the content of `summary.json`.
//!
//! Units are SI and radians, except in the fields of [`Summary`] that carry another unit in their name.

mod summary;

use fsw_core::link::packet::{Actuator, Event, GuidanceTlm, HealthTlm, NavTlm, Truth};
use fsw_core::link::parameters::{
    ConstraintParameters, DeployParameters, NavigationMode, NavigationParameters, Target, TriggerKind,
};
use fsw_core::planet::{Planet, STANDARD_GRAVITY_MPS2};
use fsw_core::probe::SLOT_COUNT;
use fsw_core::time::{FRAME, MissionTime};
use fsw_core::units::rad;
use hil_sim::scenario::Scenario;

use crate::bound::Least;
pub use summary::{
    Computer, Corrector, DeployState, LinkCounters, MeasurementCounts, Milestone, Navigation, Nis, Peak, Summary,
};

/// Everything known about one flight once it is over.
#[derive(Clone, Debug)]
pub struct FlightRecord {
    /// The facts of the scenario that plots and checks need.
    pub facts: ScenarioFacts,
    /// Seed of the dispersions.
    pub seed: u64,
    /// Index of the run under that seed.
    pub run: u64,
    /// True when the dispersions were turned off.
    pub nominal: bool,
    /// True state, one sample per minor frame starting at t = 0, up to and including the deploy instant.
    pub truth: Vec<TruthSample>,
    /// Bank command and discretes, one per minor frame, as the flight computer sent them.
    pub actuators: Vec<Actuator>,
    /// Navigation telemetry with its time stamp, 10 Hz.
    pub nav: Vec<(MissionTime, NavTlm)>,
    /// Guidance telemetry with its time stamp, 1 Hz.
    pub guidance: Vec<(MissionTime, GuidanceTlm)>,
    /// Health telemetry with its time stamp, 1 Hz.
    pub health: Vec<(MissionTime, HealthTlm)>,
    /// Events in the order in which they arrived.
    pub events: Vec<Event>,
    /// Wall time the flight computer took per minor frame, µs; index 0 is frame 1. Empty when it runs elsewhere.
    pub frame_cost_us: Vec<f32>,
    /// The same by schedule slot, worst of the flight, ns.
    pub slot_worst_ns: [u32; SLOT_COUNT],
    /// Consistency of the navigation, one entry per [`FlightRecord::nav`] that has a true state at its time.
    pub nees: Vec<NeesSample>,
    /// The posterior Cramér–Rao bound at least at the epochs of [`FlightRecord::nav`]. Empty when it was not worked out, as of ideal navigation, which measures
    /// nothing.
    pub bound: Vec<Least>,
    /// How the flight ended.
    pub end: End,
    /// The figures of `summary.json`.
    pub summary: Summary,
}

impl FlightRecord {
    /// Keeps the bound of this flight, and in the summary what it is at the last epoch of the navigation.
    pub fn set_bound(&mut self, bound: Vec<Least>) {
        self.bound = bound;
        let last: Option<(f64, f64)> =
            self.nees.last().and_then(|epoch| self.least_at(epoch.time_s)).map(|least| least.rms().into());
        let navigation = &mut self.summary.navigation;
        (navigation.position_bound_m, navigation.velocity_bound_mps) = last.unzip();
    }

    /// The bound at a time, if it is known to within a frame.
    #[must_use]
    pub fn least_at(&self, time_s: f64) -> Option<&Least> {
        let half_frame_s = 0.5 * FRAME.as_s();
        let at = self.bound.partition_point(|least| least.time_s < time_s - half_frame_s);
        self.bound.get(at).filter(|least| (least.time_s - time_s).abs() < half_frame_s)
    }
}

/// Facts of the scenario, in SI and radians, that belong on plots and in checks.
#[derive(Clone, Debug)]
pub struct ScenarioFacts {
    /// Name of the scenario.
    pub name: String,
    /// Planet of the truth.
    pub planet: Planet,
    /// Longitude of the nominal entry point, rad: the start of the arc that defines downrange and crossrange.
    pub entry_longitude_rad: f64,
    /// Latitude of the nominal entry point, rad.
    pub entry_latitude_rad: f64,
    /// Target.
    pub target: Target,
    /// Trigger, floor and box of the deployment.
    pub deploy: DeployParameters,
    /// Kind of trigger.
    pub trigger: TriggerKind,
    /// Limits of load, heat flux and dynamic pressure.
    pub constraints: ConstraintParameters,
    /// Navigation algorithm.
    pub navigation: NavigationMode,
    /// Nose radius of the vehicle, m, for the heat flux.
    pub nose_radius_m: f64,
    /// Statistics of the sensors that fly, and of the density, in the terms of the flight software.
    pub sensors: NavigationParameters,
    /// Names of the radio sources by slot (orbiters first, then beacons).
    pub source_names: Vec<String>,
}

impl ScenarioFacts {
    /// The facts of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let planet = scenario.planet.si();
        let entry = scenario.entry.planet_relative(&planet);
        let (deploy, limits) = (&scenario.deploy, &scenario.deploy.limits);
        let orbiters = scenario.orbiter.iter().map(|o| o.name.clone());
        Self {
            name: scenario.name.clone(),
            planet,
            entry_longitude_rad: entry.longitude_rad,
            entry_latitude_rad: entry.latitude_rad,
            target: Target {
                longitude_rad: rad(scenario.target.longitude_deg),
                latitude_rad: rad(scenario.target.latitude_deg),
            },
            deploy: DeployParameters {
                speed_mps: deploy.speed_mps,
                window_min_speed_mps: deploy.speed_window_mps[0],
                window_max_speed_mps: deploy.speed_window_mps[1],
                floor_altitude_m: deploy.floor_altitude_km * 1e3,
                min_altitude_m: limits.altitude_km[0] * 1e3,
                max_altitude_m: limits.altitude_km[1] * 1e3,
                min_mach: limits.mach[0],
                max_mach: limits.mach[1],
                min_dynamic_pressure_pa: limits.dynamic_pressure_pa[0],
                max_dynamic_pressure_pa: limits.dynamic_pressure_pa[1],
            },
            trigger: deploy.trigger,
            constraints: ConstraintParameters {
                load_mps2: scenario.guidance.limits.load_g * STANDARD_GRAVITY_MPS2,
                heat_flux_wpm2: scenario.guidance.limits.heat_flux_wpm2,
                dynamic_pressure_pa: scenario.guidance.limits.dynamic_pressure_pa,
            },
            navigation: scenario.navigation.filter,
            nose_radius_m: scenario.vehicle.nose_radius_m,
            sensors: scenario.true_sensors(),
            source_names: orbiters.chain(scenario.beacon.iter().map(|b| b.name.clone())).collect(),
        }
    }
}

/// True state at the end of one minor frame; derived from [`Truth`] packets only, wherever the truth runs.
#[derive(Clone, Copy, Debug, Default)]
pub struct TruthSample {
    /// Time, s.
    pub time_s: f64,
    /// The packet.
    pub packet: Truth,
    /// Longitude, rad.
    pub longitude_rad: f64,
    /// Planetocentric latitude, rad.
    pub latitude_rad: f64,
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, rad, positive up.
    pub flight_path_angle_rad: f64,
    /// Heading, rad, clockwise from north.
    pub heading_rad: f64,
    /// Sensed load over the frame that ends here, g: change of velocity less gravity.
    pub load_g: f64,
    /// Convective heat flux at the stagnation point (Sutton–Graves), W/m².
    pub heat_flux_wpm2: f64,
    /// Great-circle distance to the target at the reference radius, m.
    pub range_to_go_m: f64,
}

/// Consistency of one navigation epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NeesSample {
    /// Time, s.
    pub time_s: f64,
    /// Normalised estimation error squared of inertial position and velocity: 6 on average when consistent.
    /// None when the covariance is not positive definite, as in the modes without a filter.
    pub nees: Option<f64>,
    /// Position error, inertial axes, estimate minus truth, m.
    pub position_error_m: [f64; 3],
    /// Velocity error, inertial axes, estimate minus truth, m/s.
    pub velocity_error_mps: [f64; 3],
    /// Standard deviations of the position error, inertial axes, m.
    pub position_sigma_m: [f64; 3],
    /// Standard deviations of the velocity error, inertial axes, m/s.
    pub velocity_sigma_mps: [f64; 3],
}

/// How a flight ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum End {
    /// The parachute was fired.
    Deployed,
    /// The surface was reached without a parachute.
    Ground,
    /// The time limit of the scenario was reached.
    TimeLimit,
    /// The user stopped the flight.
    Interrupted,
    /// The link or an end of it failed; one sentence says how.
    Failed(String),
}

impl End {
    /// The word for it in `summary.json`.
    #[must_use]
    pub fn word(&self) -> &'static str {
        match self {
            Self::Deployed => "deployed",
            Self::Ground => "ground",
            Self::TimeLimit => "time limit",
            Self::Interrupted => "interrupted",
            Self::Failed(_) => "failed",
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Facts of the default scenario.
    pub(crate) fn facts() -> ScenarioFacts {
        ScenarioFacts::of(&Scenario::builtin("msl").expect("the default scenario resolves"))
    }
}
