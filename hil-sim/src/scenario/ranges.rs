//! Allowed range of every number of a scenario: one table.

use toml::Value;

/// Allowed range of one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Dotted path; `*` stands for any index. Fields under `onboard.` follow the row of their nominal twin.
    pub path: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// Unit in messages; empty for a pure number.
    pub unit: &'static str,
}

const fn row(path: &'static str, min: f64, max: f64, unit: &'static str) -> Range {
    Range { path, min, max, unit }
}

/// The table. A test makes sure that no number of a scenario is missing.
pub const RANGES: &[Range] = &[
    row("time_limit_s", 1.0, 3600.0, "s"),
    row("entry.longitude_deg", -360.0, 360.0, "deg"),
    row("entry.latitude_deg", -89.9, 89.9, "deg"),
    row("entry.altitude_km", 1.0, 1000.0, "km"),
    row("entry.speed_mps", 100.0, 15_000.0, "m/s"),
    row("entry.flight_path_angle_deg", -89.0, 10.0, "deg"),
    row("entry.heading_deg", -360.0, 360.0, "deg"),
    row("entry.position_km.*", -20_000.0, 20_000.0, "km"),
    row("entry.velocity_mps.*", -15_000.0, 15_000.0, "m/s"),
    row("target.longitude_deg", -360.0, 360.0, "deg"),
    row("target.latitude_deg", -89.9, 89.9, "deg"),
    row("deploy.speed_mps", 50.0, 2000.0, "m/s"),
    row("deploy.speed_window_mps.*", 50.0, 2000.0, "m/s"),
    row("deploy.floor_altitude_km", -10.0, 50.0, "km"),
    row("deploy.box.altitude_km.*", -10.0, 100.0, "km"),
    row("deploy.box.mach.*", 0.0, 50.0, ""),
    row("deploy.box.dynamic_pressure_pa.*", 0.0, 1e6, "Pa"),
    row("vehicle.mass_kg", 1.0, 1e6, "kg"),
    row("vehicle.reference_area_m2", 0.01, 1e4, "m2"),
    row("vehicle.nose_radius_m", 0.01, 100.0, "m"),
    row("vehicle.drag_coefficient", 0.01, 10.0, ""),
    row("vehicle.lift_to_drag", 0.0, 5.0, ""),
    row("vehicle.trim_angle_of_attack_deg", -60.0, 60.0, "deg"),
    row("vehicle.aero_table.*.0", 0.0, 100.0, ""),
    row("vehicle.aero_table.*.1", 0.01, 10.0, ""),
    row("vehicle.aero_table.*.2", -5.0, 5.0, ""),
    row("planet.radius_km", 1000.0, 10_000.0, "km"),
    row("planet.mu_m3ps2", 1e12, 1e15, "m3/s2"),
    row("planet.rotation_radps", -1e-3, 1e-3, "rad/s"),
    row("planet.j2", 0.0, 0.1, ""),
    row("atmosphere.reference_density_kgpm3", 1e-12, 100.0, "kg/m3"),
    row("atmosphere.reference_altitude_km", -10.0, 300.0, "km"),
    row("atmosphere.scale_height_km", 1.0, 100.0, "km"),
    row("atmosphere.rows.*.0", -10.0, 1000.0, "km"),
    row("atmosphere.rows.*.1", 1e-18, 100.0, "kg/m3"),
    row("atmosphere.rows.*.2", 10.0, 2000.0, "K"),
    row("atmosphere.rows.*.3", -500.0, 500.0, "m/s"),
    row("atmosphere.rows.*.4", -500.0, 500.0, "m/s"),
    row("atmosphere.temperature_k", 10.0, 2000.0, "K"),
    row("atmosphere.gas_constant_jpkgk", 50.0, 5000.0, "J/(kg K)"),
    row("atmosphere.heat_ratio", 1.01, 1.7, ""),
    row("atmosphere.density_scale", 0.0, 10.0, ""),
    row("atmosphere.perturbation.sigma", 0.0, 1.0, ""),
    row("atmosphere.perturbation.correlation_km", 0.01, 1000.0, "km"),
    row("orbiter.*.semi_major_axis_km", 1000.0, 100_000.0, "km"),
    row("orbiter.*.eccentricity", 0.0, 0.95, ""),
    row("orbiter.*.inclination_deg", 0.0, 180.0, "deg"),
    row("orbiter.*.raan_deg", -360.0, 360.0, "deg"),
    row("orbiter.*.arg_periapsis_deg", -360.0, 360.0, "deg"),
    row("orbiter.*.true_anomaly_deg", -360.0, 360.0, "deg"),
    row("beacon.*.longitude_deg", -360.0, 360.0, "deg"),
    row("beacon.*.latitude_deg", -90.0, 90.0, "deg"),
    row("beacon.*.altitude_km", -10.0, 30.0, "km"),
    row("sensors.imu.accelerometer_bias_ug", 0.0, 1e5, "ug"),
    row("sensors.imu.accelerometer_scale_ppm", 0.0, 1e5, "ppm"),
    row("sensors.imu.accelerometer_misalignment_mrad", 0.0, 100.0, "mrad"),
    row("sensors.imu.accelerometer_noise_ugprthz", 0.0, 1e5, "ug/rtHz"),
    row("sensors.imu.accelerometer_range_g", 1.0, 1000.0, "g"),
    row("sensors.imu.gyro_bias_degph", 0.0, 1e4, "deg/h"),
    row("sensors.imu.gyro_scale_ppm", 0.0, 1e5, "ppm"),
    row("sensors.imu.gyro_noise_degprth", 0.0, 100.0, "deg/rth"),
    row("sensors.imu.gyro_range_degps", 1.0, 5000.0, "deg/s"),
    row("sensors.pressure.rate_hz", 0.1, 50.0, "Hz"),
    row("sensors.pressure.scale_sigma", 0.0, 0.5, ""),
    row("sensors.pressure.offset_sigma_pa", 0.0, 1e4, "Pa"),
    row("sensors.pressure.noise_sigma", 0.0, 0.5, ""),
    row("sensors.pressure.min_dynamic_pressure_pa", 0.0, 1e6, "Pa"),
    row("sensors.radio.rate_hz", 0.1, 50.0, "Hz"),
    row("sensors.radio.range_noise_m", 0.0, 1e5, "m"),
    row("sensors.radio.range_rate_noise_mps", 0.0, 100.0, "m/s"),
    row("sensors.radio.min_elevation_deg", -5.0, 90.0, "deg"),
    row("sensors.radio.blackout.above_speed_mps", 0.0, 20_000.0, "m/s"),
    row("sensors.radio.blackout.below_altitude_km", 0.0, 1000.0, "km"),
    row("navigation.position_sigma_m", 0.0, 1e5, "m"),
    row("navigation.velocity_sigma_mps", 0.0, 100.0, "m/s"),
    row("navigation.attitude_sigma_deg", 0.0, 10.0, "deg"),
    row("navigation.log_density_sigma", 0.001, 2.0, ""),
    row("navigation.log_density_length_km", 0.1, 1000.0, "km"),
    row("navigation.gate_sigma", 1.0, 100.0, ""),
    row("navigation.estimators.unmodelled_share", 1e-6, 1.0, ""),
    row("navigation.estimators.calibrated_share", 1e-6, 1.0, ""),
    row("navigation.estimators.spacing_share", 1e-6, 1.0, ""),
    row("navigation.estimators.modelled_share", 1e-6, 1.0, ""),
    row("navigation.estimators.error_correlation_s", 0.01, 1e4, "s"),
    row("navigation.estimators.lift_sigma", 0.0, 1.0, ""),
    row("navigation.estimators.input_growth_mps2", 0.0, 100.0, "m/s2"),
    row("navigation.estimators.calibration_start_s", 0.0, 3600.0, "s"),
    row("navigation.estimators.calibration_s", 0.1, 1e4, "s"),
    row("navigation.estimators.calibration_share", 0.0, 1.0, ""),
    row("navigation.estimators.calibration_fade_s", 0.1, 1e4, "s"),
    row("navigation.estimators.gating_rate", 1e-12, 1e6, ""),
    row("navigation.estimators.switching_stay", 0.15, 1.0, ""),
    row("navigation.estimators.weight_floor", 0.0, 0.1, ""),
    row("navigation.estimators.rank_threshold", 0.0, 1.0, ""),
    row("navigation.estimators.free_threshold", 0.0, 1.0, ""),
    row("guidance.predictor_step_s", 0.5, 10.0, "s"),
    row("guidance.prediction_horizon_s", 60.0, 1000.0, "s"),
    row("guidance.tolerance_m", 1.0, 1e5, "m"),
    row("guidance.bank_increment_deg", 1.0, 90.0, "deg"),
    row("guidance.max_iterations", 1.0, 10.0, ""),
    row("guidance.min_bank_deg", 0.0, 180.0, "deg"),
    row("guidance.max_bank_deg", 0.0, 180.0, "deg"),
    row("guidance.threshold_constant_m", 0.0, 1e6, "m"),
    row("guidance.threshold_linear_s", 0.0, 1000.0, "s"),
    row("guidance.threshold_quadratic_s2pm", 0.0, 1.0, "s2/m"),
    row("guidance.range_control_load_g", 0.001, 5.0, "g"),
    row("guidance.alignment_speed_mps", 0.0, 5000.0, "m/s"),
    row("guidance.alignment_gain_ps", 0.0, 10.0, "1/s"),
    row("guidance.alignment_max_bank_deg", 0.0, 90.0, "deg"),
    row("guidance.alignment_freeze_range_km", 0.0, 1000.0, "km"),
    row("guidance.reversal_share", 0.0, 10.0, ""),
    row("guidance.late_alignment_speed_mps", 0.0, 5000.0, "m/s"),
    row("guidance.range_alignment_speed_mps", 0.0, 5000.0, "m/s"),
    row("guidance.limits.load_g", 0.2, 100.0, "g"),
    row("guidance.limits.heat_flux_wpm2", 1e3, 1e9, "W/m2"),
    row("guidance.limits.dynamic_pressure_pa", 10.0, 1e6, "Pa"),
    row("control.initial_bank_deg", -180.0, 180.0, "deg"),
    row("control.max_rate_degps", 0.1, 360.0, "deg/s"),
    row("control.max_accel_degps2", 0.1, 360.0, "deg/s2"),
    row("control.lag_s", 0.0, 2.0, "s"),
    row("dispersions.flight_path_angle_deg", -10.0, 10.0, "deg"),
    row("dispersions.speed_mps", -1000.0, 1000.0, "m/s"),
    row("dispersions.heading_deg", -10.0, 10.0, "deg"),
    row("dispersions.along_track_km", -500.0, 500.0, "km"),
    row("dispersions.cross_track_km", -500.0, 500.0, "km"),
    row("dispersions.altitude_km", -50.0, 50.0, "km"),
    row("dispersions.density_bias", -0.9, 3.0, ""),
    row("dispersions.density_slope", -2.0, 2.0, ""),
    row("dispersions.density_wave_amplitude", -1.0, 1.0, ""),
    row("dispersions.density_wave_length_km", 1.0, 1000.0, "km"),
    row("dispersions.density_wave_phase_deg", -360.0, 360.0, "deg"),
    row("dispersions.drag_coefficient", -0.5, 0.5, ""),
    row("dispersions.lift_coefficient", -0.9, 0.9, ""),
    row("dispersions.mass", -0.5, 0.5, ""),
    row("dispersions.wind_east_0km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_east_15km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_east_30km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_east_60km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_north_0km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_north_15km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_north_30km_mps", -500.0, 500.0, "m/s"),
    row("dispersions.wind_north_60km_mps", -500.0, 500.0, "m/s"),
    row("fault.*.start_s", 0.0, 3600.0, "s"),
    row("fault.*.duration_s", 0.0, 3600.0, "s"),
    row("fault.*.parameters", -1e9, 1e9, ""),
];

