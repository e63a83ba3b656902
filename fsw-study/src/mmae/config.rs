//! What the study flies: a TOML with a default for everything; the defaults are P3's numbers and, where P3 gives none, the
//! choices that the page names.

use serde::{Deserialize, Serialize};

use crate::settings::{each, parse, within};

/// Most models of a bank.
pub const MOST_MODELS: usize = 21;

/// The whole study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Filters of the ranking, in the order of the tables.
    pub filters: Vec<FilterName>,
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
    /// Density in waves and a biased accelerometer.
    pub robust: Robust,
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
    pub diverged_m: f64,
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

impl Default for Config {
    fn default() -> Self {
        Self {
            filters: FilterName::ALL.to_vec(),
            entry: Entry::default(),
            flight: Flight::default(),
            world: World::default(),
            orbiter: Orbiter::default(),
            sensors: Sensors::default(),
            density: Density::default(),
            bank: Models::default(),
            augmented: Augmented::default(),
            fixed: Fixed::default(),
            table5: Table5::default(),
            ranking: Rated::default(),
            robust: Robust::default(),
        }
    }
}

impl Default for Entry {
    fn default() -> Self {
        Self {
            position_m: [-2_102_033.0, 2_816_074.0, -238_991.0],
            velocity_mps: [994.910, -781.820, 5_950.410],
            deviation_m: [1_015.0, 604.0, 1_714.0],
            deviation_mps: [2.149, 0.667, 0.106],
        }
    }
}

impl Default for Flight {
    fn default() -> Self {
        Self {
            step_s: 0.1,
            truth_substeps: 5,
            deploy_mps: 406.0,
            bank_deg: 0.0,
            longest_s: 600.0,
            record_s: 2.0,
            diverged_m: 20_000.0,
        }
    }
}

impl Default for World {
    fn default() -> Self {
        Self {
            mu_m3ps2: 4.2828e13,
            spin_radps: 7.0882e-5,
            density_kgpm3: 2e-4,
            reference_radius_m: 3_437_200.0,
            scale_height_m: 7_500.0,
            ballistic_kgpm2: 146.0,
            lift_to_drag: 0.24,
        }
    }
}

impl Default for Orbiter {
    fn default() -> Self {
        Self { radius_m: 3.7e6, inclination_deg: 90.0, node_deg: 127.3, argument_deg: 355.0 }
    }
}

impl Default for Sensors {
    fn default() -> Self {
        Self { pressure_share: 0.05, accelerometer_ug: 3_000.0, range_m: 100.0, range_rate_mps: 0.1 }
    }
}

impl Default for Density {
    fn default() -> Self {
        Self { law: Law::Uniform, width: 0.1 }
    }
}

impl Default for Models {
    fn default() -> Self {
        let fine = (-10..=10).map(|hundredths| 0.01 * f64::from(hundredths));
        Self {
            densities: vec![-0.10, -0.06, -0.02, 0.0, 0.02, 0.06, 0.10],
            fine_densities: fine.collect(),
            rates: vec![0.01, 0.1, 1.0],
            noise_mpsps: 0.0,
            floor: 0.0,
            stay: 0.999,
            scales: [636.0, 3.711, 3_389_500.0, 3_546.6],
        }
    }
}

impl Default for Augmented {
    fn default() -> Self {
        // The prior's 0.058 with the waves' 0.014 on it; within a minute, that of the peak load, the process walks as far as waves go.
        Self { walk_psqrts: 0.0, experts: 7, markov_sigma: 0.06, markov_s: 3_000.0, bias_ug: 3_000.0 }
    }
}

impl Default for Fixed {
    fn default() -> Self {
        Self { density: 0.095, rates: [0.1, 0.01], reading: Reading::A, rate_hz: 10.0 }
    }
}

impl Default for Table5 {
    fn default() -> Self {
        Self { rates: [1.0, 0.1], reading: Reading::B, rate_hz: 1.0 }
    }
}

impl Default for Rated {
    fn default() -> Self {
        Self { reading: Reading::A, rate_hz: 10.0 }
    }
}

impl Default for Robust {
    fn default() -> Self {
        Self { wave: 0.02, wavelength_m: 10_000.0, bias_ug: 3_000.0, share_of_runs: 1.0 }
    }
}

