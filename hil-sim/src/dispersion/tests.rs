use super::*;
use crate::scenario::Dispersion;
use fsw_core::frames::{along_and_across_rad, planet_relative_from_inertial};
use fsw_core::time::MissionTime;

fn msl() -> Scenario {
    Scenario::builtin("msl").unwrap()
}

fn value(case: &Case, name: &str) -> f64 {
    case.applied.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("{name}")).1
}

#[test]
fn the_same_run_of_the_same_seed_is_the_same_whatever_else_was_drawn() {
    let scenario = msl();
    let first = Case::draw(&scenario, 7, 3, false);
    let _ = Case::draw(&scenario, 7, 2, false);
    assert_eq!(first.applied, Case::draw(&scenario, 7, 3, false).applied);
    assert_ne!(first.applied, Case::draw(&scenario, 7, 4, false).applied);
    assert_ne!(first.applied, Case::draw(&scenario, 8, 3, false).applied);
}

#[test]
fn one_quantitys_draw_never_shifts_anothers() {
    let scenario = msl();
    let mut other = scenario.clone();
    other.dispersions.speed_mps = Dispersion::None;
    other.dispersions.density_bias = Dispersion::Uniform { bounds: [-0.1, 0.1] };
    other.dispersions.winds = true;
    other.atmosphere.perturbation.sigma = 0.03;
    other.navigation.position_sigma_m *= 2.0;
    let (a, b) = (Case::draw(&scenario, 1, 1, false), Case::draw(&other, 1, 1, false));
    for ((name, x), (_, y)) in a.applied.iter().zip(&b.applied) {
        let changed = ["speed_mps", "density_bias"].contains(name) || name.starts_with("wind_");
        let scaled = ["knowledge_x_m", "knowledge_y_m", "knowledge_z_m"].contains(name);
        let expected = if scaled { 2.0 * x } else { *x };
        assert!(changed || *y == expected, "{name}: {x} {y}");
    }
}

#[test]
fn no_two_quantities_share_a_stream() {
    let case = Case::draw(&msl(), 5, 5, false);
    let mut names: Vec<_> = case.applied.iter().map(|(name, _)| *name).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}

#[test]
fn a_nominal_flight_has_nothing_drawn() {
    let case = Case::draw(&msl(), 7, 3, true);
    assert!(case.applied.iter().all(|(name, value)| *value == 0.0 || panic!("{name} {value}")));
    assert_eq!(case.imu.accelerometer_noise, 0.0);
    assert_eq!(case.radio.range_noise_m, 0.0);
    assert_eq!(case.knowledge.position_m, case.entry.r_i.to_array());
    assert_eq!(case.knowledge.position_sigma_m, 500.0);
    let state = case.entry.planet_relative(0.0, &case.world.planet);
    assert!((state.speed_mps - 5505.0).abs() < 1e-9 && (state.longitude_rad - rad(-90.072)).abs() < 1e-14);
    assert_eq!(case.world.atmosphere.dispersion.log_ratio(30e3), 0.0);
}

#[test]
fn two_thousand_draws_have_the_means_and_deviations_of_the_scenario() {
    let mut scenario = msl();
    scenario.dispersions.winds = true;
    let runs = 2000;
    let cases: Vec<Case> = (0..runs).map(|run| Case::draw(&scenario, 11, run, false)).collect();
    let check = |name: &str, mean: f64, sigma: f64| {
        let n = runs as f64;
        let average = cases.iter().map(|c| value(c, name)).sum::<f64>() / n;
        let variance = cases.iter().map(|c| (value(c, name) - average).powi(2)).sum::<f64>() / n;
        // Four standard errors of a mean (σ/√n) and of a deviation (σ/√2n).
        assert!((average - mean).abs() < 4.0 * sigma / n.sqrt(), "{name}: mean {average}");
        assert!((variance.sqrt() / sigma - 1.0).abs() < 4.0 / (2.0 * n).sqrt(), "{name}: {}", variance.sqrt());
    };
    for (name, dispersion) in scenario.dispersions.all() {
        match dispersion {
            Dispersion::Normal { three_sigma } => check(name, 0.0, three_sigma / 3.0),
            Dispersion::Uniform { bounds: [low, high] } => check(name, 0.5 * (low + high), (high - low) / 12f64.sqrt()),
            Dispersion::None => panic!("{name} should be drawn"),
        }
    }
    check("accelerometer_bias_y_ug", 0.0, 100.0);
    check("gyro_scale_z_ppm", 0.0, 100.0);
    check("knowledge_tilt_x_deg", 0.0, 0.03);
    check("pressure_offset_pa", 0.0, 15.0);
}

