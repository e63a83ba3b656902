//! Whole flights with a sensor that fails on the way: what is lost is said, what can be saved is flown on, and the
//! parachute opens whatever happens.

use fsw_core::link::packet::{EventKind, MeasurementKind, Mode, Verdict};
use fsw_host::record::{End, FlightRecord};
use hil_sim::scenario::Scenario;

fn fly(faults: &str) -> FlightRecord {
    let scenario = Scenario::resolve("msl", &[format!("fault=[{faults}]")]).unwrap_or_else(|e| panic!("{e}"));
    fsw_host::fly::fly_in_process(&scenario, 1, 0, false).unwrap_or_else(|e| panic!("{e}"))
}

fn fault(kind: &str, target: &str, start_s: f64, duration_s: f64, parameters: &str) -> String {
    format!(
        "{{kind=\"{kind}\", target=\"{target}\", start_s={start_s:.1}, duration_s={duration_s:.1}, parameters={{{parameters}}}}}"
    )
}

/// Seconds flown in degraded modes.
fn degraded_s(record: &FlightRecord) -> f64 {
    let degraded = |m: Mode| matches!(m, Mode::DegradedRangeControl | Mode::DegradedHeadingAlignment);
    record.actuators.iter().filter(|a| degraded(a.mode)).count() as f64 * 0.02
}

fn events(record: &FlightRecord, of: impl Fn(&EventKind) -> bool) -> usize {
    record.events.iter().filter(|e| of(&e.kind)).count()
}

/// Share of the innovations of a sensor in a span of time that were gated; none when there were none.
fn gated_share(record: &FlightRecord, kind: MeasurementKind, from_s: f64, to_s: f64) -> Option<f64> {
    let all: Vec<_> = record
        .nav
        .iter()
        .flat_map(|(_, n)| n.innovations.iter().flatten())
        .filter(|i| i.kind == kind && (from_s..to_s).contains(&i.time.as_s()) && i.verdict != Verdict::OutOfValidity)
        .collect();
    let gated = all.iter().filter(|i| i.verdict == Verdict::Gated).count() as f64;
    (!all.is_empty()).then(|| gated / all.len() as f64)
}

fn tell(name: &str, record: &FlightRecord) {
    let s = &record.summary;
    let deploy = s.deploy.as_ref().map(|d| (d.altitude_m, d.speed_mps, d.mach, d.dynamic_pressure_pa));
    println!(
        "{name}: {} {:?}; degraded {:.2} s; miss {:?} m; deploy {deploy:.0?}; navigation {:?} m {:?} m/s; rejects {:?}",
        s.outcome,
        s.reason,
        degraded_s(record),
        s.miss_m,
        s.navigation.position_error_m,
        s.navigation.velocity_error_mps,
        record.health.last().map(|h| h.1.rejects)
    );
}

/// Flies with one fault, tells how it went, and checks that the parachute opened.
fn flown(kind: &str, target: &str, start_s: f64, duration_s: f64, parameters: &str) -> FlightRecord {
    let record = fly(&fault(kind, target, start_s, duration_s, parameters));
    tell(&format!("{kind} of {target} at {start_s} s for {duration_s} s"), &record);
    assert_eq!(record.end, End::Deployed);
    record
}

fn navigation_error_m(record: &FlightRecord) -> f64 {
    record.summary.navigation.position_error_m.expect("the flight has an end")
}

const INVALID: fn(&EventKind) -> bool = |kind| *kind == EventKind::NavigationInvalid;

#[test]
fn a_short_inertial_gap_at_peak_load_is_bridged_without_loss() {
    let record = flown("dropout", "imu", 120.0, 0.4, "");
    assert!(record.summary.success);
    assert_eq!((events(&record, INVALID), degraded_s(&record)), (0, 0.0));
}

#[test]
fn longer_inertial_gaps_degrade_the_mode_and_the_flight_recovers() {
    // Half a second is bridged as valid, two filter windows pass before the estimate is trusted again; after twenty
    // seconds the radio has first to narrow it down.
    for (kind, target, gap_s, longest_s) in [
        ("dropout", "imu", 2.0, 2.0),
        ("failed", "imu", 20.0, 40.0),
        ("stuck", "gyro", 3.0, 3.0),
        ("stuck", "imu", 3.0, 3.0),
    ] {
        let record = flown(kind, target, 120.0, gap_s, "");
        let degraded_s = degraded_s(&record);
        assert_eq!(events(&record, INVALID), 1);
        assert!((gap_s - 0.75..longest_s).contains(&degraded_s), "{degraded_s} s");
        assert!(record.summary.success, "{:?}", record.summary.reason);
        // A bridge of t seconds doubts its velocity by 10·t m/s; the radio leaves a fraction.
        assert!(navigation_error_m(&record) < 3000.0);
    }
}

#[test]
fn with_a_dead_inertial_unit_the_parachute_still_opens_above_the_ground() {
    for start_s in [60.0, 120.0, 200.0] {
        let record = flown("dropout", "imu", start_s, 900.0, "");
        let deploy = record.summary.deploy.as_ref().expect("it deployed");
        assert!(deploy.altitude_m > 1000.0, "{} m", deploy.altitude_m);
        assert!(degraded_s(&record) > 10.0);
    }
}

#[test]
fn a_cut_line_is_made_up_for_and_the_flight_recovers() {
    let record = flown("dropout", "uplink", 120.0, 2.0, "");
    assert!(record.summary.success && events(&record, INVALID) == 1);
    let record = flown("bit-flips", "uplink", 0.0, 900.0, "per_packet=0.02");
    assert!(record.summary.success && events(&record, INVALID) == 0);
}

#[test]
fn a_wrong_pressure_is_ruled_out_and_a_missing_one_missed_little() {
    for (kind, parameters) in
        [("bias", "value=5000"), ("scale", "factor=0.5"), ("stuck", ""), ("dropout", ""), ("failed", "")]
    {
        let record = flown(kind, "pressure", 110.0, 900.0, parameters);
        assert!(record.summary.success, "{:?}", record.summary.reason);
        assert!(navigation_error_m(&record) < 1000.0);
        let gated = gated_share(&record, MeasurementKind::Pressure, 112.0, 200.0);
        assert!(gated.is_none_or(|share| share > 0.99), "{gated:?}");
    }
}

#[test]
fn a_wrong_range_is_gated_and_without_radio_the_flight_goes_on() {
    let record = flown("bias", "radio", 100.0, 900.0, "value=5000");
    let gated = gated_share(&record, MeasurementKind::Range, 200.0, 900.0);
    assert!(gated.is_some_and(|share| share > 0.99), "{gated:?}");
    assert!(record.summary.success && navigation_error_m(&record) < 1000.0);
    let record = flown("dropout", "radio", 100.0, 900.0, "");
    assert!(record.summary.success && navigation_error_m(&record) < 3000.0);
}
