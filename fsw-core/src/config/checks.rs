//! Range checks of parameter blocks against [`limits`](super::limits), and of the parameters together.

use super::Config;
use super::limits::{
    AERO_ROW, ATMOSPHERE, ATMOSPHERE_ROW, BEACON, CONSTRAINTS, CONTROL, DEPLOY, ESTIMATORS, GUIDANCE,
    INITIAL_KNOWLEDGE, Limit, MAX_HORIZON_STEPS, NAVIGATION, ORBITER, PLANET, QUATERNION_TOLERANCE,
    SURFACE_GRAVITY_MPS2, TARGET, VEHICLE,
};
use crate::link::packet::Refusal;
use crate::link::parameters::{
    AeroRow, AtmosphereParameters, AtmosphereRow, BlockId, ConstraintParameters, ControlParameters, DeployParameters,
    EstimatorParameters, GuidanceParameters, InitialKnowledge, NavigationParameters, ParameterBlock, ROWS_PER_BLOCK,
    RadioSource, Target, VehicleParameters,
};
use crate::math::fun::sqrt;
use crate::math::num::abs;
use crate::planet::Planet;

/// Checks every field of one block, and what ties fields of the block together.
///
/// # Errors
/// [`Refusal::OutOfRange`] with the first offending field; of a pair, the second. For table rows the field counts
/// through the rows of the block: row × 3 + column.
pub fn check(block: &ParameterBlock) -> Result<(), Refusal> {
    let (block, offending) = match block {
        ParameterBlock::Modes(_) => (BlockId::Modes, None),
        ParameterBlock::Planet(v) => (BlockId::Planet, planet(v)),
        ParameterBlock::Vehicle(v) => (BlockId::Vehicle, vehicle(v)),
        ParameterBlock::AeroRows(v) => (BlockId::AeroRows(v.start), aero_rows(v.start, v.total, &v.rows)),
        ParameterBlock::Atmosphere(v) => (BlockId::Atmosphere, atmosphere(v)),
        ParameterBlock::AtmosphereRows(v) => {
            (BlockId::AtmosphereRows(v.start), atmosphere_rows(v.start, v.total, &v.rows))
        }
        ParameterBlock::Target(v) => (BlockId::Target, target(v)),
        ParameterBlock::Deploy(v) => (BlockId::Deploy, deploy(v)),
        ParameterBlock::Source { slot, source } => (BlockId::Source(*slot), radio_source(source)),
        ParameterBlock::InitialKnowledge(v) => (BlockId::InitialKnowledge, initial_knowledge(v)),
        ParameterBlock::Navigation(v) => (BlockId::Navigation, navigation(v)),
        ParameterBlock::Guidance(v) => (BlockId::Guidance, guidance(v)),
        ParameterBlock::Constraints(v) => (BlockId::Constraints, constraints(v)),
        ParameterBlock::Control(v) => (BlockId::Control, control(v)),
        ParameterBlock::Estimators(v) => (BlockId::Estimators, estimators(v)),
    };
    offending.map_or(Ok(()), |field| Err(Refusal::OutOfRange { block, field }))
}

/// Checks what depends on more than one block: nobody is inside the planet. The blocks have passed [`check`], so all
/// numbers are finite.
///
/// # Errors
/// [`Refusal::OutOfRange`] of the block that holds the position.
pub fn check_together(config: &Config) -> Result<(), Refusal> {
    let radius_m = config.planet.radius_m;
    for (slot, source) in (0u8..).zip(&config.sources) {
        if let RadioSource::Orbiter { position_m, .. } = source
            && norm(position_m) <= radius_m
        {
            return Err(Refusal::OutOfRange { block: BlockId::Source(slot), field: 1 });
        }
    }
    if norm(&config.initial_knowledge.position_m) <= radius_m {
        return Err(Refusal::OutOfRange { block: BlockId::InitialKnowledge, field: 0 });
    }
    Ok(())
}

