//! The open-loop cases on which independent codes agree (doc: truth cross-checks), and located stops.

use fsw_core::planet::Planet;
use fsw_core::units::{deg, rad};

use super::*;
use crate::aero::{Coefficients, Vehicle};
use crate::atmosphere::{Atmosphere, DensityDispersion, Profile};
use crate::wind::Wind;

/// The case of the cross-check: β 146 kg/m², R 3389.5 km, μ 4.282837e13, no J2.
fn world(reference: (f64, f64, f64), lift_to_drag: f64, rotation_radps: f64) -> World {
    let (reference_density_kgpm3, reference_altitude_m, scale_height_m) = reference;
    World {
        planet: Planet { radius_m: 3.3895e6, mu_m3ps2: 4.282837e13, rotation_radps, j2: 0.0 },
        atmosphere: Atmosphere {
            profile: Profile::Exponential {
                reference_density_kgpm3,
                reference_altitude_m,
                scale_height_m,
                temperature_k: 150.0,
            },
            density_scale: 1.0,
            dispersion: DensityDispersion::default(),
            gas_constant_jpkgk: 188.92,
            heat_ratio: 1.3,
        },
        wind: Wind::default(),
        vehicle: Vehicle {
            mass_kg: 146.0,
            reference_area_m2: 1.0,
            nose_radius_m: 0.6,
            trim_angle_of_attack_rad: rad(-16.0),
            coefficients: Coefficients::Constant { drag: 1.0, lift: lift_to_drag },
            drag_factor: 1.0,
            lift_factor: 1.0,
        },
    }
}

const EXP40: (f64, f64, f64) = (2e-4, 40e3, 7.5e3);
const EXP0: (f64, f64, f64) = (0.0158, 0.0, 9354.0);

fn entry(world: &World) -> Motion {
    let state = PlanetRelative {
        radius_m: world.planet.radius_m + 125e3,
        longitude_rad: 0.0,
        latitude_rad: 0.0,
        speed_mps: 5505.0,
        flight_path_angle_rad: rad(-14.15),
        heading_rad: rad(90.0),
    };
    Motion::at_epoch(&state, &world.planet)
}

fn fly(world: &World, bank_deg: f64, until: Until) -> Flight {
    propagate(world, &entry(world), rad(bank_deg), until, 1000.0, 1.0)
}

fn assert_end(flight: &Flight, time_s: f64, speed_mps: f64) {
    assert!(flight.reached);
    // 1 ms and 5 mm/s are asked for; the table gives 0.01 ms and 0.1 mm/s, and so do we, to its last digits.
    assert!((flight.end.time_s - time_s).abs() < 5e-5, "t {}", flight.end.time_s);
    assert!((flight.end.state.speed_mps - speed_mps).abs() < 5e-4, "V {}", flight.end.state.speed_mps);
    assert!((flight.end.altitude_m - 10e3).abs() < 1e-5);
}

#[test]
fn thin_air_without_rotation_agrees_with_independent_codes() {
    let flight = fly(&world(EXP40, 0.24, 0.0), 60.0, Until::AltitudeM(10e3));
    assert_end(&flight, 216.041_80, 394.6092);
    assert!((flight.peaks.load_g.value - 11.3099).abs() < 1e-4, "{:?}", flight.peaks.load_g);
    assert!((flight.peaks.load_g.time_s - 97.82).abs() < 0.01, "{:?}", flight.peaks.load_g);
}

#[test]
fn thick_air_without_rotation_agrees_with_independent_codes() {
    assert_end(&fly(&world(EXP0, 0.24, 0.0), 60.0, Until::AltitudeM(10e3)), 190.626_94, 694.0642);
}

#[test]
fn a_ballistic_entry_agrees_with_independent_codes() {
    assert_end(&fly(&world(EXP40, 0.0, 0.0), 60.0, Until::AltitudeM(10e3)), 124.602_311, 1115.4229);
}

#[test]
fn with_rotation_a_bank_to_the_left_of_east_goes_north_as_in_independent_codes() {
    let rotating = world(EXP40, 0.24, 7.088_253e-5);
    let left = fly(&rotating, -60.0, Until::AltitudeM(10e3));
    assert_end(&left, 243.714_75, 390.7572);
    assert!((deg(left.end.state.latitude_rad) - 0.844_405_5).abs() < 1e-6, "{}", deg(left.end.state.latitude_rad));
    assert!((deg(left.end.state.longitude_rad) - 11.486_048_9).abs() < 1e-6);
    let right = fly(&rotating, 60.0, Until::AltitudeM(10e3));
    assert!((deg(right.end.state.latitude_rad) + 0.844_405_5).abs() < 1e-6, "{}", deg(right.end.state.latitude_rad));
}

#[test]
fn every_kind_of_stop_is_met_to_a_nanosecond() {
    let world = world(EXP0, 0.24, 7.088e-5);
    let tolerance_s = 1e-9;
    let end = |until| fly(&world, 40.0, until).end;
    let by_speed = end(Until::SpeedMps(1000.0));
    assert!((by_speed.state.speed_mps - 1000.0).abs() < 100.0 * tolerance_s);
    let by_range = end(Until::RangeM(300e3));
    assert!((by_range.range_m - 300e3).abs() < 6000.0 * tolerance_s);
    let by_time = end(Until::TimeS(123.456_789_012));
    assert!((by_time.time_s - 123.456_789_012).abs() < tolerance_s);
    // The same instant, found by altitude.
    let by_altitude = end(Until::AltitudeM(by_time.altitude_m));
    assert!((by_altitude.time_s - by_time.time_s).abs() < tolerance_s);
}

#[test]
fn a_flight_that_never_gets_there_says_so() {
    let world = world(EXP0, 0.24, 0.0);
    let flight = fly(&world, 40.0, Until::RangeM(5e6));
    assert!(!flight.reached && flight.end.altitude_m <= 0.0);
    let short = propagate(&world, &entry(&world), 0.7, Until::AltitudeM(10e3), 5.01, 1.0);
    assert!(!short.reached && (short.end.time_s - 5.01).abs() < 1e-12);
}

#[test]
fn a_stop_at_the_start_is_reached_at_once() {
    let world = world(EXP40, 0.0, 0.0);
    for stop in [Until::TimeS(0.0), Until::RangeM(0.0)] {
        let flight = propagate(&world, &entry(&world), 0.0, stop, 1000.0, 1.0);
        assert!(flight.reached && flight.end.time_s == 0.0, "{stop:?}: {:?}", flight.end);
    }
}
