//! Ranges of the settings, each with a sentence for what lies outside.

use super::{Config, MOST_MODELS, Reading};
use crate::mmae::truth::{Draw, fly};
use crate::settings::{Stored, distinct, each, parse_over_defaults, within, write};

/// Longest flight, s.
const LONGEST_S: f64 = 1e4;

impl Stored for Config {
    fn from_toml(text: &str) -> Result<Self, String> {
        let config: Self = parse_over_defaults(text)?;
        config.check()?;
        Ok(config)
    }

    fn to_toml(&self) -> Result<String, String> {
        write(self)
    }
}

impl Config {
    /// Ok when everything is in range.
    ///
    /// # Errors
    /// One sentence for the first thing that is not.
    pub fn check(&self) -> Result<(), String> {
        distinct("filters.fly", &self.filters.fly, |filter| filter.name())?;
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
        within("efficiency.share_of_runs", self.efficiency.share_of_runs, 0.0, 1e3)?;
        within("robust.wave", self.robust.wave, 0.0, 0.9)?;
        within("robust.wavelength_m", self.robust.wavelength_m, 1.0, 1e6)?;
        within("robust.bias_ug", self.robust.bias_ug, 0.0, 1e6)?;
        within("robust.share_of_runs", self.robust.share_of_runs, 0.0, 1.0)?;
        self.check_length()
    }

    /// Whether the parachute opens at all.
    fn check_length(&self) -> Result<(), String> {
        let mut patient = self.clone();
        patient.flight.longest_s = LONGEST_S;
        let nominal = Draw { reading: Reading::A, every: usize::MAX, fixed_density: Some(0.0), is_robust: false };
        let steps = fly(&patient, &nominal, 0, 0).sensed.len();
        let needed_s = steps as f64 * self.flight.step_s;
        if needed_s <= self.flight.longest_s {
            return Ok(());
        }
        let longest_s = self.flight.longest_s;
        let more = if needed_s < LONGEST_S { format!("{needed_s:.1} s") } else { format!("more than {LONGEST_S} s") };
        Err(format!("flight.longest_s is {longest_s}; an entry in nominal air takes {more} to flight.deploy_mps"))
    }

    /// Whether its filters do the very work that [`crate::m7`] has the cost of: all but which are flown and what is searched is
    /// as it is when nothing is set.
    #[must_use]
    pub fn has_recorded_cost(&self) -> bool {
        let mut plain = Self::default();
        plain.filters.clone_from(&self.filters);
        plain.efficiency = self.efficiency;
        *self == plain
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
        within("flight.longest_s", flight.longest_s, flight.step_s, LONGEST_S)?;
        within("flight.record_s", flight.record_s, flight.step_s, 1e3)?;
        within("flight.divergence_m", flight.divergence_m, 1.0, 1e9)
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
            if densities.len() < 2 || densities.len() > MOST_MODELS {
                let models =
                    if densities.len() == 1 { "1 model".to_owned() } else { format!("{} models", densities.len()) };
                return Err(format!("{name} holds {models}; a bank has 2 to {MOST_MODELS}"));
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
