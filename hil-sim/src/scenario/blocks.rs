//! The scenario as parameter blocks of the link: SI units, radians, tables in pieces.

use fsw_core::link::packet::MAX_SOURCES;
use fsw_core::link::parameters::{
    AeroRow, AeroRows, AtmosphereRow, AtmosphereRows, ConstraintParameters, ControlParameters, DeployParameters,
    EstimatorParameters, GuidanceParameters, Modes, NavigationParameters, ParameterBlock, ROWS_PER_BLOCK, RadioSource,
    Target,
};
use fsw_core::planet::STANDARD_GRAVITY_MPS2;
use fsw_core::units::rad;

use super::{Scenario, Sensors};

/// Metres per second squared of a millionth of standard gravity.
const MICRO_G_MPS2: f64 = 1e-6 * STANDARD_GRAVITY_MPS2;
/// The filter divides by these noises: a perfect sensor is told as nearly perfect.
const LEAST_PRESSURE_NOISE: f64 = 1e-6;
const LEAST_RANGE_NOISE_M: f64 = 1e-3;
const LEAST_RANGE_RATE_NOISE_MPS: f64 = 1e-6;

impl Scenario {
    /// Everything the flight software is told before it is armed, in the order of its digest, except the initial
    /// knowledge, which belongs to a run.
    #[must_use]
    pub fn parameter_blocks(&self) -> Vec<ParameterBlock> {
        let planet = self.onboard.planet.si();
        let mut blocks = vec![
            ParameterBlock::Modes(Modes {
                navigation: self.navigation.filter,
                guidance: self.guidance.mode,
                trigger: self.deploy.trigger,
            }),
            ParameterBlock::Planet(planet),
            ParameterBlock::Vehicle(self.onboard.vehicle.parameters()),
        ];
        blocks.extend(self.aero_blocks());
        blocks.push(ParameterBlock::Atmosphere(self.onboard.atmosphere.parameters(&planet)));
        blocks.extend(self.atmosphere_blocks());
        blocks.push(ParameterBlock::Target(Target {
            longitude_rad: rad(self.target.longitude_deg),
            latitude_rad: rad(self.target.latitude_deg),
        }));
        blocks.push(ParameterBlock::Deploy(self.deploy_parameters()));
        blocks.extend(self.source_blocks());
        blocks.push(ParameterBlock::Navigation(self.navigation_parameters(&self.onboard.sensors)));
        blocks.push(ParameterBlock::Guidance(self.guidance_parameters()));
        blocks.push(ParameterBlock::Constraints(ConstraintParameters {
            load_mps2: self.guidance.limits.load_g * STANDARD_GRAVITY_MPS2,
            heat_flux_wpm2: self.guidance.limits.heat_flux_wpm2,
            dynamic_pressure_pa: self.guidance.limits.dynamic_pressure_pa,
        }));
        blocks.push(ParameterBlock::Control(ControlParameters {
            initial_bank_rad: rad(self.control.initial_bank_deg),
            max_rate_radps: rad(self.control.max_rate_degps),
            max_accel_radps2: rad(self.control.max_accel_degps2),
            lag_s: self.control.lag_s,
        }));
        blocks.push(ParameterBlock::Estimators(self.estimator_parameters()));
        blocks
    }

    fn aero_blocks(&self) -> Vec<ParameterBlock> {
        let rows: Vec<AeroRow> = self
            .onboard
            .vehicle
            .aero_table
            .iter()
            .flatten()
            .map(|row| AeroRow {
                mach: row.mach,
                drag_coefficient: row.drag_coefficient,
                lift_coefficient: row.lift_coefficient,
            })
            .collect();
        pieces(&rows, |start, total, rows| ParameterBlock::AeroRows(AeroRows { start, total, rows }))
    }

    fn atmosphere_blocks(&self) -> Vec<ParameterBlock> {
        let temperature_k = self.onboard.atmosphere.parameters(&self.onboard.planet.si()).temperature_k;
        let rows: Vec<AtmosphereRow> = self
            .onboard
            .atmosphere
            .rows
            .iter()
            .flatten()
            .map(|row| AtmosphereRow {
                altitude_m: row.altitude_km * 1e3,
                density_kgpm3: row.density_kgpm3,
                temperature_k: row.temperature_k.unwrap_or(temperature_k),
            })
            .collect();
        pieces(&rows, |start, total, rows| ParameterBlock::AtmosphereRows(AtmosphereRows { start, total, rows }))
    }

