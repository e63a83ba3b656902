//! Allowed range of every parameter. What lies outside is refused when it is loaded, with the index of its field.
//!
//! The bounds are wide: they keep out what would make the algorithms meaningless (a mass below zero, a scale height
//! of zero, an empty box), not what is merely unwise. Bounds are inclusive; NaN and infinities are always outside.

use core::f64::consts::{FRAC_PI_2, PI, TAU};

/// Name, unit and bounds of one field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// Name of the field, as in its struct.
    pub field: &'static str,
    /// Unit, as text.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

impl Limit {
    /// Whether the value is finite and within the bounds. Written so that NaN is not.
    #[must_use]
    pub fn admits(&self, value: f64) -> bool {
        value >= self.min && value <= self.max
    }
}

const fn limit(field: &'static str, unit: &'static str, min: f64, max: f64) -> Limit {
    Limit { field, unit, min, max }
}

/// Largest deviation of the norm of a quaternion from one.
pub const QUATERNION_TOLERANCE: f64 = 1e-6;
/// Gravity at the reference radius, which ties the two first fields of the planet together.
pub const SURFACE_GRAVITY_MPS2: Limit = limit("mu_m3ps2 / radius_m²", "m/s²", 0.1, 100.0);
/// Largest component of an inertial position, m.
const FAR_M: f64 = 1e9;
/// Largest component of an inertial velocity, m/s.
const FAST_MPS: f64 = 1e5;

/// [`crate::planet::Planet`].
pub const PLANET: [Limit; 4] = [
    limit("radius_m", "m", 1e5, 1e8),
    limit("mu_m3ps2", "m³/s²", 1e9, 1e18),
    limit("rotation_radps", "rad/s", -1e-2, 1e-2),
    limit("j2", "1", -0.1, 0.1),
];
/// [`crate::link::parameters::VehicleParameters`].
pub const VEHICLE: [Limit; 6] = [
    limit("mass_kg", "kg", 1.0, 1e6),
    limit("reference_area_m2", "m²", 1e-3, 1e4),
    limit("nose_radius_m", "m", 1e-2, 100.0),
    limit("drag_coefficient", "1", 1e-3, 10.0),
    limit("lift_to_drag", "1", 0.0, 5.0),
    limit("trim_angle_of_attack_rad", "rad", -FRAC_PI_2, FRAC_PI_2),
];
/// [`crate::link::parameters::AeroRow`].
pub const AERO_ROW: [Limit; 3] = [
    limit("mach", "1", 0.0, 100.0),
    limit("drag_coefficient", "1", 1e-3, 10.0),
    limit("lift_coefficient", "1", -10.0, 10.0),
];
/// [`crate::link::parameters::AtmosphereParameters`].
pub const ATMOSPHERE: [Limit; 6] = [
    limit("reference_density_kgpm3", "kg/m³", 1e-15, 1e3),
    limit("reference_altitude_m", "m", -1e5, 1e6),
    limit("scale_height_m", "m", 100.0, 1e6),
    limit("temperature_k", "K", 10.0, 1e4),
    limit("gas_constant_jpkgk", "J/(kg·K)", 10.0, 1e4),
    limit("heat_ratio", "1", 1.01, 2.0),
];
/// [`crate::link::parameters::AtmosphereRow`].
pub const ATMOSPHERE_ROW: [Limit; 3] = [
    limit("altitude_m", "m", -1e5, 1e6),
    limit("density_kgpm3", "kg/m³", 1e-30, 1e3),
    limit("temperature_k", "K", 10.0, 1e4),
];
/// [`crate::link::parameters::Target`].
pub const TARGET: [Limit; 2] =
    [limit("longitude_rad", "rad", -TAU, TAU), limit("latitude_rad", "rad", -FRAC_PI_2, FRAC_PI_2)];
/// [`crate::link::parameters::DeployParameters`]; every minimum lies below its maximum.
pub const DEPLOY: [Limit; 10] = [
    limit("speed_mps", "m/s", 10.0, 1e4),
    limit("window_min_speed_mps", "m/s", 10.0, 1e4),
    limit("window_max_speed_mps", "m/s", 10.0, 1e4),
    limit("floor_altitude_m", "m", -1e4, 1e5),
    limit("min_altitude_m", "m", -1e4, 2e5),
    limit("max_altitude_m", "m", -1e4, 2e5),
    limit("min_mach", "1", 0.0, 100.0),
    limit("max_mach", "1", 0.0, 100.0),
    limit("min_dynamic_pressure_pa", "Pa", 0.0, 1e6),
    limit("max_dynamic_pressure_pa", "Pa", 0.0, 1e6),
];
/// [`crate::link::parameters::RadioSource::Orbiter`]; the field index counts the slot as 0.
pub const ORBITER: [Limit; 2] =
    [limit("position_m", "m", -FAR_M, FAR_M), limit("velocity_mps", "m/s", -FAST_MPS, FAST_MPS)];
