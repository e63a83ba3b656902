//! Stagnation pressure: a measure of density, through it weakly of altitude.

use super::measurement::{Observation, Sensitivity};
use crate::frames::{Inertial, Vec3};
use crate::link::packet::MeasurementKind;
use crate::link::parameters::NavigationParameters;
use crate::math::fun::{exp, floor};
use crate::math::num::clamp;
use crate::model::OnboardModel;
use crate::nav::strapdown::Nominal;
use crate::planet::{PITOT_COEFFICIENT, PITOT_MACH_STEP};
use crate::time::MissionTime;

/// Forms the observation of a stagnation pressure (Pa) against the nominal state and the estimated log-density.
///
/// p_t = ρ (R T + ½ C_p(M) V²) with ρ = ρ_model(h)·exp(x). Derivatives: p_t with respect to x; p_t·d(ln ρ_model)/dh along the
/// vertical (temperature taken as constant over an altitude error); ρ(C_p + ½ M dC_p/dM)·v_rel with respect to velocity.
/// Air at rest relative to the planet. Valid above the smallest estimated dynamic pressure of the parameters.
#[must_use]
pub fn observe(
    time: MissionTime,
    measured_pa: f64,
    nominal: &Nominal,
    log_density: f64,
    model: &OnboardModel,
    parameters: &NavigationParameters,
) -> Observation {
    let planet = &model.planet;
    let radius = nominal.r_i.norm();
    let altitude = radius - planet.radius_m;
    let v_rel = nominal.v_i - Vec3::<Inertial>::new(0.0, 0.0, planet.rotation_radps).cross(&nominal.r_i);
    let speed = v_rel.norm();
    let density = model.atmosphere.density(altitude) * exp(log_density);
    let sound = model.atmosphere.speed_of_sound_mps(altitude);
    let mach = speed / sound;
    let (coefficient, slope) = pitot_coefficient(mach);
    let dynamic = 0.5 * density * speed * speed;
    let predicted = density * model.atmosphere.gas_constant_jpkgk() * model.atmosphere.temperature_k(altitude)
        + coefficient * dynamic;

    let vertical = predicted * model.atmosphere.log_density_slope_pm(altitude) / radius;
    let along = density * (coefficient + 0.5 * mach * slope);
    let noise = parameters.pressure_noise * predicted;
    Observation {
        time,
        kind: MeasurementKind::Pressure,
        source: 0,
        innovation: measured_pa - predicted,
        noise_variance: noise * noise,
        sensitivity: Sensitivity {
            position: (nominal.r_i * vertical).to_array(),
            velocity: (v_rel * along).to_array(),
            log_density: predicted,
            pressure_scale: predicted,
            pressure_offset: 1.0,
        },
        valid: dynamic >= parameters.pressure_min_dynamic_pa,
    }
}

/// C_p,max beyond the table.
const PITOT_HYPERSONIC: f64 = match PITOT_COEFFICIENT {
    [.., last] => last,
};

/// C_p,max and its derivative at a Mach number: linear in [`PITOT_COEFFICIENT`], constant above its end.
fn pitot_coefficient(mach: f64) -> (f64, f64) {
    let last = PITOT_COEFFICIENT.len() - 1;
    let x = clamp(mach / PITOT_MACH_STEP, 0.0, last as f64);
    let whole = floor(x);
    let (low, high) = match PITOT_COEFFICIENT.get(whole as u8 as usize..) {
        Some([low, high, ..]) => (*low, *high),
        _ => (PITOT_HYPERSONIC, PITOT_HYPERSONIC),
    };
    (low + (x - whole) * (high - low), (high - low) / PITOT_MACH_STEP)
}
