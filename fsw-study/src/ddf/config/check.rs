//! Ranges of the settings, each with a sentence for what lies outside.

use super::Config;
use crate::settings::{Stored, distinct, divides, each, parse_over_defaults, whole, within, write};

/// Most steps of a flight: what fits into memory.
const MAX_STEPS: f64 = 1e6;

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
    /// Ok when every number is in range.
    ///
    /// # Errors
    /// One sentence with the field, the value and the range.
    pub fn check(&self) -> Result<(), String> {
        let e = &self.experiment;
        within("experiment.step_s", e.step_s, 1e-3, 10.0)?;
        within("experiment.duration_s", e.duration_s, e.step_s, MAX_STEPS * e.step_s)?;
        within("experiment.bank_deg", e.bank_deg, -180.0, 180.0)?;
        each("experiment.process_noise", &e.process_noise, 1e-12, 1e6)?;
        within("experiment.average_from_s", e.average_from_s, 0.0, e.duration_s - e.step_s)?;
        within("experiment.divergence_m", e.divergence_m, 1.0, 1e9)?;
        within("entry.altitude_km", self.entry.altitude_km, 1.0, 1e3)?;
        within("entry.speed_mps", self.entry.speed_mps, 100.0, 2e4)?;
        within("entry.path_angle_deg", self.entry.path_angle_deg, -80.0, 80.0)?;
        within("entry.longitude_deg", self.entry.longitude_deg, -360.0, 360.0)?;
        within("entry.latitude_deg", self.entry.latitude_deg, -80.0, 80.0)?;
        within("entry.heading_deg", self.entry.heading_deg, -360.0, 360.0)?;
        each("initial", &self.initial_sigmas(), 0.0, 1e6)?;
        within("truth.density_error", self.truth.density_error, -0.9, 10.0)?;
        within("truth.lift_error", self.truth.lift_error, -10.0, 10.0)?;
        self.check_sensors()?;
        self.check_filters()
    }

    /// Whether its filters do the very work that [`crate::m7`] has the cost of: all but which are flown and what is searched is
    /// as it is when nothing is set.
    #[must_use]
    pub fn has_recorded_cost(&self) -> bool {
        let mut plain = Self::default();
        plain.filters.fly.clone_from(&self.filters.fly);
        plain.tuning.clone_from(&self.tuning);
        *self == plain
    }

    fn check_sensors(&self) -> Result<(), String> {
        let s = &self.sensors;
        let step_s = self.experiment.step_s;
        s.rate_hz.map_or(Ok(()), |rate_hz| divides("sensors.rate_hz", rate_hz, step_s))?;
        within("sensors.accelerometer_mps2", s.accelerometer_mps2, 1e-9, 1e3)?;
        within("sensors.accelerometer_bias_mps2", s.accelerometer_bias_mps2, -1e3, 1e3)?;
        within("sensors.pressure_pa", s.pressure_pa, 1e-6, 1e6)?;
        within("sensors.pressure_relative", s.pressure_relative, 0.0, 1.0)?;
        within("sensors.range_m", s.range_m, 1e-6, 1e6)?;
        each("sensors.orbiter_km", &s.orbiter_km, -1e6, 1e6)?;
        each("sensors.orbiter_mps", &s.orbiter_mps, -1e5, 1e5)
    }

    fn check_filters(&self) -> Result<(), String> {
        let f = &self.filters;
        distinct("filters.fly", &f.fly, |kind| kind.name())?;
        each("filters.weights", &f.weights, 0.0, 1e3)?;
        each("filters.rank_thresholds", &f.rank_thresholds, 0.0, 1.0)?;
        each("filters.free_thresholds", &f.free_thresholds, 0.0, 1.0)?;
        within("filters.gate_sigma", f.gate_sigma, 1.0, f64::INFINITY)?;
        for (name, factors) in [("tuned", f.tuned), ("forces", f.forces)] {
            within(&format!("filters.{name}.process"), factors.process, 1e-3, 1e6)?;
            within(&format!("filters.{name}.sensors"), factors.sensors, 1e-3, 1e6)?;
        }
        each("tuning.process", &self.tuning.process, 1e-3, 1e6)?;
        each("tuning.sensors", &self.tuning.sensors, 1e-3, 1e6)?;
        whole("tuning.runs", self.tuning.runs, 1, 100_000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::parse;

    #[test]
    fn the_defaults_are_in_range_and_survive_their_own_text() {
        let config = Config::default();
        config.check().unwrap();
        assert_eq!(config.steps(), 2_000);
        assert_eq!(parse::<Config>(&toml::to_string(&config).unwrap()).unwrap(), config);
    }

    #[test]
    fn bad_settings_are_named_with_their_range() {
        for (text, words) in [
            ("[experiment]\nstep_s = 0.0", "experiment.step_s is 0; it must be 0.001 to 10"),
            ("[sensors]\nrate_hz = 0", "sensors.rate_hz is 0; it must be 0.001 to 5"),
            ("[sensors]\nrate_hz = 3.0", "a whole number of steps of 0.2 s"),
            ("[sensors]\nrange_m = -1.0", "sensors.range_m is -1"),
            ("[filters]\nfree_thresholds = [1e-4, -1e-3]", "filters.free_thresholds[1] is -0.001; it must be 0 to 1"),
            ("[filters]\nrank_thresholds = []", "filters.rank_thresholds must hold at least one value"),
            ("[experiment]\nprocess_noise = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]", "experiment.process_noise[0] is 0"),
            ("[filters]\nfly = [\"rddf1\", \"rddf1\"]", "filters.fly[1] names"),
            ("[filters]\nfly = []", "filters.fly must name at least one filter"),
            ("[filters]\nweights = [0.5, nan]", "filters.weights[1] is NaN"),
            ("[experiment]\naverage_from_s = 400.0", "experiment.average_from_s is 400"),
        ] {
            let said = parse::<Config>(text).unwrap().check().unwrap_err();
            assert!(said.contains(words), "{said}");
        }
        let said = parse::<Config>("[filters]\nfly = [\"ukf\"]").unwrap_err();
        assert!(said.contains("filters.fly[0]") && said.contains("ukf"), "{said}");
    }
}
