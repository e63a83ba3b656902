//! What the study flies: a TOML with a default for everything; the defaults are P3's numbers and, where P3 gives none, the
//! choices that the page names.

use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

#[cfg(feature = "std")]
mod check;
mod defaults;

/// Most models of a bank.
pub const MOST_MODELS: usize = 21;

/// The whole study.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Which filters are ranked.
    pub filters: Filters,
    /// Where entries begin.
    pub entry: Entry,
    /// How long they fly and in which steps.
    pub flight: Flight,
    /// The planet, its air, the vehicle.
    pub world: World,
    /// Circular orbit of the radio's other end.
    pub orbiter: Orbiter,
    /// Noise of the sensors.
    pub sensors: Sensors,
    /// Law of the density's error.
    pub density: Density,
    /// The bank.
    pub bank: Models,
    /// Filters that estimate the density.
    pub augmented: Augmented,
    /// P3's special case: one density, all else known exactly.
    pub fixed: Fixed,
    /// P3's Table 5.
    pub table5: Table5,
    /// The ranking against the bound.
    pub ranking: Rated,
    /// The augmented filter against the bound, on more entries.
    pub efficiency: Efficiency,
    /// Density in waves and a biased accelerometer.
    pub robust: Robust,
}

/// The filters of the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Filters {
    /// Which are flown, in the order of the tables.
    pub fly: Vec<FilterName>,
}

/// A filter of the study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FilterName {
    /// Integrated accelerometer, no correction.
    DeadReckoning,
    /// One EKF with the nominal density.
    Ekf,
    /// Schmidt's filter: the density's uncertainty counts, and is not estimated.
    Schmidt,
    /// P3: bank of EKFs, normalised gating, for each learning rate.
    Gating,
    /// The same without normalisation.
    BareGating,
    /// The same bank with a product of densities.
    BareProduct,
    /// The same bank with Bayes' weights in logarithms.
    Bayes,
    /// A finer bank with them.
    BayesFine,
    /// Interacting multiple model over the same densities.
    Imm,
    /// EKF that estimates the logarithm of the density's error.
    Augmented,
    /// Bank of such filters.
    Experts,
    /// EKF with the density as a Gauss–Markov process, and biases of the accelerometer.
    GaussMarkov,
}

impl FilterName {
    /// All of them, from the plainest on.
    pub const ALL: [Self; 12] = [
        Self::DeadReckoning,
        Self::Ekf,
        Self::Schmidt,
        Self::Gating,
        Self::BareGating,
        Self::BareProduct,
        Self::Bayes,
        Self::BayesFine,
        Self::Imm,
        Self::Augmented,
        Self::Experts,
        Self::GaussMarkov,
    ];

    /// As in the TOML.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::DeadReckoning => "dead-reckoning",
            Self::Ekf => "ekf",
            Self::Schmidt => "schmidt",
            Self::Gating => "gating",
            Self::BareGating => "bare-gating",
            Self::BareProduct => "bare-product",
            Self::Bayes => "bayes",
            Self::BayesFine => "bayes-fine",
            Self::Imm => "imm",
            Self::Augmented => "augmented",
            Self::Experts => "experts",
            Self::GaussMarkov => "gauss-markov",
        }
    }
}

/// What Table 1's deviations mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Reading {
    /// Three standard deviations, as the table's head says.
    A,
    /// One, as Table 5 suggests.
    B,
}

impl Reading {
    /// Table values in a standard deviation.
    #[must_use]
    pub const fn divisor(self) -> f64 {
        match self {
            Self::A => 3.0,
            Self::B => 1.0,
        }
    }
}

/// P3 Table 1, inertial axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Entry {
    /// Nominal position.
    pub position_m: [f64; 3],
    /// Nominal velocity.
    pub velocity_mps: [f64; 3],
    /// The table's deviations.
    pub deviation_m: [f64; 3],
    /// The table's deviations.
    pub deviation_mps: [f64; 3],
}

/// Steps and end.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Flight {
    /// Step of the filters.
    pub step_s: f64,
    /// Steps of the truth in one of the filters'.
    pub truth_substeps: u32,
    /// The parachute opens when the true speed in the air falls to this.
    pub deploy_mps: f64,
    /// Bank, 0 lift up.
    pub bank_deg: f64,
    /// Longest flight.
    pub longest_s: f64,
    /// Between instants that are drawn.
    pub record_s: f64,
    /// A position error at the end beyond which a filter counts as diverged.
    pub divergence_m: f64,
}

/// P3 section 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct World {
    /// Gravitational parameter.
    pub mu_m3ps2: f64,
    /// Spin about z.
    pub spin_radps: f64,
    /// Density at the reference radius.
    pub density_kgpm3: f64,
    /// Reference radius.
    pub reference_radius_m: f64,
    /// Scale height.
    pub scale_height_m: f64,
    /// Ballistic coefficient.
    pub ballistic_kgpm2: f64,
    /// Lift over drag.
    pub lift_to_drag: f64,
}

/// P3 Table 3.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Orbiter {
    /// Radius of the circle.
    pub radius_m: f64,
    /// Inclination.
    pub inclination_deg: f64,
    /// Right ascension of the node.
    pub node_deg: f64,
    /// Argument of latitude at entry.
    pub argument_deg: f64,
}