    /// Orbiters in the first slots, then beacons, then empty slots.
    fn source_blocks(&self) -> Vec<ParameterBlock> {
        let planet = self.planet.si();
        let orbiters = self.orbiter.iter().map(|orbiter| {
            let (position_m, velocity_mps) = orbiter.inertial_state(&planet);
            RadioSource::Orbiter { position_m, velocity_mps }
        });
        let beacons = self.beacon.iter().map(|beacon| RadioSource::Beacon {
            longitude_rad: rad(beacon.longitude_deg),
            latitude_rad: rad(beacon.latitude_deg),
            altitude_m: beacon.altitude_km * 1e3,
        });
        let sources = orbiters.chain(beacons).chain(std::iter::repeat(RadioSource::None)).take(MAX_SOURCES);
        (0u8..).zip(sources).map(|(slot, source)| ParameterBlock::Source { slot, source }).collect()
    }

    fn deploy_parameters(&self) -> DeployParameters {
        let d = &self.deploy;
        DeployParameters {
            speed_mps: d.speed_mps,
            window_min_speed_mps: d.speed_window_mps[0],
            window_max_speed_mps: d.speed_window_mps[1],
            floor_altitude_m: d.floor_altitude_km * 1e3,
            min_altitude_m: d.limits.altitude_km[0] * 1e3,
            max_altitude_m: d.limits.altitude_km[1] * 1e3,
            min_mach: d.limits.mach[0],
            max_mach: d.limits.mach[1],
            min_dynamic_pressure_pa: d.limits.dynamic_pressure_pa[0],
            max_dynamic_pressure_pa: d.limits.dynamic_pressure_pa[1],
        }
    }

    /// The statistics of the sensors that fly, in the terms in which the flight software is told of those that it believes in.
    #[must_use]
    pub fn true_sensors(&self) -> NavigationParameters {
        self.navigation_parameters(&self.sensors)
    }

    fn navigation_parameters(&self, sensors: &Sensors) -> NavigationParameters {
        let Sensors { imu, pressure, radio } = sensors;
        NavigationParameters {
            accelerometer_bias_sigma_mps2: imu.accelerometer_bias_ug * MICRO_G_MPS2,
            accelerometer_scale_sigma: imu.accelerometer_scale_ppm * 1e-6,
            accelerometer_misalignment_sigma_rad: imu.accelerometer_misalignment_mrad * 1e-3,
            accelerometer_noise: imu.accelerometer_noise_ugprthz * MICRO_G_MPS2,
            gyro_bias_sigma_radps: rad(imu.gyro_bias_degph) / 3600.0,
            gyro_scale_sigma: imu.gyro_scale_ppm * 1e-6,
            gyro_noise: rad(imu.gyro_noise_degprth) / 60.0,
            log_density_sigma: self.navigation.log_density_sigma,
            log_density_length_m: self.navigation.log_density_length_km * 1e3,
            pressure_scale_sigma: pressure.scale_sigma,
            pressure_offset_sigma_pa: pressure.offset_sigma_pa,
            pressure_noise: pressure.noise_sigma.max(LEAST_PRESSURE_NOISE),
            pressure_min_dynamic_pa: pressure.min_dynamic_pressure_pa,
            range_noise_m: radio.range_noise_m.max(LEAST_RANGE_NOISE_M),
            range_rate_noise_mps: radio.range_rate_noise_mps.max(LEAST_RANGE_RATE_NOISE_MPS),
            min_elevation_rad: rad(radio.min_elevation_deg),
            gate_sigma: self.navigation.gate_sigma,
        }
    }

    fn estimator_parameters(&self) -> EstimatorParameters {
        let e = &self.navigation.estimators;
        EstimatorParameters {
            unmodelled_share: e.unmodelled_share,
            calibrated_share: e.calibrated_share,
            spacing_share: e.spacing_share,
            modelled_share: e.modelled_share,
            error_correlation_s: e.error_correlation_s,
            lift_sigma: e.lift_sigma,
            input_growth_mps2: e.input_growth_mps2,
            calibration_start_s: e.calibration_start_s,
            calibration_s: e.calibration_s,
            calibration_share: e.calibration_share,
            calibration_fade_s: e.calibration_fade_s,
            gating_rate: e.gating_rate,
            switching_stay: e.switching_stay,
            weight_floor: e.weight_floor,
            rank_threshold: e.rank_threshold,
            free_threshold: e.free_threshold,
        }
    }

