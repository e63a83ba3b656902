//! The flight equations and the truth were written apart: planet-fixed rotating axes there, inertial axes here. Told the
//! same planet, air and vehicle they must fly the same path.

use fsw_core::config::Config;
use fsw_core::frames::{PlanetRelative, Vec3};
use fsw_core::math::rk4;
use fsw_core::model::OnboardModel;
use fsw_core::model::entry::cartesian_rates;
use fsw_core::units::rad;
use hil_sim::case::Case;
use hil_sim::dynamics::{Motion, World};
use hil_sim::scenario::Scenario;

/// Both ends of a scenario: the truth's world without dispersions and the model the flight software would build.
fn both(name: &str, changes: &[&str]) -> (World, OnboardModel, PlanetRelative) {
    let changes: Vec<String> = changes.iter().map(|c| (*c).to_owned()).collect();
    let scenario = Scenario::resolve(name, &changes).unwrap_or_else(|e| panic!("{e}"));
    let mut config = Config::DEFAULT;
    for block in scenario.parameter_blocks() {
        config.apply(&block).unwrap_or_else(|e| panic!("{e:?}"));
    }
    let model = OnboardModel::new(
        config.planet,
        &config.vehicle,
        &config.aero_rows,
        &config.atmosphere,
        &config.atmosphere_rows,
    )
    .expect("a built-in scenario makes a model");
    let world = Case::draw(&scenario, 1, 0, true).world;
    let entry = scenario.entry.planet_relative(&scenario.planet.si());
    (world, model, entry)
}

/// Flies both from one state at a constant bank and returns the distance (m) and the velocity difference (m/s) at the end.
fn difference(world: &World, model: &OnboardModel, start: &PlanetRelative, bank_rad: f64, seconds: u32) -> (f64, f64) {
    let (r, v) = start.to_cartesian();
    let mut flight = [r.x(), r.y(), r.z(), v.x(), v.y(), v.z()];
    let mut truth = Motion::at_epoch(start, &world.planet);
    let (sine, cosine) = (bank_rad.sin(), bank_rad.cos());
    // Steps of 50 ms: the truncation of either form stays below a tenth of a millimetre.
    for _ in 0..20 * seconds {
        flight = rk4(&flight, 0.05, |_, s| cartesian_rates(model, s, cosine, sine));
        truth = world.step(&truth, 0.05, |_| bank_rad);
    }
    let (r_end, v_end) = truth.planet_relative(f64::from(seconds), &world.planet).to_cartesian();
    let [x, y, z, vx, vy, vz] = flight;
    ((r_end - Vec3::new(x, y, z)).norm(), (v_end - Vec3::new(vx, vy, vz)).norm())
}

#[test]
fn flight_equations_and_truth_fly_the_same_path_on_a_rotating_oblate_planet() {
    let (world, model, entry) = both("msl", &[]);
    for bank_deg in [-130.0, -42.0, 0.0, 20.0, 75.0, 180.0] {
        let (metres, metres_per_s) = difference(&world, &model, &entry, rad(bank_deg), 200);
        assert!(metres < 1e-3 && metres_per_s < 1e-5, "bank {bank_deg}°: {metres:e} m, {metres_per_s:e} m/s");
    }
}

#[test]
fn they_agree_from_any_heading_and_latitude() {
    let (world, model, entry) = both("paper-exp40", &["planet.rotation_radps=7.088218e-5", "planet.j2=1.96045e-3"]);
    for (latitude, heading, path) in [(0.0, 0.0, -12.0), (70.0, -135.0, -15.0), (-55.0, 250.0, -20.0)] {
        let start = PlanetRelative {
            latitude_rad: rad(latitude),
            heading_rad: rad(heading),
            flight_path_angle_rad: rad(path),
            ..entry
        };
        let (metres, metres_per_s) = difference(&world, &model, &start, rad(-60.0), 150);
        assert!(metres < 1e-3 && metres_per_s < 1e-5, "{latitude} {heading}: {metres:e} m, {metres_per_s:e} m/s");
    }
}

#[test]
fn a_wrong_sign_of_bank_would_be_seen() {
    let (world, model, entry) = both("msl", &[]);
    let (r, v) = entry.to_cartesian();
    let state = [r.x(), r.y(), r.z(), v.x(), v.y(), v.z()];
    let bank = rad(42.0);
    let mut flight = state;
    let mut truth = Motion::at_epoch(&entry, &world.planet);
    for _ in 0..150 * 20 {
        flight = rk4(&flight, 0.05, |_, s| cartesian_rates(&model, s, bank.cos(), bank.sin()));
        truth = world.step(&truth, 0.05, |_| -bank);
    }
    let (r_end, _) = truth.planet_relative(150.0, &world.planet).to_cartesian();
    assert!((r_end - Vec3::new(flight[0], flight[1], flight[2])).norm() > 10_000.0);
}
