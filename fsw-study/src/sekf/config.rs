//! What P1 leaves open, as a TOML file: every field has the default of the reference figures.

use alloc::vec;
use alloc::vec::Vec;

use fsw_core::math::fun;
use serde::{Deserialize, Serialize};

use super::STATES;
use super::kind::Kind;
use super::table1::Table1;
use crate::rate::steps_between;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Config {
    /// Time and flight.
    pub experiment: Experiment,
    /// The unknown input.
    pub input: Input,
    /// Sensors.
    pub sensors: Sensors,
    /// True start and vehicle (Table 1, "true").
    pub truth: Table1,
    /// Start of the filters, and their vehicle in the case of wrong parameters (Table 1, "initial").
    pub initial: Table1,
    /// Settings of the filters.
    pub filters: Filters,
    /// The search for the tuned settings.
    pub tuning: Tuning,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            experiment: Experiment::default(),
            input: Input::default(),
            sensors: Sensors::default(),
            truth: Table1::TRUE,
            initial: Table1::INITIAL,
            filters: Filters::default(),
            tuning: Tuning::default(),
        }
    }
}

/// Time and flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Step of truth, filters and measurements, s.
    pub step_s: f64,
    /// Length of the flight, s.
    pub duration_s: f64,
    /// Root mean square errors are averaged from here to the end, s.
    pub average_from_s: f64,
    /// Bank, deg, constant.
    pub bank_deg: f64,
    /// True process noise, and that of the untuned filters, standard deviations over √s: m, m/s, rad, rad, rad, rad.
    pub process_noise: [f64; STATES],
    /// Position error beyond which a run counts as diverged, m.
    pub divergence_m: f64,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            step_s: 1.0,
            duration_s: 400.0,
            average_from_s: 20.0,
            bank_deg: 50.0,
            process_noise: [0.1, 0.02, 1e-6, 1e-8, 1e-8, 1e-6],
            divergence_m: 100e3,
        }
    }
}

/// The unknown input b = amplitude · α(t), a rate (P1 §3 and Fig. 1, which shows α without its values).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Per second: m, m/s, rad, rad, rad, rad.
    pub amplitude: [f64; STATES],
    /// α, piece by piece; the last piece holds to the end.
    pub profile: Vec<f64>,
    /// Length of a piece, s.
    pub piece_s: f64,
}

impl Default for Input {
    fn default() -> Self {
        Self {
            amplitude: [30.0, 4.0, 1e-4, 1e-5, 1e-5, 1e-4],
            profile: vec![0.0, 1.0, -1.0, 0.5, -0.5, 0.0, 1.0, -1.0],
            piece_s: 50.0,
        }
    }
}

impl Input {
    /// α at a time.
    #[must_use]
    pub fn alpha(&self, time_s: f64) -> f64 {
        self.profile.get(self.piece(time_s)).copied().unwrap_or(0.0)
    }

    /// Which piece holds at a time.
    #[must_use]
    pub fn piece(&self, time_s: f64) -> usize {
        ((time_s / self.piece_s) as usize).min(self.profile.len().saturating_sub(1))
    }

    /// Root mean square of each component of b over the pieces.
    #[must_use]
    pub fn root_mean_square(&self) -> [f64; STATES] {
        let mean = self.profile.iter().map(|alpha| alpha * alpha).sum::<f64>() / self.profile.len().max(1) as f64;
        self.amplitude.map(|amplitude| amplitude * fun::sqrt(mean))
    }
}

/// Sensors: how often, standard deviations, and the accelerometer's bias.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Readings a second; a whole number of steps lies between two. Left out, as in P1: in every step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Accelerometer, m/s².
    pub accelerometer_mps2: f64,
    /// Its constant bias on each axis, m/s²; the filters do not know of it.
    pub accelerometer_bias_mps2: f64,
    /// Ranges to orbiter and beacons, m.
    pub range_m: f64,
    /// Flight-path angle and heading, deg.
    pub angle_deg: f64,
    /// Orbiter at the start, km.
    pub orbiter_km: [f64; 3],
    /// Its velocity, m/s.
    pub orbiter_mps: [f64; 3],
    /// Surface beacons, km; used below the horizon too, as the paper does.
    pub beacons_km: Vec<[f64; 3]>,
}

