//! The independent open-loop cases through the command that users have: scenario file, overrides, `propagate`. A
//! DOP853 reference and two public codes agree on these figures to 0.02 ms and 0.3 mm/s.

use fsw_core::units::rad;
use fsw_host::propagate::{Outcome, StopAt, fly};
use hil_sim::scenario::Scenario;
use system_tests::workspace;

fn outcome(case: &str, sets: &[&str], bank_deg: f64) -> Outcome {
    let path = workspace().join("tests/cases").join(case);
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let scenario = Scenario::resolve(path.to_str().expect("a plain path"), &sets).unwrap_or_else(|e| panic!("{e}"));
    let until = "altitude_km=10".parse::<StopAt>().expect("a stop").0;
    let outcome = Outcome::of(&fly(&scenario, rad(bank_deg), until, 1.0));
    // The stop is located to a nanosecond: at 200 m/s of sink rate that is well below a micrometre.
    assert!(outcome.reached && (outcome.altitude_m - 10_000.0).abs() < 1e-6, "{outcome:?}");
    outcome
}

fn assert_near(what: &str, value: f64, published: f64, tolerance: f64) {
    assert!((value - published).abs() <= tolerance, "{what}: {value}, published {published}");
}

#[test]
fn thin_air_at_sixty_degrees_of_bank() {
    for bank_deg in [60.0, -60.0] {
        let end = outcome("exp40.toml", &[], bank_deg);
        assert_near("time", end.time_s, 216.041_80, 1e-3);
        assert_near("speed", end.speed_mps, 394.6092, 5e-3);
        // Published to four decimals and to ten milliseconds.
        assert_near("peak load", end.peak.load_g, 11.3099, 1e-4);
        assert_near("its time", end.peak.load_time_s, 97.82, 1e-2);
    }
}

#[test]
fn thick_air_at_sixty_degrees_of_bank() {
    let end = outcome("exp0.toml", &[], -60.0);
    assert_near("time", end.time_s, 190.626_94, 1e-3);
    assert_near("speed", end.speed_mps, 694.0642, 5e-3);
}

#[test]
fn thin_air_over_a_turning_planet_with_lift_to_the_left() {
    let end = outcome("exp40.toml", &["planet.rotation_radps=7.088253e-5"], -60.0);
    assert_near("time", end.time_s, 243.714_75, 1e-3);
    assert_near("speed", end.speed_mps, 390.7572, 5e-3);
    assert_near("latitude", end.latitude_deg, 0.844_405_5, 1e-6);
    assert_near("longitude", end.longitude_deg, 11.486_048_9, 1e-6);
}

#[test]
fn lift_to_the_right_goes_south() {
    let end = outcome("exp40.toml", &["planet.rotation_radps=7.088253e-5"], 60.0);
    assert_near("latitude", end.latitude_deg, -0.844_405_5, 1e-6);
}

#[test]
fn a_body_without_lift() {
    let end = outcome("exp40.toml", &["vehicle.lift_to_drag=0"], 0.0);
    assert_near("time", end.time_s, 124.602_311, 1e-3);
    assert_near("speed", end.speed_mps, 1115.4229, 5e-3);
}