#[test]
fn uniform_draws_stay_within_their_bounds_and_zero_width_draws_nothing() {
    let mut scenario = msl();
    scenario.dispersions.speed_mps = Dispersion::Normal { three_sigma: 0.0 };
    for run in 0..200 {
        let case = Case::draw(&scenario, 1, run, false);
        assert!((10.0..=30.0).contains(&value(&case, "density_wave_length_km")));
        assert_eq!(value(&case, "speed_mps"), 0.0);
    }
}

#[test]
fn entry_dispersions_move_the_entry_by_what_they_say() {
    let mut scenario = msl();
    let fixed = |v: f64| Dispersion::Uniform { bounds: [v, v] };
    scenario.dispersions.along_track_km = fixed(6.0);
    scenario.dispersions.cross_track_km = fixed(3.0);
    scenario.dispersions.altitude_km = fixed(-2.0);
    scenario.dispersions.heading_deg = fixed(0.0);
    scenario.dispersions.flight_path_angle_deg = fixed(0.1);
    scenario.dispersions.speed_mps = fixed(-4.0);
    let (case, nominal) = (Case::draw(&scenario, 1, 1, false), Case::draw(&scenario, 1, 1, true));
    let omega = case.world.planet.rotation_radps;
    let fixed_axes = |m: &Motion| planet_relative_from_inertial(&m.r_i, &m.v_i, MissionTime::ZERO, omega);
    let ((r, _), (r0, v0)) = (fixed_axes(&case.entry), fixed_axes(&nominal.entry));
    // Downrange and crossrange along the arc that starts at the nominal entry in the direction of flight.
    let (along, across) = along_and_across_rad(&r0, &(r0 + v0), &r).unwrap();
    let arc = libm::atan2(r0.cross(&(r0 + v0)).norm(), r0.dot(&(r0 + v0)));
    let radius = nominal.entry.r_i.norm();
    assert!(((along + arc) * radius - 6000.0).abs() < 0.1 && (across * radius - 3000.0).abs() < 0.1);
    let state = case.entry.planet_relative(0.0, &case.world.planet);
    let base = nominal.entry.planet_relative(0.0, &case.world.planet);
    assert!(
        (state.radius_m - base.radius_m + 2000.0).abs() < 1e-6 && (state.speed_mps - base.speed_mps + 4.0).abs() < 1e-9
    );
    assert!((state.flight_path_angle_rad - base.flight_path_angle_rad - rad(0.1)).abs() < 1e-12);
}

#[test]
fn dispersed_vehicle_and_air_carry_their_fractions() {
    let case = Case::draw(&msl(), 3, 9, false);
    let vehicle = &case.world.vehicle;
    assert_eq!(vehicle.drag_factor, 1.0 + value(&case, "drag_coefficient"));
    assert_eq!(vehicle.mass_kg, 2804.0 * (1.0 + value(&case, "mass")));
    let h = 20e3;
    let (b, wl) = (value(&case, "density_bias"), value(&case, "density_wave_length_km") * 1e3);
    let wave = value(&case, "density_wave_amplitude")
        * (2.0 * core::f64::consts::PI * h / wl + rad(value(&case, "density_wave_phase_deg"))).sin();
    let expected = 0.0158 * (-h / 9354.0f64).exp() * (1.0 + b) * wave.exp();
    assert!((case.world.atmosphere.density_kgpm3(h) / expected - 1.0).abs() < 1e-12);
}

#[test]
fn the_navigator_starts_at_the_dispersed_truth_plus_its_error() {
    let case = Case::draw(&msl(), 3, 9, false);
    let error = case.knowledge.position_m[1] - case.entry.r_i.y();
    assert!((error - value(&case, "knowledge_y_m")).abs() < 1e-9);
    let truth = exact_knowledge(&case.world, &case.entry, case.bank.angle_rad);
    let attitude = |q| Rot::<Body, Inertial>::from_quaternion(q).unwrap();
    let turn = attitude(truth.attitude).inverse().then(&attitude(case.knowledge.attitude)).rotation_vector();
    let expected =
        ["knowledge_tilt_x_deg", "knowledge_tilt_y_deg", "knowledge_tilt_z_deg"].map(|n| rad(value(&case, n)));
    for axis in 0..3 {
        assert!((turn[axis] - expected[axis]).abs() < 1e-12);
    }
}
