//! Ranges of the settings.

use super::config::{Config, Sensors, Settings, Tuning};
use super::kind::Kind;
use super::table1::{SURFACE_M, Table1};
use crate::settings::{Stored, distinct, divides, each, parse_over_defaults, whole, within, write};

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
    /// Whether its filters do the very work that [`crate::m7`] has the cost of: all but which are flown and what is searched is
    /// as it is when nothing is set.
    #[must_use]
    pub fn has_recorded_cost(&self) -> bool {
        let mut plain = Self::default();
        plain.filters.fly.clone_from(&self.filters.fly);
        plain.tuning.clone_from(&self.tuning);
        *self == plain
    }

    /// One sentence about the first field out of its range.
    ///
    /// # Errors
    /// That sentence.
    pub fn check(&self) -> Result<(), String> {
        let e = &self.experiment;
        let f = &self.filters;
        within("experiment.step_s", e.step_s, 0.01, 10.0)?;
        within("experiment.duration_s", e.duration_s, 10.0 * e.step_s, 10_000.0)?;
        within("experiment.average_from_s", e.average_from_s, 0.0, e.duration_s - e.step_s)?;
        within("experiment.bank_deg", e.bank_deg, -180.0, 180.0)?;
        within("experiment.divergence_m", e.divergence_m, 1.0, 1e9)?;
        each("experiment.process_noise", &e.process_noise, 1e-12, 1e3)?;
        each("input.amplitude", &self.input.amplitude, 0.0, 1e3)?;
        each("input.profile", &self.input.profile, -100.0, 100.0)?;
        within("input.piece_s", self.input.piece_s, e.step_s, 10_000.0)?;
        self.sensors.check(e.step_s)?;
        self.truth.check("truth")?;
        self.initial.check("initial")?;
        if !f.fly.contains(&Kind::Ekf) {
            return Err("filters.fly must name ekf, which the others are set against".to_owned());
        }
        distinct("filters.fly", &f.fly, |kind| kind.name())?;
        whole("filters.sekf_start_step", f.sekf_start_step as u64, 1, 1_000_000)?;
        within("filters.late_start_s", f.late_start_s, 0.0, e.duration_s)?;
        within("filters.input_sigma", f.input_sigma, 0.0, 1e3)?;
        within("filters.considered_correlation_s", f.considered_correlation_s, 1e-3, 1e6)?;
        within("filters.density_sigma", f.density_sigma, 0.0, 10.0)?;
        within("filters.lift_sigma", f.lift_sigma, 0.0, 10.0)?;
        within("filters.bias_sigma_mps2", f.bias_sigma_mps2, 0.0, 100.0)?;
        f.untuned.check("filters.untuned")?;
        self.tuning.check()
    }
}

impl Tuning {
    fn check(&self) -> Result<(), String> {
        whole("tuning.grid_runs", self.grid_runs, 1, 100_000)?;
        whole("tuning.runs", self.runs, 1, 100_000)?;
        each("tuning.factors", &self.factors, 1.001, 100.0)?;
        let settings = Settings::default();
        for (name, grid) in [("process", &self.process), ("accelerometer", &self.accelerometer), ("input", &self.input)]
        {
            if grid.is_empty() {
                return Err(format!("tuning.{name} must hold at least one value"));
            }
            for value in grid {
                let tried = match name {
                    "process" => Settings { process: *value, ..settings },
                    "accelerometer" => Settings { accelerometer: *value, ..settings },
                    _ => Settings { input: *value, ..settings },
                };
                tried.check("tuning")?;
            }
        }
        Ok(())
    }
}

impl Sensors {
    fn check(&self, step_s: f64) -> Result<(), String> {
        self.rate_hz.map_or(Ok(()), |rate_hz| divides("sensors.rate_hz", rate_hz, step_s))?;
        within("sensors.accelerometer_mps2", self.accelerometer_mps2, 1e-9, 100.0)?;
        within("sensors.accelerometer_bias_mps2", self.accelerometer_bias_mps2, -100.0, 100.0)?;
        within("sensors.range_m", self.range_m, 1e-6, 1e6)?;
        within("sensors.angle_deg", self.angle_deg, 1e-9, 90.0)?;
        each("sensors.orbiter_km", &self.orbiter_km, -1e5, 1e5)?;
        each("sensors.orbiter_mps", &self.orbiter_mps, -1e4, 1e4)?;
        if self.orbiter_km.iter().map(|x| x * x).sum::<f64>().sqrt() < SURFACE_M * 1e-3 {
            return Err("sensors.orbiter_km lies inside the planet".to_owned());
        }
        self.beacons_km.iter().try_for_each(|beacon| each("sensors.beacons_km", beacon, -1e5, 1e5))
    }
}

