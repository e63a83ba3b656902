//! The worst input that the search for the dearest minor frame has found stays a flight that is flown.

use std::path::Path;

use fsw_host::record::End;
use hil_sim::scenario::Scenario;

#[test]
fn the_worst_input_found_is_flown_to_an_end_with_an_answer_in_every_second() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("cases/worst-frame.toml");
    let scenario = Scenario::resolve(&file.to_string_lossy(), &[]).unwrap_or_else(|e| panic!("{e}"));
    let record = fsw_host::fly::fly_in_process(&scenario, 1, 0, true).unwrap_or_else(|e| panic!("{e}"));
    assert!(matches!(record.end, End::Deployed | End::Ground | End::TimeLimit), "{:?}", record.end);
    // The software answers to the last: no gap of commands is longer than a fault of the line may make it.
    let last_s = record.truth.last().map_or(0.0, |truth| truth.time_s);
    let commanded_s = record.actuators.last().map_or(0.0, |actuator| f64::from(actuator.frame) * 0.02);
    assert!(last_s - commanded_s < 10.0, "the last command is of {commanded_s} s, the flight ended at {last_s} s");
}