/// Index of the first value that is outside its limit. Written so that NaN is outside.
fn outside<const N: usize>(limits: &[Limit; N], values: [f64; N]) -> Option<u8> {
    (0u8..).zip(limits.iter().zip(values)).find(|(_, (limit, value))| !limit.admits(*value)).map(|(index, _)| index)
}

/// As [`outside`] for table rows that belong to the table; the index counts through the rows.
fn rows_outside<const N: usize>(
    limits: &[Limit; N],
    start: u8,
    total: u8,
    rows: [[f64; N]; ROWS_PER_BLOCK],
) -> Option<u8> {
    let present = usize::from(total.saturating_sub(start));
    let mut values = (0u8..).zip(rows.iter().take(present).flat_map(|row| limits.iter().zip(row)));
    values.find(|(_, (limit, value))| !limit.admits(**value)).map(|(index, _)| index)
}

/// Whether all components of a vector are within the limit.
fn all_within<const N: usize>(limit: &Limit, vector: &[f64; N]) -> bool {
    vector.iter().all(|component| limit.admits(*component))
}

/// The field if the condition fails.
fn unless(holds: bool, field: u8) -> Option<u8> {
    if holds { None } else { Some(field) }
}

fn norm<const N: usize>(vector: &[f64; N]) -> f64 {
    sqrt(vector.iter().fold(0.0, |sum, x| sum + x * x))
}

fn planet(p: &Planet) -> Option<u8> {
    let gravity = p.mu_m3ps2 / (p.radius_m * p.radius_m);
    outside(&PLANET, [p.radius_m, p.mu_m3ps2, p.rotation_radps, p.j2])
        .or_else(|| unless(SURFACE_GRAVITY_MPS2.admits(gravity), 1))
}

fn vehicle(v: &VehicleParameters) -> Option<u8> {
    let [mass, area, nose] = [v.mass_kg, v.reference_area_m2, v.nose_radius_m];
    outside(&VEHICLE, [mass, area, nose, v.drag_coefficient, v.lift_to_drag, v.trim_angle_of_attack_rad])
}

fn aero_rows(start: u8, total: u8, rows: &[AeroRow; ROWS_PER_BLOCK]) -> Option<u8> {
    let values = rows.map(|r| [r.mach, r.drag_coefficient, r.lift_coefficient]);
    rows_outside(&AERO_ROW, start, total, values)
}

fn atmosphere(a: &AtmosphereParameters) -> Option<u8> {
    let exponential = [a.reference_density_kgpm3, a.reference_altitude_m, a.scale_height_m];
    let [density, altitude, scale_height] = exponential;
    outside(&ATMOSPHERE, [density, altitude, scale_height, a.temperature_k, a.gas_constant_jpkgk, a.heat_ratio])
}

fn atmosphere_rows(start: u8, total: u8, rows: &[AtmosphereRow; ROWS_PER_BLOCK]) -> Option<u8> {
    let values = rows.map(|r| [r.altitude_m, r.density_kgpm3, r.temperature_k]);
    rows_outside(&ATMOSPHERE_ROW, start, total, values)
}

fn target(t: &Target) -> Option<u8> {
    outside(&TARGET, [t.longitude_rad, t.latitude_rad])
}

fn deploy(d: &DeployParameters) -> Option<u8> {
    let fields = [
        d.speed_mps,
        d.window_min_speed_mps,
        d.window_max_speed_mps,
        d.floor_altitude_m,
        d.min_altitude_m,
        d.max_altitude_m,
        d.min_mach,
        d.max_mach,
        d.min_dynamic_pressure_pa,
        d.max_dynamic_pressure_pa,
    ];
    outside(&DEPLOY, fields)
        .or_else(|| unless(d.window_min_speed_mps < d.window_max_speed_mps, 2))
        .or_else(|| unless(d.min_altitude_m < d.max_altitude_m, 5))
        .or_else(|| unless(d.min_mach < d.max_mach, 7))
        .or_else(|| unless(d.min_dynamic_pressure_pa < d.max_dynamic_pressure_pa, 9))
}

