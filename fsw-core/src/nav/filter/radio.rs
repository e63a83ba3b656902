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
/// Not valid when the source is unknown or below the smallest elevation, [`lowest_sine`].
#[must_use]
pub fn observe(
    input: &RadioMeasurement,
    state: &mut SourceState,
    nominal: &Nominal,
    planet: &Planet,
    parameters: &NavigationParameters,
    lowest_sine: f64,
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
    let valid = is_visible(state, &nominal.r_i, &r_s, &u, lowest_sine);
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

/// Sine of the elevation below which a source is not used, once for all that are read in a frame.
#[must_use]
pub fn lowest_sine(parameters: &NavigationParameters) -> f64 {
    sin(parameters.min_elevation_rad)
}

/// True when the source at `r_s` stands high enough above the horizon to be used from `r`; `u` points from source to vehicle, and
/// the limit is [`lowest_sine`].
#[must_use]
pub fn is_visible(
    state: &SourceState,
    r: &Vec3<Inertial>,
    r_s: &Vec3<Inertial>,
    u: &Vec3<Inertial>,
    lowest_sine: f64,
) -> bool {
    elevation_sine(state, r, r_s, u) >= lowest_sine
}

/// Sine of the elevation over the horizon of whichever end lies lower: the vehicle for an orbiter, a beacon for itself.
/// `u` is the direction from source to vehicle.
fn elevation_sine(state: &SourceState, r: &Vec3<Inertial>, r_s: &Vec3<Inertial>, u: &Vec3<Inertial>) -> f64 {
    match state {
        SourceState::Beacon(_) => r_s.unit().map_or(-1.0, |up| up.dot(u)),
        _ => r.unit().map_or(-1.0, |up| -up.dot(u)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::link::parameters::RadioSource;
    use crate::planet::MARS;
    use crate::time::MissionTime;

    const INPUT: RadioMeasurement =
        RadioMeasurement { time: MissionTime(30_000_000), source: 1, range_m: 1e6, range_rate_mps: 100.0 };

    fn beacon() -> SourceState {
        SourceState::new(&RadioSource::Beacon { longitude_rad: 0.01, latitude_rad: 0.02, altitude_m: 100.0 }, &MARS)
    }

    fn overhead() -> Nominal {
        Nominal {
            r_i: Vec3::new(MARS.radius_m + 30e3, 1e3, -2e3),
            v_i: Vec3::new(-300.0, 900.0, 200.0),
            ..Nominal::default()
        }
    }

    fn observed(nominal: &Nominal, state: &mut SourceState) -> [Observation; 2] {
        let parameters = &Config::DEFAULT.navigation;
        observe(&INPUT, state, nominal, &MARS, parameters, lowest_sine(parameters))
    }

    #[test]
    fn sensitivities_are_the_derivatives_of_the_prediction() {
        let nominal = overhead();
        let found = observed(&nominal, &mut beacon());
        for k in 0..3 {
            let mut step = [0.0; 3];
            step[k] = 1.0;
            let step = Vec3::from_array(step);
            let [plus, minus] =
                [1.0, -1.0].map(|s| observed(&Nominal { r_i: nominal.r_i + step * s, ..nominal }, &mut beacon()));
            let [fast, slow] =
                [1.0, -1.0].map(|s| observed(&Nominal { v_i: nominal.v_i + step * s, ..nominal }, &mut beacon()));
            for i in 0..2 {
                let by_position = (minus[i].innovation - plus[i].innovation) / 2.0;
                let by_velocity = (slow[i].innovation - fast[i].innovation) / 2.0;
                // Third derivative over a step of 1 m at 60 km: 1e-9 of V/ρ.
                assert!((found[i].sensitivity.position[k] - by_position).abs() < 1e-7);
                assert!((found[i].sensitivity.velocity[k] - by_velocity).abs() < 1e-7);
            }
        }
        assert!(found.iter().all(|o| o.valid));
    }

    #[test]
    fn an_unknown_source_is_out_of_validity() {
        let found = observed(&overhead(), &mut SourceState::None);
        assert!(found.iter().all(|o| !o.valid && o.source == 1 && o.time == INPUT.time));
        assert_eq!(found.map(|o| o.kind), [MeasurementKind::Range, MeasurementKind::RangeRate]);
    }

    #[test]
    fn a_source_below_the_smallest_elevation_is_out_of_validity() {
        let low = Nominal { r_i: Vec3::new(MARS.radius_m * 0.97, MARS.radius_m * 0.243 + 5e3, 0.0), ..overhead() };
        assert!(low.r_i.norm() > MARS.radius_m);
        assert!(observed(&low, &mut beacon()).iter().all(|o| !o.valid));
    }
}
