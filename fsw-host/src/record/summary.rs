//! [`Summary`], the content of `summary.json`: units are in the names of its fields, SI where there is none.

use fsw_core::link::packet::RejectCounters;
use serde::{Deserialize, Serialize};

use crate::cost::Cost;
use crate::realtime::RealTime;

/// Content of `summary.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Scenario.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// Run under that seed.
    pub run: u64,
    /// Dispersions off.
    pub nominal: bool,
    /// True when the parachute was fired inside the deploy box.
    pub success: bool,
    /// How the flight ended, see [`End::word`](super::End::word).
    pub outcome: String,
    /// Why the flight is no success, one sentence.
    pub reason: Option<String>,
    /// Great-circle distance at the reference radius from the deploy point to the target, m.
    pub miss_m: Option<f64>,
    /// Downrange error at deployment, m, positive beyond the target.
    pub downrange_error_m: Option<f64>,
    /// Crossrange error at deployment, m, positive right of the arc from the nominal entry point to the target.
    pub crossrange_error_m: Option<f64>,
    /// The milestones of the flight in order.
    pub timeline: Vec<Milestone>,
    /// True conditions at deployment.
    pub deploy: Option<DeployState>,
    /// Largest values along the true path.
    pub peak: Peak,
    /// Bank reversals commanded.
    pub reversals: u32,
    /// Work of the corrector.
    pub corrector: Corrector,
    /// Errors of the navigation.
    pub navigation: Navigation,
    /// Rejected and lost packets by cause, as the flight computer counted them.
    pub link: LinkCounters,
    /// Where the flight software ran and what it was.
    pub computer: Computer,
    /// What the flight software cost there; none when it was not measured.
    pub cost: Option<Cost>,
    /// How the schedule was kept, of a flight by the wall clock.
    pub realtime: Option<RealTime>,
    /// Minor frames flown.
    pub frames: u32,
    /// SHA-256 over time and packet of all Actuator, NavTlm, GuidanceTlm and Event packets.
    pub output_hash: String,
    /// Wall time of the flight, s.
    pub wall_s: f64,
}

/// Where the flight software ran and what it was.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Computer {
    /// `in-process`, `qemu:…` or `serial:…`.
    pub place: String,
    /// Identity of the build, as the flight computer said it in its greeting, hexadecimal.
    pub build_id: Option<String>,
    /// File of the image that ran.
    pub image: Option<String>,
    /// SHA-256 of what the image puts into memory, hexadecimal.
    pub image_sha256: Option<String>,
}

/// One milestone of the flight with the true state at its time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Milestone {
    /// What happened.
    pub event: String,
    /// Time, s.
    pub time_s: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
}

/// True conditions at deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DeployState {
    /// Time, s.
    pub time_s: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Air-relative Mach number.
    pub mach: f64,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Planetocentric latitude, deg.
    pub latitude_deg: f64,
}

/// Largest values along the true path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// Sensed load, g.
    pub load_g: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Heat flux, W/m².
    pub heat_flux_wpm2: f64,
}

/// Work of the corrector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Corrector {
    /// Most iterations of a cycle.
    pub max_iterations: u32,
    /// Mean iterations of the cycles that corrected.
    pub mean_iterations: f64,
    /// Most evaluations of the equations of motion in a cycle.
    pub max_integrations: u32,
    /// Their hard bound.
    pub bound: u32,
}

/// Errors of the navigation against the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Navigation {
    /// Position error at the last epoch, m.
    pub position_error_m: Option<f64>,
    /// Velocity error at the last epoch, m/s.
    pub velocity_error_mps: Option<f64>,
    /// Standard deviation of the position that the filter states then, root sum of squares of the axes, m; none without one.
    pub position_sigma_m: Option<f64>,
    /// The same of the velocity, m/s.
    pub velocity_sigma_mps: Option<f64>,
    /// Posterior Cramér–Rao bound of the position then, the least root mean square error, m; none when not worked out.
    pub position_bound_m: Option<f64>,
    /// The same of the velocity, m/s.
    pub velocity_bound_mps: Option<f64>,
    /// Mean over the flight of the normalised estimation error squared of position and velocity: 6 is consistent.
    pub nees_mean: Option<f64>,
    /// Share of epochs whose error lies inside the 95 % band of its covariance.
    pub inside_95_share: Option<f64>,
    /// Mean normalised innovation squared of the measurements used, per kind of sensor: 1 is consistent.
    pub nis_mean: Nis,
    /// Number of measurements used, per kind of sensor.
    pub used: MeasurementCounts,
    /// Number of measurements gated, per kind of sensor.
    pub gated: MeasurementCounts,
}

/// Mean normalised innovation squared per kind of sensor; none when the kind was not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Nis {
    /// Stagnation pressure.
    pub pressure: Option<f64>,
    /// Range.
    pub range: Option<f64>,
    /// Range-rate.
    pub range_rate: Option<f64>,
}

/// Counts per kind of sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeasurementCounts {
    /// Stagnation pressure.
    pub pressure: u32,
    /// Range.
    pub range: u32,
    /// Range-rate.
    pub range_rate: u32,
}

/// The link as both ends counted it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkCounters {
    /// By cause, from the last health packet of the flight computer.
    pub rejected: RejectCounters,
    /// Frames from the flight computer that the host could not decode.
    pub downlink_rejected: u32,
    /// Bytes to the flight computer.
    pub uplink_bytes: u64,
    /// Bytes from the flight computer.
    pub downlink_bytes: u64,
}
