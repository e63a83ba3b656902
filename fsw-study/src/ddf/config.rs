//! What P2 leaves open, with the values that the project's reference figures were made with.

use alloc::vec;
use alloc::vec::Vec;

use fsw_core::math::fun;
use fsw_core::nav::estimators::models::Spherical;
use fsw_core::units::rad;
use serde::{Deserialize, Serialize};

use super::filters::Kind;

#[cfg(feature = "std")]
mod check;

/// States: r, v, γ, θ, λ, ψ.
pub const STATES: usize = 6;
/// Parameters: errors of τ = ρB and of the lift-to-drag ratio.
pub const PARAMETERS: usize = 2;
/// Radius from which P2 counts altitude, m.
pub const SURFACE_M: f64 = 3_397_200.0;

/// The experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Length, step, noise.
    pub experiment: Experiment,
    /// True state at the start.
    pub entry: Entry,
    /// How well the filters know it, 1 σ.
    pub initial: Initial,
    /// What the filters do not know.
    pub truth: Truth,
    /// What is measured, how well.
    pub sensors: Sensors,
    /// What the filters are told.
    pub filters: Filters,
    /// What the tuned EKFs are searched over.
    pub tuning: Tuning,
}

/// Length, step, noise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Experiment {
    /// Duration, s.
    pub duration_s: f64,
    /// Step of truth, measurements and filters, s.
    pub step_s: f64,
    /// Bank, constant, deg.
    pub bank_deg: f64,
    /// Process noise of the truth, and Q of all filters: m, m/s and rad per √s.
    pub process_noise: [f64; STATES],
    /// Means over time begin here, s.
    pub average_from_s: f64,
    /// A run whose position error is beyond this after that time has diverged, m.
    pub divergence_m: f64,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            duration_s: 400.0,
            step_s: 0.2,
            bank_deg: 50.0,
            process_noise: [0.1, 0.02, 1e-6, 1e-8, 1e-8, 1e-6],
            average_from_s: 20.0,
            divergence_m: 100e3,
        }
    }
}

/// P1's Table 1, whose vehicle and entry P2 shares.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Entry {
    /// Altitude over 3397.2 km, km.
    pub altitude_km: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, deg.
    pub path_angle_deg: f64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Latitude, deg.
    pub latitude_deg: f64,
    /// Heading, deg.
    pub heading_deg: f64,
}

impl Default for Entry {
    fn default() -> Self {
        Self {
            altitude_km: 125.0,
            speed_mps: 6_900.0,
            path_angle_deg: -12.0,
            longitude_deg: 0.0,
            latitude_deg: 1.0,
            heading_deg: 89.0,
        }
    }
}

/// Standard deviations of the filters' start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Initial {
    /// Altitude, m.
    pub altitude_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, deg.
    pub path_angle_deg: f64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Latitude, deg.
    pub latitude_deg: f64,
    /// Heading, deg.
    pub heading_deg: f64,
}

impl Default for Initial {
    fn default() -> Self {
        Self {
            altitude_m: 1_000.0,
            speed_mps: 50.0,
            path_angle_deg: 0.2,
            longitude_deg: 0.02,
            latitude_deg: 0.02,
            heading_deg: 0.2,
        }
    }
}

/// True parameters; those of the filters are zero.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Truth {
    /// Δτ, attributed to the density.
    pub density_error: f64,
    /// Δ(L/D).
    pub lift_error: f64,
}

impl Default for Truth {
    fn default() -> Self {
        Self { density_error: 0.15, lift_error: 0.10 }
    }
}

/// What is measured in every step: three accelerations, the dynamic pressure, the range to an orbiter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Readings a second; a whole number of steps lies between two. Left out, as in P2: after every step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Noise of each acceleration, m/s².
    pub accelerometer_mps2: f64,
    /// Their bias, which the filters do not know, m/s².
    pub accelerometer_bias_mps2: f64,
    /// Noise of the pressure, Pa.
    pub pressure_pa: f64,
    /// And in proportion to it.
    pub pressure_relative: f64,
    /// Noise of the range, m.
    pub range_m: f64,
    /// Orbiter at the start, km.
    pub orbiter_km: [f64; 3],
    /// Its velocity, m/s.
    pub orbiter_mps: [f64; 3],
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            rate_hz: None,
            accelerometer_mps2: 0.05,
            accelerometer_bias_mps2: 0.003,
            pressure_pa: 10.0,
            pressure_relative: 0.01,
            range_m: 50.0,
            orbiter_km: [7_855.7, -461.8, 749.82],
            orbiter_mps: [66.2, 2_206.4, -413.0],
        }
    }
}

