//! Open-loop entries on which independent codes agree (spec `truth-and-flight.md` §1): the flight equations, both forms,
//! flown by Runge–Kutta through each of them.

use std::vec::Vec;

use super::OnboardModel;
use super::entry::{cartesian_rates, spherical_rates};
use super::loads::Loads;
use crate::frames::{PlanetRelative, Vec3};
use crate::math::rk4;
use crate::model::parameters::{AtmosphereParameters, VehicleParameters};
use crate::planet::{Planet, STANDARD_GRAVITY_MPS2};
use crate::units::{deg, rad};

/// An open-loop entry: 125 km over longitude 0 on the equator, due east, 5505 m/s, −14.15°, β 146 kg/m², stop at 10 km.
#[derive(Clone, Copy)]
pub(crate) struct Case {
    pub(crate) planet: Planet,
    /// Density (kg/m³) at an altitude (m), scale height (m).
    pub(crate) air: (f64, f64, f64),
    pub(crate) lift_to_drag: f64,
    pub(crate) bank_deg: f64,
}

const SPHERE: Planet = Planet { radius_m: 3_389_500.0, mu_m3ps2: 4.282_837e13, rotation_radps: 0.0, j2: 0.0 };

impl Case {
    pub(crate) const EXP40: Self =
        Self { planet: SPHERE, air: (2e-4, 40e3, 7500.0), lift_to_drag: 0.24, bank_deg: 60.0 };
    pub(crate) const EXP0: Self = Self { air: (0.0158, 0.0, 9354.0), ..Self::EXP40 };
    const ROTATING: Self =
        Self { planet: Planet { rotation_radps: 7.088_253e-5, ..SPHERE }, bank_deg: -60.0, ..Self::EXP40 };
    const BALLISTIC: Self = Self { lift_to_drag: 0.0, ..Self::EXP40 };
}

pub(crate) fn model_of(case: &Case) -> OnboardModel {
    let (reference_density_kgpm3, reference_altitude_m, scale_height_m) = case.air;
    let vehicle = VehicleParameters {
        mass_kg: 146.0 * 15.9 * 1.45,
        reference_area_m2: 15.9,
        nose_radius_m: 1.125,
        drag_coefficient: 1.45,
        lift_to_drag: case.lift_to_drag,
        trim_angle_of_attack_rad: rad(-16.0),
    };
    let air = AtmosphereParameters {
        reference_density_kgpm3,
        reference_altitude_m,
        scale_height_m,
        temperature_k: 180.0,
        gas_constant_jpkgk: 188.92,
        heat_ratio: 1.3,
    };
    OnboardModel::new(case.planet, &vehicle, &[], &air, &[]).unwrap()
}

/// What the published table lists.
struct Flown {
    time_s: f64,
    speed_mps: f64,
    longitude_deg: f64,
    latitude_deg: f64,
    peak_load_g: f64,
    peak_time_s: f64,
}

const STEP_S: f64 = 0.05;

/// Flies `step(state, duration)` from `state` to `altitude(state) = 10 km`; `describe` gives the spherical state.
fn fly(
    model: &OnboardModel,
    mut state: [f64; 6],
    step: impl Fn(&[f64; 6], f64) -> [f64; 6],
    describe: impl Fn(&[f64; 6]) -> PlanetRelative,
) -> Flown {
    let altitude = |state: &[f64; 6]| describe(state).radius_m - model.planet.radius_m;
    let load = |state: &[f64; 6]| {
        Loads::expected(model, altitude(state), describe(state).speed_mps).sensed_load_mps2 / STANDARD_GRAVITY_MPS2
    };
    let mut loads = Vec::new();
    while altitude(&step(&state, STEP_S)) > 10e3 {
        loads.push(load(&state));
        state = step(&state, STEP_S);
        assert!(loads.len() < 20_000, "never came down");
    }
    // Bisection on the length of the last step: 60 halvings of 0.05 s.
    let (mut early, mut late) = (0.0, STEP_S);
    for _ in 0..60 {
        let middle = 0.5 * (early + late);
        if altitude(&step(&state, middle)) > 10e3 { early = middle } else { late = middle }
    }
    let end = describe(&step(&state, late));
    // Parabola through the three loads around the largest.
    let top = (1..loads.len() - 1).max_by(|&a, &b| loads[a].total_cmp(&loads[b])).unwrap();
    let (before, peak, after) = (loads[top - 1], loads[top], loads[top + 1]);
    let shift = 0.5 * (before - after) / (before - 2.0 * peak + after);
    Flown {
        time_s: loads.len() as f64 * STEP_S + late,
        speed_mps: end.speed_mps,
        longitude_deg: deg(end.longitude_rad),
        latitude_deg: deg(end.latitude_rad),
        peak_load_g: peak - 0.25 * (before - after) * shift,
        peak_time_s: (top as f64 + shift) * STEP_S,
    }
}

