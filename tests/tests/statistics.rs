//! What fifty dispersed flights must show: landing accuracy of mode `paper`, and accuracy and consistency of the
//! navigation. Each set of flights is flown once and shared by the tests of this file.

use std::sync::OnceLock;

use fsw_host::record::{FlightRecord, Summary};
use hil_sim::scenario::Scenario;
use rayon::prelude::*;

/// Consecutive seeds of every set; nothing is special about them.
const SEEDS: std::ops::RangeInclusive<u64> = 1..=50;
/// 95 % band of the chi-square law with 6 degrees of freedom.
const NEES_95: [f64; 2] = [1.237, 14.449];

/// What is kept of a flight: the full record of fifty flights would fill the memory.
struct Flight {
    summary: Summary,
    position_error_m: f64,
    velocity_error_mps: f64,
    nees: Vec<f64>,
    most_predictions: u8,
    most_evaluations: u16,
    most_rate_radps: f64,
    most_accel_radps2: f64,
}

fn fly(scenario: &Scenario, seed: u64) -> Flight {
    let record: FlightRecord =
        fsw_host::fly::fly_in_process(scenario, seed, 0, false).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
    let last = record.nees.last().copied().unwrap_or_default();
    let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |a: f64, b| if b > a { b } else { a });
    Flight {
        position_error_m: norm(last.position_error_m),
        velocity_error_mps: norm(last.velocity_error_mps),
        nees: record.nees.iter().filter_map(|n| n.nees).collect(),
        most_predictions: record.guidance.iter().map(|(_, g)| g.predictions).max().unwrap_or(0),
        most_evaluations: record.guidance.iter().map(|(_, g)| g.evaluations).max().unwrap_or(0),
        most_rate_radps: largest(&mut record.truth.iter().map(|t| t.packet.bank_rate_radps.abs())),
        most_accel_radps2: largest(&mut record.actuators.iter().map(|a| a.bank_accel_radps2.abs())),
        summary: record.summary,
    }
}

fn set(name: &str, changes: &[&str]) -> Vec<Flight> {
    let changes: Vec<String> = changes.iter().map(|c| (*c).to_owned()).collect();
    let scenario = Scenario::resolve(name, &changes).unwrap_or_else(|e| panic!("{name}: {e}"));
    SEEDS.into_par_iter().map(|seed| fly(&scenario, seed)).collect()
}

fn ideal() -> &'static [Flight] {
    static FLIGHTS: OnceLock<Vec<Flight>> = OnceLock::new();
    FLIGHTS.get_or_init(|| set("msl-ideal", &["guidance.mode=paper"]))
}

fn sensors() -> &'static [Flight] {
    static FLIGHTS: OnceLock<Vec<Flight>> = OnceLock::new();
    FLIGHTS.get_or_init(|| set("msl", &["guidance.mode=paper"]))
}

fn dead_reckoning() -> &'static [Flight] {
    static FLIGHTS: OnceLock<Vec<Flight>> = OnceLock::new();
    FLIGHTS.get_or_init(|| set("msl", &["navigation.filter=dead-reckoning"]))
}

fn beacon() -> &'static [Flight] {
    static FLIGHTS: OnceLock<Vec<Flight>> = OnceLock::new();
    FLIGHTS.get_or_init(|| set("msl-beacon", &[]))
}

fn misses_m(flights: &[Flight]) -> Vec<f64> {
    let mut misses: Vec<f64> = flights.iter().map(|f| f.summary.miss_m.expect("every flight deploys")).collect();
    misses.sort_by(f64::total_cmp);
    misses
}

fn median(sorted: &[f64]) -> f64 {
    0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2])
}

fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v * v, n + 1));
    (sum / f64::from(n)).sqrt()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0), |(sum, n), v| (sum + v, n + 1));
    sum / f64::from(n)
}

#[test]
fn paper_guidance_with_perfect_navigation_misses_by_less_than_two_kilometres_in_the_median() {
    let misses = misses_m(ideal());
    let (p50, max) = (median(&misses), misses[misses.len() - 1]);
    println!("paper, ideal navigation: p50 {p50:.0} m, max {max:.0} m");
    assert!(p50 <= 1800.0, "p50 {p50:.0} m");
    assert!(max <= 12_000.0, "max {max:.0} m");
}