/// What one unit of each result is, in a degree of nonlinearity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Units {
    /// m, m/s, rad, Pa …, as in P2: the sum is that of the largest numbers, positions and pressures.
    Raw,
    /// Standard deviations: of the start for states, of the noise for measurements.
    Deviations,
}

/// What the filters are told.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Filters {
    /// Which are flown.
    pub fly: Vec<Kind>,
    /// Diagonal of W.
    pub weights: [f64; PARAMETERS],
    /// Thresholds of the rank-sampled degree of nonlinearity; the middle one counts where one is meant.
    pub rank_thresholds: Vec<f64>,
    /// Its units.
    pub rank_units: Units,
    /// Thresholds of the degree of nonlinearity from the difference points, likewise.
    pub free_thresholds: Vec<f64>,
    /// A measurement beyond so many deviations is not taken in; infinite: all are.
    pub gate_sigma: f64,
    /// The tuned EKF.
    pub tuned: Factors,
    /// The EKF that is tuned for forces.
    pub forces: Factors,
}

/// What tunes an EKF.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factors {
    /// Factor on the deviations of its process noise.
    pub process: f64,
    /// Factor on the deviations that it believes of accelerations and pressure.
    pub sensors: f64,
}

impl Default for Filters {
    fn default() -> Self {
        Self {
            fly: Kind::ALL.to_vec(),
            weights: [0.5, 0.01],
            rank_thresholds: vec![0.003, 0.005, 0.01],
            rank_units: Units::Raw,
            free_thresholds: vec![0.06, 0.07, 0.075],
            gate_sigma: f64::INFINITY,
            // The best of `search` over the default grid.
            tuned: Factors { process: 1_000.0, sensors: 1.0 },
            forces: Factors { process: 10.0, sensors: 1.0 },
        }
    }
}

/// The search for the tuned EKFs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tuning {
    /// Factors on the process noise that are tried.
    pub process: Vec<f64>,
    /// Factors on the noise of accelerations and pressure.
    pub sensors: Vec<f64>,
    /// Seed of its runs, which are not those of the study.
    pub seed: u64,
    /// Runs of each pair.
    pub runs: u64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            process: vec![1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1_000.0, 3_000.0, 10_000.0],
            sensors: vec![1.0, 3.0, 10.0, 30.0, 100.0],
            seed: 1_000_001,
            runs: 20,
        }
    }
}

impl Config {
    /// Steps of a flight.
    #[must_use]
    pub fn steps(&self) -> usize {
        fun::round(self.experiment.duration_s / self.experiment.step_s) as usize
    }

    /// First step that counts in means over time.
    #[must_use]
    pub fn first_counted(&self) -> usize {
        -fun::floor(-self.experiment.average_from_s / self.experiment.step_s) as usize
    }

    /// P2's Mars and vehicle.
    #[must_use]
    pub fn model(&self) -> Spherical {
        Spherical::MARS.banked(rad(self.experiment.bank_deg))
    }

    /// x = [r, v, γ, θ, λ, ψ] at the start, true.
    #[must_use]
    pub fn start(&self) -> [f64; STATES] {
        let e = &self.entry;
        let [gamma, theta, lambda, psi] = [e.path_angle_deg, e.longitude_deg, e.latitude_deg, e.heading_deg].map(rad);
        [SURFACE_M + 1e3 * e.altitude_km, e.speed_mps, gamma, theta, lambda, psi]
    }

    /// Standard deviations of the filters' start, in SI units.
    #[must_use]
    pub fn initial_sigmas(&self) -> [f64; STATES] {
        let i = &self.initial;
        let [gamma, theta, lambda, psi] = [i.path_angle_deg, i.longitude_deg, i.latitude_deg, i.heading_deg].map(rad);
        [i.altitude_m, i.speed_mps, gamma, theta, lambda, psi]
    }

    /// Standard deviations of the process noise of a step.
    #[must_use]
    pub fn step_noise(&self) -> [f64; STATES] {
        self.experiment.process_noise.map(|sigma| sigma * fun::sqrt(self.experiment.step_s))
    }
}