fn start(case: &Case) -> PlanetRelative {
    PlanetRelative {
        radius_m: case.planet.radius_m + 125e3,
        longitude_rad: 0.0,
        latitude_rad: 0.0,
        speed_mps: 5505.0,
        flight_path_angle_rad: rad(-14.15),
        heading_rad: rad(90.0),
    }
}

fn fly_cartesian(case: &Case) -> Flown {
    let model = model_of(case);
    let (sine, cosine) = rad(case.bank_deg).sin_cos();
    let (r, v) = start(case).to_cartesian();
    let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
    fly(
        &model,
        [x, y, z, vx, vy, vz],
        |state, duration| rk4(state, duration, |_, s| cartesian_rates(&model, s, cosine, sine)),
        |&[x, y, z, vx, vy, vz]| PlanetRelative::from_cartesian(&Vec3::new(x, y, z), &Vec3::new(vx, vy, vz)),
    )
}

fn fly_spherical(case: &Case) -> Flown {
    let model = model_of(case);
    let (sine, cosine) = rad(case.bank_deg).sin_cos();
    let s = start(case);
    fly(
        &model,
        [s.radius_m, s.longitude_rad, s.latitude_rad, s.speed_mps, s.flight_path_angle_rad, s.heading_rad],
        |state, duration| rk4(state, duration, |_, s| spherical_rates(&model, s, cosine, sine)),
        |&[radius_m, longitude_rad, latitude_rad, speed_mps, flight_path_angle_rad, heading_rad]| PlanetRelative {
            radius_m,
            longitude_rad,
            latitude_rad,
            speed_mps,
            flight_path_angle_rad,
            heading_rad,
        },
    )
}

/// Both forms must give `value` within `tolerance`.
#[track_caller]
fn published(case: &Case, what: fn(&Flown) -> f64, value: f64, tolerance: f64) {
    for (form, flown) in [("cartesian", fly_cartesian(case)), ("spherical", fly_spherical(case))] {
        let found = what(&flown);
        assert!((found - value).abs() < tolerance, "{form}: {found} for {value}");
    }
}

// Tolerances are the last digit printed, or the agreement of the independent codes (0.02 ms, 0.3 mm/s) where that is larger.

#[test]
fn exp40_peaks_and_ends_as_published() {
    published(&Case::EXP40, |f| f.peak_load_g, 11.3099, 1e-4);
    published(&Case::EXP40, |f| f.peak_time_s, 97.82, 6e-3);
    published(&Case::EXP40, |f| f.time_s, 216.041_80, 3e-5);
    published(&Case::EXP40, |f| f.speed_mps, 394.6092, 3e-4);
}

#[test]
fn exp0_ends_as_published() {
    published(&Case::EXP0, |f| f.time_s, 190.626_94, 3e-5);
    published(&Case::EXP0, |f| f.speed_mps, 694.0642, 3e-4);
}

#[test]
fn exp40_over_a_rotating_planet_ends_as_published() {
    published(&Case::ROTATING, |f| f.time_s, 243.714_75, 3e-5);
    published(&Case::ROTATING, |f| f.speed_mps, 390.7572, 3e-4);
    published(&Case::ROTATING, |f| f.latitude_deg, 0.844_405_5, 1e-7);
    published(&Case::ROTATING, |f| f.longitude_deg, 11.486_048_9, 1e-7);
    published(&Case { bank_deg: 60.0, ..Case::ROTATING }, |f| f.latitude_deg, -0.844_405_5, 1e-7);
}

#[test]
fn exp40_without_lift_ends_as_published() {
    published(&Case::BALLISTIC, |f| f.time_s, 124.602_311, 3e-5);
    published(&Case::BALLISTIC, |f| f.speed_mps, 1115.4229, 3e-4);
}