#[test]
fn paper_guidance_with_default_sensors_misses_little_more() {
    let misses = misses_m(sensors());
    let (p50, max) = (median(&misses), misses[misses.len() - 1]);
    println!("paper, default sensors: p50 {p50:.0} m, max {max:.0} m");
    assert!(p50 <= 2200.0, "p50 {p50:.0} m");
}

#[test]
fn the_filter_is_much_better_than_dead_reckoning_on_the_same_flights() {
    let rms = |flights: &[Flight]| {
        let position = root_mean_square(flights.iter().map(|f| f.position_error_m));
        (position, root_mean_square(flights.iter().map(|f| f.velocity_error_mps)))
    };
    let ((filter_m, filter_mps), (strapdown_m, strapdown_mps)) = (rms(sensors()), rms(dead_reckoning()));
    println!("filter {filter_m:.0} m {filter_mps:.3} m/s, dead reckoning {strapdown_m:.0} m {strapdown_mps:.3} m/s");
    assert!(filter_m <= 0.35 * strapdown_m, "position {filter_m:.0} m against {strapdown_m:.0} m");
    assert!(filter_mps <= 0.6 * strapdown_mps, "velocity {filter_mps:.3} against {strapdown_mps:.3} m/s");
}

#[test]
fn a_beacon_near_the_target_leaves_less_than_forty_metres() {
    let position_m = root_mean_square(beacon().iter().map(|f| f.position_error_m));
    println!("orbiter and beacon: {position_m:.1} m");
    assert!(position_m <= 40.0, "{position_m:.1} m");
}

#[test]
fn the_filter_knows_how_wrong_it_is() {
    let all: Vec<f64> = sensors().iter().flat_map(|f| f.nees.iter().copied()).collect();
    let inside = all.iter().filter(|n| (NEES_95[0]..=NEES_95[1]).contains(*n)).count();
    let (nees, share) = (mean(all.iter().copied()), inside as f64 / all.len() as f64);
    println!("NEES {nees:.2} of 6, {:.1} % of {} epochs in the 95 % band", 100.0 * share, all.len());
    assert!((4.5..=8.0).contains(&nees), "mean NEES {nees:.2}");
    assert!(share >= 0.9, "share {share:.3}");
}

#[test]
fn every_sensor_is_as_noisy_as_the_filter_believes() {
    type Kind = (&'static str, fn(&Summary) -> (Option<f64>, u32));
    let kinds: [Kind; 3] = [
        ("pressure", |s| (s.navigation.nis_mean.pressure, s.navigation.used.pressure)),
        ("range", |s| (s.navigation.nis_mean.range, s.navigation.used.range)),
        ("range-rate", |s| (s.navigation.nis_mean.range_rate, s.navigation.used.range_rate)),
    ];
    for (name, of) in kinds {
        let (sum, n) = sensors().iter().map(|f| of(&f.summary)).fold((0.0, 0.0), |(sum, n), (nis, used)| {
            (sum + nis.unwrap_or(0.0) * f64::from(used), n + f64::from(used))
        });
        assert!(n > 0.0, "{name} was never used");
        let nis = sum / n;
        println!("{name}: mean normalised innovation squared {nis:.3} over {n} measurements");
        assert!((0.85..=1.15).contains(&nis), "{name}: {nis:.3}");
    }
}

#[test]
fn guidance_and_bank_control_never_exceed_their_bounds() {
    let (rate, accel) = (20f64.to_radians(), 5f64.to_radians());
    for flight in ideal().iter().chain(sensors()).chain(dead_reckoning()).chain(beacon()) {
        assert!(flight.most_predictions <= 4, "{} predictor calls", flight.most_predictions);
        assert!(flight.most_evaluations <= 2400, "{} evaluations", flight.most_evaluations);
        // The flown rate carries the lag of the actuator and the error of the estimate: 2 % above the limit at most.
        assert!(flight.most_rate_radps <= 1.02 * rate, "bank rate {} rad/s", flight.most_rate_radps);
        assert!(flight.most_accel_radps2 <= accel * (1.0 + 1e-12), "bank acceleration {}", flight.most_accel_radps2);
    }
}