impl Default for Sensors {
    fn default() -> Self {
        Self {
            rate_hz: None,
            accelerometer_mps2: 0.03,
            accelerometer_bias_mps2: -0.03,
            range_m: 50.0,
            angle_deg: 0.1,
            orbiter_km: [7_855.7, -461.8, 749.82],
            orbiter_mps: [66.2, 2_206.4, -413.0],
            beacons_km: vec![[3_300.0, 420.0, 1_350.0], [3_290.0, 570.0, 755.0]],
        }
    }
}

impl Config {
    /// Steps of the flight.
    #[must_use]
    pub fn steps(&self) -> usize {
        fun::round(self.experiment.duration_s / self.experiment.step_s) as usize
    }

    /// First step (from 0) whose error is averaged, and from which a run can count as diverged.
    #[must_use]
    pub fn first_averaged(&self) -> usize {
        -fun::floor(-self.experiment.average_from_s / self.experiment.step_s) as usize
    }

    /// Steps from one reading to the next.
    #[must_use]
    pub fn steps_per_reading(&self) -> usize {
        steps_between(self.sensors.rate_hz, self.experiment.step_s)
    }
}

/// Settings that are no matter of tuning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filters {
    /// Which filters are flown, the EKF among them: the others are set against it.
    pub fly: Vec<Kind>,
    /// Step k from which the SEKF calibrates itself (P1: 3).
    pub sekf_start_step: usize,
    /// The same of the late SEKF, as a time, s: after the pull-in from the initial error.
    pub late_start_s: f64,
    /// Initial deviation of an estimated input, in amplitudes of the input.
    pub input_sigma: f64,
    /// Correlation time of the considered input, s.
    pub considered_correlation_s: f64,
    /// Initial deviation of the density error δτ.
    pub density_sigma: f64,
    /// Initial deviation of the error of the lift-to-drag ratio δl.
    pub lift_sigma: f64,
    /// Size of an accelerometer bias that the filters allow for: those that do not estimate it add its square to the
    /// variance of the accelerometer, AEKF-17 starts its estimate with it, m/s².
    pub bias_sigma_mps2: f64,
    /// Settings of the untuned cases.
    pub untuned: Settings,
}

impl Default for Filters {
    fn default() -> Self {
        Self {
            fly: Kind::ALL.to_vec(),
            sekf_start_step: 3,
            late_start_s: 20.0,
            input_sigma: 0.5,
            considered_correlation_s: 50.0,
            density_sigma: 0.2,
            lift_sigma: 0.1,
            bias_sigma_mps2: 0.03,
            untuned: Settings::default(),
        }
    }
}

/// What is searched for each filter in each tuned case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Process noise over √s added to the true one, in amplitudes of the unknown input.
    pub process: f64,
    /// Factor on the accelerometer's deviation that the filter assumes.
    pub accelerometer: f64,
    /// Walk of the estimated input over √s, or deviation of the considered input, in amplitudes; ρ of the SEKF-ρ.
    pub input: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { process: 0.0, accelerometer: 1.0, input: 0.3 }
    }
}

/// The search for each filter: every combination of the grid on a few runs, then from the best of them one setting after
/// the other up and down by ever smaller factors, on more runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tuning {
    /// Seed; another than that of the figures.
    pub seed: u64,
    /// Runs for each combination of the grid.
    pub grid_runs: u64,
    /// Runs for each step of the refinement.
    pub runs: u64,
    /// Factors of the refinement, largest first.
    pub factors: Vec<f64>,
    /// Values of [`Settings::process`].
    pub process: Vec<f64>,
    /// Values of [`Settings::accelerometer`].
    pub accelerometer: Vec<f64>,
    /// Values of [`Settings::input`], for filters that have one.
    pub input: Vec<f64>,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            seed: 1_001,
            grid_runs: 12,
            runs: 100,
            factors: vec![1.5, 1.2, 1.1],
            process: vec![0.0, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8],
            accelerometer: vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0],
            input: vec![0.06, 0.12, 0.25, 0.5, 1.0, 2.0],
        }
    }
}