/// P3 Table 2 and section 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Pressure, over the reading.
    pub pressure_share: f64,
    /// Accelerometer, each axis.
    pub accelerometer_ug: f64,
    /// Range.
    pub range_m: f64,
    /// Range rate.
    pub range_rate_mps: f64,
}

/// How the true density's error Δ is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Law {
    /// Uniform between −width and +width.
    Uniform,
    /// Normal with a third of the width as standard deviation.
    Normal,
}

/// The density's error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Density {
    /// Its law.
    pub law: Law,
    /// Its width.
    pub width: f64,
}

/// The banks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Models {
    /// Δ of each model (Table 4).
    pub densities: Vec<f64>,
    /// The same of the finer bank.
    pub fine_densities: Vec<f64>,
    /// Learning rates η of the gating.
    pub rates: Vec<f64>,
    /// Process noise of the bank's EKFs, (m/s)/√s.
    pub noise_mpsps: f64,
    /// Least weight of Bayes' rule.
    pub floor: f64,
    /// Probability that the interacting models do not switch in a step.
    pub stay: f64,
    /// Divisors of pressure, force, range and range rate for the gating.
    pub scales: [f64; 4],
}

/// Filters that estimate the density.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Augmented {
    /// Random walk of ln(1 + Δ), 1/√s; 0: a constant.
    pub walk_psqrts: f64,
    /// Experts of the bank of augmented filters, over equal cells of the density's width.
    pub experts: usize,
    /// Gauss–Markov: standard deviation of ln(1 + Δ).
    pub markov_sigma: f64,
    /// Gauss–Markov: correlation time.
    pub markov_s: f64,
    /// Prior of the accelerometer's biases.
    pub bias_ug: f64,
}

/// P3's special case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Fixed {
    /// The true Δ.
    pub density: f64,
    /// Learning rate, scenario 1 and 2.
    pub rates: [f64; 2],
    /// What Table 1 means.
    pub reading: Reading,
    /// Readings a second.
    pub rate_hz: f64,
}

/// P3's Monte Carlo.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Table5 {
    /// Learning rate, scenario 1 and 2.
    pub rates: [f64; 2],
    /// What Table 1 means.
    pub reading: Reading,
    /// Readings a second.
    pub rate_hz: f64,
}

/// A case with its rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Rated {
    /// What Table 1 means.
    pub reading: Reading,
    /// Readings a second.
    pub rate_hz: f64,
}

/// The augmented filter alone against the bound: a ratio near one takes more entries to tell from one than a ranking does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Efficiency {
    /// Runs, over those of the ranking, the first of which are the ranking's own; 0 leaves it out.
    pub share_of_runs: f64,
}

/// What no model of the bank knows of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Robust {
    /// Amplitude of a sine of the density in altitude, over the density.
    pub wave: f64,
    /// Its wavelength.
    pub wavelength_m: f64,
    /// Standard deviation of a constant bias on each axis of the accelerometer.
    pub bias_ug: f64,
    /// Runs, over those of the ranking.
    pub share_of_runs: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Stored;

    #[test]
    fn the_defaults_are_in_range_and_come_back_from_toml() {
        let config = Config::default();
        config.check().unwrap();
        let text = toml::to_string(&config).unwrap();
        assert_eq!(Config::from_toml(&text).unwrap(), config);
        assert_eq!(Config::from_toml("").unwrap(), config);
    }

    #[test]
    fn names_are_those_of_the_toml() {
        for filter in FilterName::ALL {
            let text = format!("filters.fly = [\"{}\"]", filter.name());
            assert_eq!(Config::from_toml(&text).unwrap().filters.fly, [filter]);
        }
    }

    #[test]
    fn what_is_wrong_is_said_in_one_sentence_with_its_name() {
        for (text, words) in [
            ("[ranking]\nrate_hz = 0.0", "ranking.rate_hz is 0"),
            ("[ranking]\nrate_hz = 3.0", "whole number of steps"),
            ("[ranking]\nrate_hz = 20.0", "whole number of steps"),
            ("[bank]\ndensities = []", "bank.densities must hold at least one value"),
            ("[bank]\ndensities = [0.0]", "bank.densities holds 1 model; a bank has 2 to 21"),
            ("[flight]\nlongest_s = 1.0", "flight.longest_s is 1; an entry in nominal air takes 360."),
            ("[filters]\nfly = [\"ekf\", \"ekf\"]", "filters.fly[1] names ekf twice"),
            ("[sensors]\nrange_m = 0.0", "sensors.range_m is 0"),
            ("[sensors]\naccelerometer_ug = -1.0", "sensors.accelerometer_ug is -1"),
            ("[sensors]\npressure_share = nan", "sensors.pressure_share is NaN"),
            ("[filters]\nfly = [\"kalman\"]", "unknown variant `kalman`"),
            ("filters = []", "filters must be a table"),
            ("[filters]\nfly = []", "at least one filter"),
            ("[table5]\nreading = \"C\"", "table5.reading"),
            ("[bank]\nrates = [0.1, -1.0]", "bank.rates[1] is -1"),
            ("sigma = 1", "unknown field `sigma`"),
        ] {
            let said = Config::from_toml(text).unwrap_err();
            assert!(said.contains(words) && !said.contains('\n'), "{said}");
        }
    }
}