impl Table1 {
    fn check(&self, part: &str) -> Result<(), String> {
        for (name, value, low, high) in [
            ("altitude_km", self.altitude_km, 1.0, 1_000.0),
            ("speed_mps", self.speed_mps, 100.0, 20_000.0),
            ("path_angle_deg", self.path_angle_deg, -80.0, 80.0),
            ("longitude_deg", self.longitude_deg, -180.0, 180.0),
            ("latitude_deg", self.latitude_deg, -80.0, 80.0),
            ("heading_deg", self.heading_deg, -360.0, 360.0),
            ("drag_area_m2pkg", self.drag_area_m2pkg, 1e-5, 10.0),
            ("density_kgpm3", self.density_kgpm3, 1e-9, 1.0),
            ("lift_to_drag", self.lift_to_drag, -5.0, 5.0),
        ] {
            within(&format!("{part}.{name}"), value, low, high)?;
        }
        Ok(())
    }
}

impl Settings {
    /// One sentence about the first field out of its range; `part` is where the settings stand.
    pub(super) fn check(&self, part: &str) -> Result<(), String> {
        within(&format!("{part}.process"), self.process, 0.0, 1e3)?;
        within(&format!("{part}.accelerometer"), self.accelerometer, 1e-3, 1e3)?;
        within(&format!("{part}.input"), self.input, 0.0, 1e3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_in_range_and_survive_their_own_file() {
        let config = Config::default();
        config.check().unwrap();
        let text = crate::settings::write(&config).unwrap();
        assert_eq!(crate::settings::parse::<Config>(&text).unwrap(), config);
    }

    #[test]
    fn what_is_out_of_range_is_named_with_its_range() {
        let mut config = Config::default();
        config.experiment.step_s = 0.0;
        assert_eq!(config.check().unwrap_err(), "experiment.step_s is 0; it must be 0.01 to 10");
        let mut config = Config::default();
        config.sensors.range_m = f64::NAN;
        assert!(config.check().unwrap_err().starts_with("sensors.range_m is NaN"));
        let mut config = Config::default();
        config.experiment.process_noise[3] = 0.0;
        assert!(config.check().unwrap_err().contains("process_noise[3]"));
        let mut config = Config::default();
        config.tuning.accelerometer.clear();
        assert!(config.check().unwrap_err().contains("tuning.accelerometer"));
    }

    #[test]
    fn readings_come_at_steps() {
        let mut config = Config::default();
        config.experiment.step_s = 0.2;
        assert_eq!(config.steps_per_reading(), 1);
        config.sensors.rate_hz = Some(1.0);
        assert_eq!((config.check(), config.steps_per_reading()), (Ok(()), 5));
        for (rate_hz, words) in
            [(0.0, "sensors.rate_hz is 0; it must be 0.001 to 5"), (3.0, "whole number"), (10.0, "to 5")]
        {
            config.sensors.rate_hz = Some(rate_hz);
            assert!(config.check().unwrap_err().contains(words));
        }
    }

    #[test]
    fn every_filter_is_named_once_and_the_ekf_is_there() {
        let mut config = Config::default();
        config.filters.fly = vec![Kind::Sekf];
        assert!(config.check().unwrap_err().contains("ekf"));
        config.filters.fly = vec![Kind::Ekf, Kind::Sekf, Kind::Sekf];
        assert!(config.check().unwrap_err().contains("fly[2] names SEKF twice"));
    }

    #[test]
    fn the_profile_holds_its_last_piece() {
        let input = crate::sekf::config::Input::default();
        let at = [0.0, 49.9, 50.0, 199.0, 399.0, 500.0].map(|t| input.alpha(t));
        assert_eq!(at, [0.0, 0.0, 1.0, 0.5, -1.0, -1.0]);
    }
}