/// [`crate::link::parameters::RadioSource::Beacon`]; the field index counts the slot as 0.
pub const BEACON: [Limit; 3] = [
    limit("longitude_rad", "rad", -TAU, TAU),
    limit("latitude_rad", "rad", -FRAC_PI_2, FRAC_PI_2),
    limit("altitude_m", "m", -1e5, 1e6),
];
/// [`crate::link::parameters::InitialKnowledge`]. Standard deviations are above zero: the filter factors their squares.
pub const INITIAL_KNOWLEDGE: [Limit; 6] = [
    limit("position_m", "m", -FAR_M, FAR_M),
    limit("velocity_mps", "m/s", -FAST_MPS, FAST_MPS),
    limit("attitude", "1", -1.0 - QUATERNION_TOLERANCE, 1.0 + QUATERNION_TOLERANCE),
    limit("position_sigma_m", "m", 1e-6, 1e6),
    limit("velocity_sigma_mps", "m/s", 1e-9, 1e4),
    limit("attitude_sigma_rad", "rad", 1e-9, 1.0),
];
/// [`crate::link::parameters::NavigationParameters`]. White noises of measurements are above zero, so that every
/// innovation has a variance.
pub const NAVIGATION: [Limit; 17] = [
    limit("accelerometer_bias_sigma_mps2", "m/s²", 0.0, 10.0),
    limit("accelerometer_scale_sigma", "1", 0.0, 0.1),
    limit("accelerometer_misalignment_sigma_rad", "rad", 0.0, 0.1),
    limit("accelerometer_noise", "(m/s²)/√Hz", 0.0, 1.0),
    limit("gyro_bias_sigma_radps", "rad/s", 0.0, 0.1),
    limit("gyro_scale_sigma", "1", 0.0, 0.1),
    limit("gyro_noise", "rad/√s", 0.0, 0.1),
    limit("log_density_sigma", "1", 0.0, 3.0),
    limit("log_density_length_m", "m", 100.0, 1e8),
    limit("pressure_scale_sigma", "1", 0.0, 1.0),
    limit("pressure_offset_sigma_pa", "Pa", 0.0, 1e5),
    limit("pressure_noise", "1", 1e-6, 1.0),
    limit("pressure_min_dynamic_pa", "Pa", 0.0, 1e6),
    limit("range_noise_m", "m", 1e-3, 1e6),
    limit("range_rate_noise_mps", "m/s", 1e-6, 1e4),
    limit("min_elevation_rad", "rad", -FRAC_PI_2, FRAC_PI_2),
    limit("gate_sigma", "1", 0.5, 1e3),
];
/// [`crate::link::parameters::EstimatorParameters`]. Shares are above zero, so that every reading of the force has a variance.
pub const ESTIMATORS: [Limit; 16] = [
    limit("unmodelled_share", "1", 1e-6, 1.0),
    limit("calibrated_share", "1", 1e-6, 1.0),
    limit("spacing_share", "1", 1e-6, 1.0),
    limit("modelled_share", "1", 1e-6, 1.0),
    limit("error_correlation_s", "s", 0.01, 1e4),
    limit("lift_sigma", "1", 0.0, 1.0),
    limit("input_growth_mps2", "m/s²", 0.0, 100.0),
    limit("calibration_start_s", "s", 0.0, 3600.0),
    limit("calibration_s", "s", 0.1, 1e4),
    limit("calibration_share", "1", 0.0, 1.0),
    limit("calibration_fade_s", "s", 0.1, 1e4),
    limit("gating_rate", "1", 1e-12, 1e6),
    limit("switching_stay", "1", 0.15, 1.0),
    limit("weight_floor", "1", 0.0, 0.1),
    limit("rank_threshold", "1", 0.0, 1.0),
    limit("free_threshold", "1", 0.0, 1.0),
];
/// [`crate::link::parameters::GuidanceParameters`]; the smallest bank lies below the largest.
pub const GUIDANCE: [Limit; 18] = [
    limit("predictor_step_s", "s", 0.1, 20.0),
    limit("prediction_horizon_s", "s", 10.0, 3600.0),
    limit("tolerance_m", "m", 0.1, 1e6),
    limit("bank_increment_rad", "rad", 0.01, PI),
    limit("max_iterations", "1", 1.0, 20.0),
    limit("min_bank_rad", "rad", 0.0, PI),
    limit("max_bank_rad", "rad", 0.0, PI),
    limit("threshold_constant_m", "m", 0.0, 1e6),
    limit("threshold_linear_s", "s", 0.0, 1e3),
    limit("threshold_quadratic_s2pm", "s²/m", 0.0, 1.0),
    limit("range_control_load_mps2", "m/s²", 1e-3, 100.0),
    limit("alignment_speed_mps", "m/s", 0.0, 1e4),
    limit("alignment_gain_ps", "1/s", 0.0, 10.0),
    limit("alignment_max_bank_rad", "rad", 0.0, FRAC_PI_2),
    limit("alignment_freeze_range_m", "m", 0.0, 1e6),
    limit("late_alignment_speed_mps", "m/s", 0.0, 1e4),
    limit("range_alignment_speed_mps", "m/s", 0.0, 1e4),
    limit("reversal_share", "1", 0.0, 10.0),
];
/// [`crate::link::parameters::ConstraintParameters`].
pub const CONSTRAINTS: [Limit; 3] = [
    limit("load_mps2", "m/s²", 1.0, 1e4),
    limit("heat_flux_wpm2", "W/m²", 1e2, 1e10),
    limit("dynamic_pressure_pa", "Pa", 1.0, 1e7),
];
/// [`crate::link::parameters::ControlParameters`].
pub const CONTROL: [Limit; 4] = [
    limit("initial_bank_rad", "rad", -PI, PI),
    limit("max_rate_radps", "rad/s", 1e-3, 10.0),
    limit("max_accel_radps2", "rad/s²", 1e-3, 100.0),
    limit("lag_s", "s", 0.0, 10.0),
];

/// Longest prediction in predictor steps; beyond it no cycle could ever finish.
pub const MAX_HORIZON_STEPS: f64 = 1_000.0;
