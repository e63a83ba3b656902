//! `study mmae` as a user meets it: files, figures that belong together, and one sentence for every bad input.

mod support;

use serde_json::Value;
use support::{Scratch, assert_refused_in_a_line, stderr, text};

const GROUPS: [&str; 5] = ["fixed", "table5", "ranking", "efficiency", "robust"];

fn cases(study: &Value) -> impl Iterator<Item = &Value> {
    GROUPS.into_iter().flat_map(|group| study["cases"][group].as_array().expect("cases"))
}

/// Figures that do not depend on the machine.
fn without_times(mut study: Value) -> Value {
    for group in GROUPS {
        for case in study["cases"][group].as_array_mut().expect("cases") {
            for filter in case["filters"].as_array_mut().expect("filters") {
                filter["step_ns"] = Value::Null;
                filter["ekfs"] = Value::Null;
            }
        }
    }
    study["bars"] = Value::Null;
    study
}

fn filter<'a>(study: &'a Value, group: &str, scenario: usize, label: &str) -> &'a Value {
    let case = &study["cases"][group][scenario - 1];
    case["filters"].as_array().and_then(|all| all.iter().find(|f| f["label"] == label)).expect("the filter")
}

#[test]
fn the_experiment_is_flown_compared_and_drawn_the_same_on_any_number_of_threads() {
    let scratch = Scratch::new(&["study", "mmae"], "whole");
    let flown = scratch.run(&["--runs", "2", "--seed", "3", "--out", "a", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&scratch.path.join("a/study.json"))).expect("study.json is JSON");
    assert_eq!(printed, written);

    for case in cases(&written) {
        for filter in case["filters"].as_array().expect("filters") {
            let label = filter["label"].as_str().expect("a label");
            assert_eq!(filter["indefinite_share"], 0.0, "{label}");
            let is_taught = label.starts_with("bare");
            assert_eq!(filter["failed"] == 0, !is_taught || filter["failure"].is_null(), "{label}");
            assert!(is_taught || filter["rmse"]["position_m"].as_f64().is_some_and(f64::is_finite), "{label}");
        }
    }
    // P3's own baselines end in an error at any seed: the bare gating of a range at its first reading.
    let bare = filter(&written, "ranking", 2, "bare-gating η 1");
    assert_eq!((&bare["failed"], &bare["failure"]["last_s"]), (&Value::from(2), &Value::from(0.1)));
    assert_eq!(filter(&written, "ranking", 2, "bare-product")["failed"], 2);
    // Who estimates the density is nearer than who does not know of it, by far.
    let error = |label: &str| filter(&written, "ranking", 2, label)["rmse"]["position_m"].as_f64().expect("an error");
    assert!(10.0 * error("augmented") < error("ekf"), "{} {}", error("augmented"), error("ekf"));

    for case in cases(&written).filter(|case| !case["bound"].is_null()) {
        let of = |what: &str| case["bound"][what]["position_m"].as_f64().expect("a bound");
        // Of few entries: what attains the bound is near it.
        assert!((0.2..5.0).contains(&(of("attained") / of("unknown_density"))), "{}", case["bound"]);
    }
    let page = text(&scratch.path.join("a/study.html"));
    assert!(
        page.matches("<svg").count() >= 7
            && ["Figs. 5", "Fig. 9", "Fig. 11", "Table 5"].iter().all(|f| page.contains(f))
    );
    assert!(!page.contains("NaN"));

    // The configuration in the folder is the whole study.
    let config = scratch.path.join("a/study.toml");
    let config = config.to_string_lossy();
    let again = scratch.run(&[&config, "--runs", "2", "--seed", "3", "--jobs", "1", "--out", "b", "--quiet"]);
    assert!(again.status.success() && again.stdout.is_empty(), "{}", stderr(&again));
    let mut repeated: Value = serde_json::from_str(&text(&scratch.path.join("b/study.json"))).expect("JSON");
    repeated["command"] = written["command"].clone();
    assert_eq!(without_times(repeated), without_times(written));
}

#[test]
fn bad_input_is_one_sentence() {
    let scratch = Scratch::new(&["study", "mmae"], "bad");
    for (config, words) in [
        ("[ranking]\nrate_hz = 0\n", ["my.toml", "ranking.rate_hz", "is 0"]),
        ("[table5]\nrate_hz = 3.0\n", ["my.toml", "table5.rate_hz", "whole number of steps"]),
        ("[bank]\ndensities = []\n", ["my.toml", "bank.densities", "at least one"]),
        ("[bank]\nrates = [0.0]\n", ["my.toml", "bank.rates[0]", "is 0"]),
        ("[sensors]\nrange_m = 0\n", ["my.toml", "sensors.range_m", "is 0"]),
        ("[sensors]\naccelerometer_ug = -3000.0\n", ["my.toml", "sensors.accelerometer_ug", "-3000"]),
        ("[filters]\nfly = [\"ekf\", \"kalman\"]\n", ["my.toml", "filters.fly[1]", "kalman"]),
        ("[filters]\nfly = []\n", ["my.toml", "filters.fly", "at least one"]),
        ("filters = []\n", ["my.toml", "filters", "must be a table"]),
        ("[augmented]\nexperts = 0\n", ["my.toml", "augmented.experts", "1"]),
        ("[flight]\ndeploy = 1.0\n", ["my.toml", "deploy", "unknown"]),
        ("[flight]\nstep_s = \"slow\"\n", ["my.toml", "flight.step_s", "string"]),
        ("[flight\n", ["my.toml", "line 1", ""]),
    ] {
        scratch.config(config);
        assert_refused_in_a_line(&scratch.run(&["my.toml", "--runs", "2"]), &words);
    }
    assert_refused_in_a_line(&scratch.run(&["--runs", "0"]), &["--runs 0", "1 to"]);
    assert_refused_in_a_line(&scratch.run(&["nowhere.toml"]), &["nowhere.toml"]);
    assert!(!scratch.path.join("studies").exists(), "a refused study leaves no folder");
}
