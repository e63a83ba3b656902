//! `study ddf` as a user meets it: files, figures that belong together, the search, and one sentence for every bad input.

mod support;

use serde_json::Value;
use support::{Scratch, assert_refused_in_a_line, stderr, text};

/// Figures that do not depend on the machine.
fn without_times(mut study: Value) -> Value {
    for filter in study["filters"].as_array_mut().expect("filters") {
        filter["host_ms_per_run"] = Value::Null;
    }
    study
}

#[test]
fn the_experiment_is_flown_compared_and_drawn_the_same_on_any_number_of_threads() {
    let scratch = Scratch::new(&["study", "ddf"], "whole");
    let flown = scratch.run(&["--runs", "2", "--seed", "3", "--no-count", "--out", "a", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&scratch.path.join("a/study.json"))).expect("study.json is JSON");
    assert_eq!(printed, written);
    let filters = written["filters"].as_array().expect("filters");
    assert_eq!(filters.len(), 9 + 3 + 3, "every kind, the adaptive ones at three thresholds");
    for filter in filters {
        assert_eq!((filter["indefinite_share"].as_f64(), filter["failed"].as_u64()), (Some(0.0), Some(0)), "{filter}");
        assert_eq!(filter["history"].as_array().map(Vec::len), Some(2_000));
    }
    let bars = written["bars"].as_array().expect("bars");
    assert_eq!(bars.len(), 9);

    let least = |at: usize| written["limits"][at]["position_rmse_m"].as_f64().expect("a bound");
    assert!(0.0 < least(0) && least(0) < least(1), "to know the parameters is to know more");
    let page = text(&scratch.path.join("a/study.html"));
    assert!(page.contains("bound, parameters uncertain"));
    for word in ["RDDF1", "ARDDF, free 0.07", "degree of nonlinearity", "Three thresholds", "0.8917", "Fly it again"] {
        let word = if word == "0.8917" { "0.89" } else { word };
        assert!(page.contains(word), "{word} is missing in the page");
    }

    let again = scratch.run(&[
        "a/study.toml",
        "--runs",
        "2",
        "--seed",
        "3",
        "--no-count",
        "--jobs",
        "1",
        "--out",
        "b",
        "--quiet",
    ]);
    assert!(again.status.success() && again.stdout.is_empty(), "{}", stderr(&again));
    let mut repeated: Value = serde_json::from_str(&text(&scratch.path.join("b/study.json"))).expect("JSON");
    repeated["command"] = written["command"].clone();
    assert_eq!(without_times(repeated), without_times(written));
}

#[test]
fn the_search_prints_its_grid_the_best_first() {
    let scratch = Scratch::new(&["study", "ddf"], "tune");
    scratch.config("[tuning]\nprocess = [100.0, 1000.0]\nsensors = [1.0, 100.0]\nruns = 1\n");
    let found = scratch.run(&["my.toml", "--tune"]);
    assert!(found.status.success(), "{}", stderr(&found));
    let said = String::from_utf8_lossy(&found.stdout).into_owned();
    assert_eq!(said.matches("process").count(), 8, "{said}");
}

#[test]
fn bad_input_is_one_sentence_and_exit_code_two() {
    let scratch = Scratch::new(&["study", "ddf"], "bad");
    for (config, words) in [
        ("[experiment]\nstep_s = 0.0\n", ["my.toml", "experiment.step_s", "0.001"]),
        ("[sensors]\nrange_m = 0.0\n", ["my.toml", "sensors.range_m", "0"]),
        ("[sensors]\npressure_pa = nan\n", ["my.toml", "sensors.pressure_pa", "NaN"]),
        ("[filters]\nfree_thresholds = [-0.1]\n", ["my.toml", "filters.free_thresholds[0]", "-0.1"]),
        ("[filters]\nrank_thresholds = []\n", ["my.toml", "filters.rank_thresholds", "at least one"]),
        ("[filters]\nfly = [\"ukf\"]\n", ["my.toml", "filters.fly[0]", "ukf"]),
        ("[filters]\nweights = [-1.0, 0.0]\n", ["my.toml", "filters.weights[0]", "-1"]),
        ("[filter]\nfly = []\n", ["my.toml", "filter", "unknown"]),
        ("[experiment]\nduration_s = 0.0\n", ["my.toml", "experiment.duration_s", "0"]),
    ] {
        scratch.config(config);
        assert_refused_in_a_line(&scratch.run(&["my.toml"]), &words);
    }
    assert_refused_in_a_line(&scratch.run(&["--runs", "0"]), &["--runs 0", "1"]);
    assert_refused_in_a_line(&scratch.run(&["nothing.toml"]), &["nothing.toml"]);
    assert_refused_in_a_line(&scratch.run(&["--only", "99", "--steps", "1"]), &["--only 99"]);
    assert!(!scratch.path.join("studies").exists(), "nothing is left behind");
}
