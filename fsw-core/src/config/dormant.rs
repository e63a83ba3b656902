//! The parameters before the flight software wakes: all bytes zero, so that they cost no flash.

use super::{Config, RowTable};
use crate::link::packet::MAX_SOURCES;
use crate::link::parameters::{
    AtmosphereParameters, ConstraintParameters, ControlParameters, DeployParameters, GuidanceMode, GuidanceParameters,
    InitialKnowledge, Modes, NavigationMode, NavigationParameters, RadioSource, Target, TriggerKind, VehicleParameters,
};
use crate::planet::Planet;

impl Config {
    /// No parameters at all, to become [`Config::DEFAULT`] by [`Config::wake`].
    pub(crate) const DORMANT: Self = Self {
        modes: Modes { navigation: NavigationMode::Ekf, guidance: GuidanceMode::Paper, trigger: TriggerKind::Speed },
        planet: Planet { radius_m: 0.0, mu_m3ps2: 0.0, rotation_radps: 0.0, j2: 0.0 },
        vehicle: VehicleParameters {
            mass_kg: 0.0,
            reference_area_m2: 0.0,
            nose_radius_m: 0.0,
            drag_coefficient: 0.0,
            lift_to_drag: 0.0,
            trim_angle_of_attack_rad: 0.0,
        },
        aero_rows: RowTable::new(),
        atmosphere: AtmosphereParameters {
            reference_density_kgpm3: 0.0,
            reference_altitude_m: 0.0,
            scale_height_m: 0.0,
            temperature_k: 0.0,
            gas_constant_jpkgk: 0.0,
            heat_ratio: 0.0,
        },
        atmosphere_rows: RowTable::new(),
        target: Target { longitude_rad: 0.0, latitude_rad: 0.0 },
        deploy: DeployParameters {
            speed_mps: 0.0,
            window_min_speed_mps: 0.0,
            window_max_speed_mps: 0.0,
            floor_altitude_m: 0.0,
            min_altitude_m: 0.0,
            max_altitude_m: 0.0,
            min_mach: 0.0,
            max_mach: 0.0,
            min_dynamic_pressure_pa: 0.0,
            max_dynamic_pressure_pa: 0.0,
        },
        sources: [RadioSource::None; MAX_SOURCES],
        initial_knowledge: InitialKnowledge {
            position_m: [0.0; 3],
            velocity_mps: [0.0; 3],
            attitude: [0.0; 4],
            position_sigma_m: 0.0,
            velocity_sigma_mps: 0.0,
            attitude_sigma_rad: 0.0,
        },
        navigation: NavigationParameters {
            accelerometer_bias_sigma_mps2: 0.0,
            accelerometer_scale_sigma: 0.0,
            accelerometer_misalignment_sigma_rad: 0.0,
            accelerometer_noise: 0.0,
            gyro_bias_sigma_radps: 0.0,
            gyro_scale_sigma: 0.0,
            gyro_noise: 0.0,
            log_density_sigma: 0.0,
            log_density_length_m: 0.0,
            pressure_scale_sigma: 0.0,
            pressure_offset_sigma_pa: 0.0,
            pressure_noise: 0.0,
            pressure_min_dynamic_pa: 0.0,
            range_noise_m: 0.0,
            range_rate_noise_mps: 0.0,
            min_elevation_rad: 0.0,
            gate_sigma: 0.0,
        },
        guidance: GuidanceParameters {
            predictor_step_s: 0.0,
            prediction_horizon_s: 0.0,
            tolerance_m: 0.0,
            bank_increment_rad: 0.0,
            max_iterations: 0,
            min_bank_rad: 0.0,
            max_bank_rad: 0.0,
            threshold_constant_m: 0.0,
            threshold_linear_s: 0.0,
            threshold_quadratic_s2pm: 0.0,
            range_control_load_mps2: 0.0,
            alignment_speed_mps: 0.0,
            late_alignment_speed_mps: 0.0,
            range_alignment_speed_mps: 0.0,
            reversal_share: 0.0,
            alignment_gain_ps: 0.0,
            alignment_max_bank_rad: 0.0,
            alignment_freeze_range_m: 0.0,
        },
        constraints: ConstraintParameters { load_mps2: 0.0, heat_flux_wpm2: 0.0, dynamic_pressure_pa: 0.0 },
        control: ControlParameters { initial_bank_rad: 0.0, max_rate_radps: 0.0, max_accel_radps2: 0.0, lag_s: 0.0 },
    };
}
