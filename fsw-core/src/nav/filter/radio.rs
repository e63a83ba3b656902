//! Range and range-rate to a source whose inertial state is known: an orbiter or a surface beacon.

use super::measurement::{Observation, Sensitivity};
use crate::frames::{Inertial, Vec3};
use crate::link::packet::MeasurementKind;
use crate::link::parameters::NavigationParameters;
use crate::math::fun::sin;
use crate::model::orbiter::SourceState;
use crate::nav::strapdown::Nominal;
use crate::planet::Planet;
use crate::sensors::RadioMeasurement;

/// Forms the observations of range and range-rate against the nominal state.
///
/// ρ = |d|, d = r − r_s; ρ' = d·w/ρ, w = v − v_s. ∂ρ/∂r = u = d/ρ; ∂ρ'/∂v = u; ∂ρ'/∂r = (w − u ρ')/ρ.
/// Not valid when the source is unknown or below the smallest elevation.
#[must_use]
pub fn observe(
    input: &RadioMeasurement,
    state: &mut SourceState,
    nominal: &Nominal,
    planet: &Planet,
    parameters: &NavigationParameters,
) -> [Observation; 2] {
    let blank = Observation { time: input.time, source: input.source, ..Observation::default() };
    let unknown = [
        Observation { kind: MeasurementKind::Range, ..blank },
        Observation { kind: MeasurementKind::RangeRate, ..blank },
    ];
    let Ok((r_s, v_s)) = state.at(planet, input.time) else { return unknown };
    let d = nominal.r_i - r_s;
    let w = nominal.v_i - v_s;
    let range = d.norm();
    let Some(u) = d.unit() else { return unknown };
    let range_rate = u.dot(&w);
    let valid = elevation_sine(state, &nominal.r_i, &r_s, &u) >= sin(parameters.min_elevation_rad);
    [
        Observation {
            kind: MeasurementKind::Range,
            innovation: input.range_m - range,
            noise_variance: parameters.range_noise_m * parameters.range_noise_m,
            sensitivity: Sensitivity { position: u.to_array(), ..Sensitivity::default() },
            valid,
            ..blank
        },
        Observation {
            kind: MeasurementKind::RangeRate,
            innovation: input.range_rate_mps - range_rate,
            noise_variance: parameters.range_rate_noise_mps * parameters.range_rate_noise_mps,
            sensitivity: Sensitivity {
                position: ((w - u * range_rate) * (1.0 / range)).to_array(),
                velocity: u.to_array(),
                ..Sensitivity::default()
            },
            valid,
            ..blank
        },
    ]
}

/// Sine of the elevation over the horizon of whichever end lies lower: the vehicle for an orbiter, a beacon for itself.
/// `u` is the direction from source to vehicle.
fn elevation_sine(state: &SourceState, r: &Vec3<Inertial>, r_s: &Vec3<Inertial>, u: &Vec3<Inertial>) -> f64 {
    match state {
        SourceState::Beacon(_) => r_s.unit().map_or(-1.0, |up| up.dot(u)),
        _ => r.unit().map_or(-1.0, |up| -up.dot(u)),
    }
}