impl Config {
    /// The settings of a TOML file, checked.
    ///
    /// # Errors
    /// One sentence for the first thing that is wrong.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let config: Self = parse(text)?;
        config.check()?;
        Ok(config)
    }

    /// Ok when everything is in range.
    ///
    /// # Errors
    /// One sentence for the first thing that is not.
    pub fn check(&self) -> Result<(), String> {
        if self.filters.is_empty() {
            return Err("filters must name at least one filter".to_owned());
        }
        self.check_flight()?;
        self.check_world()?;
        self.check_bank()?;
        for (name, rate_hz) in [
            ("fixed.rate_hz", self.fixed.rate_hz),
            ("table5.rate_hz", self.table5.rate_hz),
            ("ranking.rate_hz", self.ranking.rate_hz),
        ] {
            within(name, rate_hz, 0.01, 1e3)?;
            let steps = 1.0 / (rate_hz * self.flight.step_s);
            if steps < 1.0 - 1e-9 || (steps - steps.round()).abs() > 1e-9 {
                return Err(format!(
                    "{name} is {rate_hz}; between readings there must be a whole number of steps of {} s",
                    self.flight.step_s
                ));
            }
        }
        within("fixed.density", self.fixed.density, -0.9, 9.0)?;
        within("robust.wave", self.robust.wave, 0.0, 0.9)?;
        within("robust.wavelength_m", self.robust.wavelength_m, 1.0, 1e6)?;
        within("robust.bias_ug", self.robust.bias_ug, 0.0, 1e6)?;
        within("robust.share_of_runs", self.robust.share_of_runs, 0.0, 1.0)
    }

    fn check_flight(&self) -> Result<(), String> {
        let (entry, flight) = (&self.entry, &self.flight);
        each("entry.position_m", &entry.position_m, -1e8, 1e8)?;
        each("entry.velocity_mps", &entry.velocity_mps, -1e5, 1e5)?;
        each("entry.deviation_m", &entry.deviation_m, 1e-6, 1e6)?;
        each("entry.deviation_mps", &entry.deviation_mps, 1e-6, 1e4)?;
        within("flight.step_s", flight.step_s, 1e-3, 5.0)?;
        within("flight.truth_substeps", f64::from(flight.truth_substeps), 1.0, 1e3)?;
        within("flight.deploy_mps", flight.deploy_mps, 1.0, 1e4)?;
        within("flight.bank_deg", flight.bank_deg, -180.0, 180.0)?;
        within("flight.longest_s", flight.longest_s, flight.step_s, 1e4)?;
        within("flight.record_s", flight.record_s, flight.step_s, 1e3)?;
        within("flight.diverged_m", flight.diverged_m, 1.0, 1e9)
    }

    fn check_world(&self) -> Result<(), String> {
        let (world, sensors) = (&self.world, &self.sensors);
        within("world.mu_m3ps2", world.mu_m3ps2, 1e9, 1e18)?;
        within("world.spin_radps", world.spin_radps, -1e-2, 1e-2)?;
        within("world.density_kgpm3", world.density_kgpm3, 1e-12, 1e3)?;
        within("world.reference_radius_m", world.reference_radius_m, 1e5, 1e8)?;
        within("world.scale_height_m", world.scale_height_m, 100.0, 1e5)?;
        within("world.ballistic_kgpm2", world.ballistic_kgpm2, 1e-3, 1e6)?;
        within("world.lift_to_drag", world.lift_to_drag, -10.0, 10.0)?;
        within("orbiter.radius_m", self.orbiter.radius_m, 1e5, 1e9)?;
        within("orbiter.inclination_deg", self.orbiter.inclination_deg, 0.0, 180.0)?;
        within("orbiter.node_deg", self.orbiter.node_deg, -360.0, 360.0)?;
        within("orbiter.argument_deg", self.orbiter.argument_deg, -360.0, 360.0)?;
        within("sensors.pressure_share", sensors.pressure_share, 1e-6, 0.3)?;
        within("sensors.accelerometer_ug", sensors.accelerometer_ug, 1e-3, 1e7)?;
        within("sensors.range_m", sensors.range_m, 1e-6, 1e7)?;
        within("sensors.range_rate_mps", sensors.range_rate_mps, 1e-9, 1e5)
    }

    fn check_bank(&self) -> Result<(), String> {
        let (bank, augmented) = (&self.bank, &self.augmented);
        within("density.width", self.density.width, 1e-6, 0.9)?;
        for (name, densities) in [("bank.densities", &bank.densities), ("bank.fine_densities", &bank.fine_densities)] {
            each(name, densities, -0.9, 9.0)?;
            if densities.len() > MOST_MODELS {
                return Err(format!("{name} holds {} models; a bank has 1 to {MOST_MODELS}", densities.len()));
            }
        }
        let share = 1.0 / bank.densities.len() as f64;
        each("bank.rates", &bank.rates, 1e-15, 1e6)?;
        each("fixed.rates", &self.fixed.rates, 1e-15, 1e6)?;
        each("table5.rates", &self.table5.rates, 1e-15, 1e6)?;
        within("bank.noise_mpsps", bank.noise_mpsps, 0.0, 1e3)?;
        within("bank.floor", bank.floor, 0.0, 0.99 * share)?;
        within("bank.stay", bank.stay, share, 1.0)?;
        each("bank.scales", &bank.scales, 1e-9, 1e12)?;
        within("augmented.walk_psqrts", augmented.walk_psqrts, 0.0, 1.0)?;
        within("augmented.experts", augmented.experts as f64, 1.0, MOST_MODELS as f64)?;
        within("augmented.markov_sigma", augmented.markov_sigma, 1e-6, 1.0)?;
        within("augmented.markov_s", augmented.markov_s, 1e-2, 1e6)?;
        within("augmented.bias_ug", augmented.bias_ug, 1e-3, 1e6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let text = format!("filters = [\"{}\"]", filter.name());
            assert_eq!(Config::from_toml(&text).unwrap().filters, [filter]);
        }
    }

    #[test]
    fn what_is_wrong_is_said_in_one_sentence_with_its_name() {
        for (text, words) in [
            ("[ranking]\nrate_hz = 0.0", "ranking.rate_hz is 0"),
            ("[ranking]\nrate_hz = 3.0", "whole number of steps"),
            ("[ranking]\nrate_hz = 20.0", "whole number of steps"),
            ("[bank]\ndensities = []", "bank.densities must hold at least one value"),
            ("[sensors]\nrange_m = 0.0", "sensors.range_m is 0"),
            ("[sensors]\naccelerometer_ug = -1.0", "sensors.accelerometer_ug is -1"),
            ("[sensors]\npressure_share = nan", "sensors.pressure_share is NaN"),
            ("filters = [\"kalman\"]", "unknown variant `kalman`"),
            ("filters = []", "at least one filter"),
            ("[table5]\nreading = \"C\"", "table5.reading"),
            ("[bank]\nrates = [0.1, -1.0]", "bank.rates[1] is -1"),
            ("sigma = 1", "unknown field `sigma`"),
        ] {
            let said = Config::from_toml(text).unwrap_err();
            assert!(said.contains(words) && !said.contains('\n'), "{said}");
        }
    }
}
