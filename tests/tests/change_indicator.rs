//! Change indicator: a table of whole flights, tracked. A change of results shows as a diff of the table, and belongs
//! into the commit that says why. `cargo xtask bless` rewrites it.

use std::fmt::Write as _;
use std::fs;

use hil_sim::scenario::Scenario;
use rayon::prelude::*;
use system_tests::workspace;

/// Scenario and changes; each is flown with seeds 1 and 2.
const FLIGHTS: [(&str, &[&str]); 6] = [
    ("msl", &[]),
    ("msl", &["navigation.filter=dead-reckoning"]),
    ("msl", &["deploy.trigger=range"]),
    ("msl-ideal", &[]),
    ("msl-beacon", &[]),
    ("msl-direct", &[]),
];

fn row((name, changes): (&str, &[&str]), seed: u64) -> String {
    let sets: Vec<String> = changes.iter().map(|c| (*c).to_owned()).collect();
    let scenario = Scenario::resolve(name, &sets).unwrap_or_else(|e| panic!("{e}"));
    let record = fsw_host::fly::fly_light(&scenario, seed, 0, false).unwrap_or_else(|e| panic!("{e}"));
    let s = record.summary;
    format!(
        "{name:<11} {:<34} {seed} {:<9} {:>6} frames  miss {:>8.1} m  nav {:>7.1} m {:>6.3} m/s  {} reversals  {}",
        changes.join(" "),
        s.outcome,
        s.frames,
        s.miss_m.unwrap_or(f64::NAN),
        s.navigation.position_error_m.unwrap_or(f64::NAN),
        s.navigation.velocity_error_mps.unwrap_or(f64::NAN),
        s.reversals,
        &s.output_hash[..16],
    )
}

#[test]
fn flights_give_the_results_on_record() {
    let all: Vec<_> = FLIGHTS.iter().flat_map(|flight| [(*flight, 1), (*flight, 2)]).collect();
    let rows: Vec<String> = all.into_par_iter().map(|(flight, seed)| row(flight, seed)).collect();
    let mut table = String::new();
    for row in rows {
        writeln!(table, "{}", row.trim_end()).expect("a string takes text");
    }
    let path = workspace().join("tests/golden/flights.txt");
    if std::env::var_os("AEROSHELL_BLESS").is_some() {
        fs::create_dir_all(path.parent().expect("a folder")).expect("writable tests folder");
        fs::write(&path, &table).expect("writable golden file");
    }
    let golden = fs::read_to_string(&path).expect("tests/golden/flights.txt; make it with cargo xtask bless");
    assert!(
        golden == table,
        "results changed; if that is intended: cargo xtask bless\nrecorded:\n{golden}\nnow:\n{table}"
    );
}
