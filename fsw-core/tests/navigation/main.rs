//! The navigator against a truth of its own: closure with perfect sensors, consistency and accuracy over dispersed flights.

mod flight;
mod modelled;
mod truth;

use flight::{Case, Outcome, default_case, fly};
use fsw_core::link::packet::MeasurementKind;
use fsw_core::link::parameters::NavigationMode;

/// Dispersed flights of a campaign.
const FLIGHTS: u64 = 50;
/// The central 95 % of a chi-square variable with six degrees of freedom.
const BAND: core::ops::Range<f64> = 1.237..14.449;

fn campaign(base: &Case, mode: NavigationMode) -> Vec<Outcome> {
    campaign_of(FLIGHTS, base, mode)
}

fn campaign_of(flights: u64, base: &Case, mode: NavigationMode) -> Vec<Outcome> {
    let mut case = *base;
    case.mode = mode;
    (1..=flights)
        .map(|seed| {
            case.seed = seed;
            fly(&case)
        })
        .collect()
}

fn rms(flights: &[Outcome], of: impl Fn(&Outcome) -> f64) -> f64 {
    (flights.iter().map(|o| of(o) * of(o)).sum::<f64>() / flights.len() as f64).sqrt()
}

/// Asserts the consistency of a campaign: normalised errors and normalised innovations, and sound numerics.
fn assert_consistent(flights: &[Outcome]) {
    let nees: Vec<f64> = flights.iter().flat_map(|o| o.nees.iter().copied()).collect();
    let mean = nees.iter().sum::<f64>() / nees.len() as f64;
    let inside = nees.iter().filter(|n| BAND.contains(*n)).count() as f64 / nees.len() as f64;
    println!("normalised error squared {mean:.2} of 6, {:.1} % inside the band", 100.0 * inside);
    assert!((4.5..8.0).contains(&mean) && inside >= 0.9, "{mean} {inside}");
    for kind in [MeasurementKind::Pressure, MeasurementKind::Range, MeasurementKind::RangeRate] {
        let (sum, n) = flights.iter().map(|o| o.nis(kind)).fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
        println!("{kind:?}: normalised innovation squared {:.3} over {n}", sum / n);
        assert!((0.85..1.15).contains(&(sum / n)), "{kind:?} {}", sum / n);
    }
    assert!(flights.iter().all(|o| o.counters.covariance_restored == 0 && o.counters.queue_overflow == 0));
    assert!(flights.iter().all(|o| o.invalid_frames == 0));
}

#[test]
fn perfect_sensors_close_a_whole_flight() {
    let mut case = default_case(1);
    (case.mode, case.dispersed) = (NavigationMode::DeadReckoning, false);
    let o = fly(&case);
    println!(
        "after {:.1} s and {:.1} m/s2: {:.4} m, {:.1e} m/s, {:.1e} rad; bank rate {:.1e} rad/s",
        o.estimate.time.as_s(),
        o.peak_load_mps2,
        o.position_error_m,
        o.velocity_error_mps,
        o.attitude_error_rad,
        o.worst_bank_rate_error
    );
    assert!(o.peak_load_mps2 > 70.0 && o.estimate.time.as_s() > 250.0);
    assert!(o.position_error_m < 1.0 && o.velocity_error_mps < 5e-3 && o.attitude_error_rad < 1e-6);
    // The bank rate is the mean over the frame: what the banks at its ends differ by.
    assert!(o.bank_error_rad.abs() < 1e-6 && o.worst_bank_rate_error < 1e-5);
}

#[test]
fn the_filter_is_consistent_and_beats_dead_reckoning_with_one_orbiter() {
    let base = default_case(0);
    let filtered = campaign(&base, NavigationMode::Ekf);
    let reckoned = campaign(&base, NavigationMode::DeadReckoning);
    assert_consistent(&filtered);
    let (r, v) = (rms(&filtered, |o| o.position_error_m), rms(&filtered, |o| o.velocity_error_mps));
    let (r0, v0) = (rms(&reckoned, |o| o.position_error_m), rms(&reckoned, |o| o.velocity_error_mps));
    println!("at the end {r:.0} m and {v:.2} m/s; dead reckoning {r0:.0} m and {v0:.2} m/s");
    assert!(r <= 0.35 * r0 && v <= 0.6 * v0, "{r} {r0} {v} {v0}");
}

#[test]
fn a_beacon_near_the_end_of_the_path_brings_the_position_to_forty_metres() {
    let mut base = default_case(0);
    base.sources[1] = truth::beacon();
    let flights = campaign(&base, NavigationMode::Ekf);
    assert_consistent(&flights);
    let r = rms(&flights, |o| o.position_error_m);
    println!("at the end {r:.1} m and {:.2} m/s", rms(&flights, |o| o.velocity_error_mps));
    assert!(r <= 40.0, "{r}");
}

#[test]
fn a_short_gap_of_the_inertial_unit_is_survived() {
    let mut case = default_case(3);
    case.gap = (4000, 4008);
    let o = fly(&case);
    assert_eq!((o.counters.bridged_total, o.invalid_frames), (8, 0));
    // The bridge of 0.16 s says 13 cm/s; radio and covariance take it in: within the chi-square tail.
    let last = o.nees.last().copied().unwrap_or(f64::NAN);
    assert!(last < 22.5, "{last}");
}