/// The row of a field, if it has one. A row of a whole group (`dispersions.mass`) holds for what is below it, except
/// that a `three_sigma` is never negative.
#[must_use]
pub fn range_of(path: &[String]) -> Option<Range> {
    let path = if path.first().is_some_and(|s| s == "onboard") { &path[1..] } else { path };
    let found = RANGES.iter().find(|range| {
        let pattern: Vec<&str> = range.path.split('.').collect();
        let group = pattern[0] == "dispersions" || range.path.ends_with("parameters");
        (pattern.len() == path.len() || (group && pattern.len() < path.len()))
            && pattern.iter().zip(path).all(|(p, s)| p == s || (*p == "*" && s.parse::<usize>().is_ok()))
    })?;
    let min = if path.last().is_some_and(|s| s == "three_sigma") { 0.0 } else { found.min };
    Some(Range { min, ..*found })
}

/// Every number of a value with its dotted path, in document order.
#[must_use]
pub fn numbers(value: &Value) -> Vec<(Vec<String>, f64)> {
    let mut found = Vec::new();
    collect(value, &mut Vec::new(), &mut found);
    found
}

fn collect(value: &Value, path: &mut Vec<String>, found: &mut Vec<(Vec<String>, f64)>) {
    let mut inside = |key: String, value: &Value| {
        path.push(key);
        collect(value, path, found);
        path.pop();
    };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, value)| inside(key.clone(), value)),
        Value::Array(array) => array.iter().enumerate().for_each(|(k, value)| inside(k.to_string(), value)),
        Value::Float(x) => found.push((path.clone(), *x)),
        // Whole numbers of a scenario are small; beyond 2^53 the range check refuses them anyway.
        #[allow(clippy::cast_precision_loss)]
        Value::Integer(n) => found.push((path.clone(), *n as f64)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_every_builtin_scenario_has_a_range_and_lies_inside() {
        for name in super::super::Scenario::builtin_names() {
            let scenario = super::super::Scenario::builtin(name).unwrap();
            for (path, x) in numbers(&Value::try_from(&scenario).unwrap()) {
                let range = range_of(&path).unwrap_or_else(|| panic!("{} has no range", path.join(".")));
                assert!(x >= range.min && x <= range.max, "{} = {x}", path.join("."));
            }
        }
    }

    #[test]
    fn what_a_scenario_may_say_the_flight_software_may_hear() {
        use crate::session::{Conductor, SessionError};
        for range in RANGES.iter().filter(|range| !range.path.contains('*')) {
            for x in [range.min, range.max] {
                let set = [format!("{}={x}", range.path)];
                // A contradiction with another field is told by the scenario itself.
                let Ok(scenario) = super::super::Scenario::resolve("msl", &set) else { continue };
                let session = Conductor::new(&scenario, 1, 0, false);
                assert!(!matches!(&session, Err(SessionError::Parameters(_))), "{set:?}: {:?}", session.err());
            }
        }
    }

    #[test]
    fn no_range_is_written_twice_or_upside_down() {
        for (k, range) in RANGES.iter().enumerate() {
            assert!(range.min < range.max, "{}", range.path);
            assert!(RANGES[..k].iter().all(|other| other.path != range.path), "{}", range.path);
        }
    }

    #[test]
    fn beliefs_follow_the_row_of_their_nominal_twin() {
        let path = ["onboard", "vehicle", "mass_kg"].map(String::from);
        assert_eq!(range_of(&path).map(|r| r.path), Some("vehicle.mass_kg"));
    }
}