/// Field 0 is the slot, which the caller checks.
fn radio_source(source: &RadioSource) -> Option<u8> {
    match source {
        RadioSource::None => None,
        RadioSource::Orbiter { position_m, velocity_mps } => {
            let [position, velocity] = &ORBITER;
            unless(all_within(position, position_m) && norm(position_m) > 0.0, 1)
                .or_else(|| unless(all_within(velocity, velocity_mps), 2))
        }
        RadioSource::Beacon { longitude_rad, latitude_rad, altitude_m } => {
            outside(&BEACON, [*longitude_rad, *latitude_rad, *altitude_m]).map(|index| index + 1)
        }
    }
}

fn initial_knowledge(k: &InitialKnowledge) -> Option<u8> {
    let [position, velocity, attitude, sigmas @ ..] = &INITIAL_KNOWLEDGE;
    let unit = abs(norm(&k.attitude) - 1.0) <= QUATERNION_TOLERANCE;
    unless(all_within(position, &k.position_m) && norm(&k.position_m) > 0.0, 0)
        .or_else(|| unless(all_within(velocity, &k.velocity_mps), 1))
        .or_else(|| unless(all_within(attitude, &k.attitude) && unit, 2))
        .or_else(|| {
            outside(sigmas, [k.position_sigma_m, k.velocity_sigma_mps, k.attitude_sigma_rad]).map(|index| index + 3)
        })
}

fn navigation(n: &NavigationParameters) -> Option<u8> {
    let fields = [
        n.accelerometer_bias_sigma_mps2,
        n.accelerometer_scale_sigma,
        n.accelerometer_misalignment_sigma_rad,
        n.accelerometer_noise,
        n.gyro_bias_sigma_radps,
        n.gyro_scale_sigma,
        n.gyro_noise,
        n.log_density_sigma,
        n.log_density_length_m,
        n.pressure_scale_sigma,
        n.pressure_offset_sigma_pa,
        n.pressure_noise,
        n.pressure_min_dynamic_pa,
        n.range_noise_m,
        n.range_rate_noise_mps,
        n.min_elevation_rad,
        n.gate_sigma,
    ];
    outside(&NAVIGATION, fields)
}

fn estimators(e: &EstimatorParameters) -> Option<u8> {
    let fields = [
        e.unmodelled_share,
        e.calibrated_share,
        e.spacing_share,
        e.modelled_share,
        e.error_correlation_s,
        e.lift_sigma,
        e.input_growth_mps2,
        e.calibration_start_s,
        e.calibration_s,
        e.calibration_share,
        e.calibration_fade_s,
        e.gating_rate,
        e.switching_stay,
        e.weight_floor,
        e.rank_threshold,
        e.free_threshold,
    ];
    outside(&ESTIMATORS, fields)
}

fn guidance(g: &GuidanceParameters) -> Option<u8> {
    let fields = [
        g.predictor_step_s,
        g.prediction_horizon_s,
        g.tolerance_m,
        g.bank_increment_rad,
        f64::from(g.max_iterations),
        g.min_bank_rad,
        g.max_bank_rad,
        g.threshold_constant_m,
        g.threshold_linear_s,
        g.threshold_quadratic_s2pm,
        g.range_control_load_mps2,
        g.alignment_speed_mps,
        g.alignment_gain_ps,
        g.alignment_max_bank_rad,
        g.alignment_freeze_range_m,
        g.late_alignment_speed_mps,
        g.range_alignment_speed_mps,
        g.reversal_share,
    ];
    outside(&GUIDANCE, fields)
        .or_else(|| unless(g.prediction_horizon_s <= MAX_HORIZON_STEPS * g.predictor_step_s, 1))
        .or_else(|| unless(g.min_bank_rad < g.max_bank_rad, 6))
}

fn constraints(c: &ConstraintParameters) -> Option<u8> {
    outside(&CONSTRAINTS, [c.load_mps2, c.heat_flux_wpm2, c.dynamic_pressure_pa])
}

fn control(c: &ControlParameters) -> Option<u8> {
    outside(&CONTROL, [c.initial_bank_rad, c.max_rate_radps, c.max_accel_radps2, c.lag_s])
}