    fn guidance_parameters(&self) -> GuidanceParameters {
        let g = &self.guidance;
        GuidanceParameters {
            predictor_step_s: g.predictor_step_s,
            prediction_horizon_s: g.prediction_horizon_s,
            tolerance_m: g.tolerance_m,
            bank_increment_rad: rad(g.bank_increment_deg),
            max_iterations: g.max_iterations,
            min_bank_rad: rad(g.min_bank_deg),
            max_bank_rad: rad(g.max_bank_deg),
            threshold_constant_m: g.threshold_constant_m,
            threshold_linear_s: g.threshold_linear_s,
            threshold_quadratic_s2pm: g.threshold_quadratic_s2pm,
            range_control_load_mps2: g.range_control_load_g * STANDARD_GRAVITY_MPS2,
            alignment_speed_mps: g.alignment_speed_mps,
            alignment_gain_ps: g.alignment_gain_ps,
            alignment_max_bank_rad: rad(g.alignment_max_bank_deg),
            alignment_freeze_range_m: g.alignment_freeze_range_km * 1e3,
            reversal_share: g.reversal_share,
            late_alignment_speed_mps: g.late_alignment_speed_mps,
            range_alignment_speed_mps: g.range_alignment_speed_mps,
        }
    }
}

/// Cuts a table into blocks; rows beyond its end are filled with defaults. An empty table gives no block.
fn pieces<R: Copy + Default>(
    rows: &[R],
    block: impl Fn(u8, u8, [R; ROWS_PER_BLOCK]) -> ParameterBlock,
) -> Vec<ParameterBlock> {
    // The consistency check has bounded the row count by the flight software's capacity, far below 256.
    let total = u8::try_from(rows.len()).unwrap_or(u8::MAX);
    let starts = (0..total).step_by(ROWS_PER_BLOCK);
    let filled = |piece: &[R]| std::array::from_fn(|k| piece.get(k).copied().unwrap_or_default());
    starts.zip(rows.chunks(ROWS_PER_BLOCK)).map(|(start, piece)| block(start, total, filled(piece))).collect()
}

#[cfg(test)]
mod tests {
    use fsw_core::config::Config;

    use super::*;

    fn config_of(scenario: &Scenario) -> Config {
        let mut config = Config::DEFAULT;
        for block in scenario.parameter_blocks() {
            config.apply(&block).unwrap();
        }
        config.validate().unwrap();
        config
    }

    fn assert_near(a: f64, b: f64, what: &str) {
        assert!((a - b).abs() <= 1e-12 * (a.abs() + b.abs()) + 1e-15, "{what}: {a} against {b}");
    }

    #[test]
    fn the_default_scenario_tells_the_flight_software_its_own_defaults() {
        let told = config_of(&Scenario::builtin("msl").unwrap());
        let own = Config::DEFAULT;
        assert_eq!((told.modes, told.planet, told.target), (own.modes, own.planet, own.target));
        assert_eq!((told.vehicle, told.deploy, told.guidance), (own.vehicle, own.deploy, own.guidance));
        assert_near(told.atmosphere.temperature_k, own.atmosphere.temperature_k, "temperature");
        assert_near(told.navigation.accelerometer_noise, own.navigation.accelerometer_noise, "accelerometer noise");
        assert_near(told.navigation.gyro_bias_sigma_radps, own.navigation.gyro_bias_sigma_radps, "gyro bias");
        let air = |config: &Config| (config.navigation.log_density_sigma, config.navigation.log_density_length_m);
        assert_eq!(air(&told), air(&own));
        assert_near(told.navigation.gyro_noise, own.navigation.gyro_noise, "gyro noise");
        let (RadioSource::Orbiter { position_m: a, .. }, RadioSource::Orbiter { position_m: b, .. }) =
            (told.sources[0], own.sources[0])
        else {
            panic!("slot 0 is not an orbiter")
        };
        // The flight software's constant is written to a micrometre.
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 2e-6));
    }

    #[test]
    fn every_builtin_scenario_is_accepted_by_the_flight_software() {
        for name in Scenario::builtin_names() {
            config_of(&Scenario::builtin(name).unwrap());
        }
    }

    #[test]
    fn tables_travel_in_pieces_that_add_up() {
        let rows: Vec<String> = (0..6).map(|k| format!("[{k}, 1.4, 0.3]")).collect();
        let set = format!("vehicle.aero_table=[{}]", rows.join(","));
        let config = config_of(&Scenario::resolve("msl", &[set]).unwrap());
        let machs: Vec<f64> = config.aero_rows.iter().map(|row| row.mach).collect();
        assert_eq!(machs, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn perfect_sensors_are_told_as_nearly_perfect() {
        let sets =
            ["sensors.radio.range_noise_m=0", "sensors.radio.range_rate_noise_mps=0", "sensors.pressure.noise_sigma=0"];
        config_of(&Scenario::resolve("msl", &sets.map(String::from)).unwrap());
    }
}
