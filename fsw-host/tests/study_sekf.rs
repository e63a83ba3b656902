//! `study sekf` as a user meets it: files, figures that belong together, the search, and one sentence for every bad input.

mod support;

use std::fs;

use serde_json::Value;
use support::{Scratch, assert_refused_in_a_line, stderr, text};

/// Figures that do not depend on the machine.
fn without_times(mut study: Value) -> Value {
    for case in study["cases"].as_array_mut().expect("cases") {
        for filter in case["filters"].as_array_mut().expect("filters") {
            filter["host_ns_per_step"] = Value::Null;
        }
    }
    study
}

fn outcome<'a>(study: &'a Value, case: &str, filter: &str) -> &'a Value {
    let case = study["cases"].as_array().and_then(|all| all.iter().find(|c| c["case"] == case)).expect("the case");
    case["filters"].as_array().and_then(|all| all.iter().find(|f| f["filter"] == filter)).expect("the filter")
}

#[test]
fn the_experiment_is_flown_compared_and_drawn_the_same_on_any_number_of_threads() {
    let scratch = Scratch::new(&["study", "sekf"], "whole");
    let flown = scratch.run(&["--runs", "4", "--seed", "3", "--out", "a", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&scratch.path.join("a/study.json"))).expect("study.json is JSON");
    assert_eq!(printed, written);

    // The paper's claim, at any seed: without tuning the SEKF beats the EKF, the more the lower the noise.
    let ratio = |case: &str| outcome(&written, case, "sekf")["ratio_to_ekf"].as_f64().expect("a ratio");
    assert!(ratio("untuned") > 1.5 && ratio("untuned-0.1") > 8.0 && ratio("untuned-0.01") > 20.0);
    assert!(ratio("tuned") < 1.0, "against a tuned EKF it loses: {}", ratio("tuned"));
    for case in written["cases"].as_array().expect("cases") {
        for filter in case["filters"].as_array().expect("filters") {
            let name = filter["filter"].as_str().expect("a name");
            if name != "sekf-printed" {
                assert!(filter["position_rmse_m"].as_f64().is_some_and(f64::is_finite), "{filter}");
            }
            assert!(filter["indefinite_share"] == 0.0 || name == "sekf-printed", "{filter}");
        }
    }
    let page = text(&scratch.path.join("a/study.html"));
    assert!(page.matches("<svg").count() >= 5 && ["Fig. 1", "Fig. 2", "Fig. 3"].iter().all(|fig| page.contains(fig)));
    // A NaN of a filter that was lost is a dash.
    assert!(!page.contains("NaN") && page.contains("SEKF as printed"));

    // The configuration in the folder is the whole study.
    let config = scratch.path.join("a/study.toml");
    let again =
        scratch.run(&[&config.to_string_lossy(), "--runs", "4", "--seed", "3", "--jobs", "1", "--out", "b", "--quiet"]);
    assert!(again.status.success() && again.stdout.is_empty(), "{}", stderr(&again));
    let mut repeated: Value = serde_json::from_str(&text(&scratch.path.join("b/study.json"))).expect("JSON");
    repeated["command"] = written["command"].clone();
    assert_eq!(without_times(repeated), without_times(written));
}

#[test]
fn the_search_writes_settings_that_the_study_flies_with() {
    let scratch = Scratch::new(&["study", "sekf"], "tune");
    scratch.config(
        "[experiment]\nduration_s = 60\n[tuning]\nruns = 2\ngrid_runs = 1\nfactors = [2.0]\nprocess = [0.3, 0.9]\naccelerometer = [3.0]\ninput = [0.7]\n",
    );
    let tuned = scratch.run(&["my.toml", "--tune", "--out", "t", "--quiet"]);
    assert!(tuned.status.success(), "{}", stderr(&tuned));
    assert!(text(&scratch.path.join("t/tuned.toml")).contains("aeroshell study sekf my.toml --tune"));
    let flown = scratch.run(&["--config", "my.toml", "--tuned", "t/tuned.toml", "--runs", "2", "--out", "t", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let study: Value = serde_json::from_slice(&flown.stdout).expect("JSON");
    let settings = &outcome(&study, "tuned", "aekf12")["settings"];
    let (accelerometer, input) = (settings["accelerometer"].as_f64(), settings["input"].as_f64());
    let line =
        format!("accelerometer = {:?}\ninput = {:?}", accelerometer.expect("a number"), input.expect("a number"));
    assert!(text(&scratch.path.join("t/tuned.toml")).contains(&line), "{line}");
    let shipped = scratch.run(&["--config", "my.toml", "--runs", "1", "--out", "s", "--json"]);
    let shipped: Value = serde_json::from_slice(&shipped.stdout).expect("JSON");
    assert_ne!(&outcome(&shipped, "tuned", "aekf12")["settings"], settings);
}

#[test]
fn bad_input_is_one_sentence() {
    let scratch = Scratch::new(&["study", "sekf"], "bad");
    for (config, words) in [
        ("[experiment]\nstep_s = 0\n", ["my.toml", "experiment.step_s", "0.01"]),
        ("[experiment]\nstep_s = -1.0\n", ["my.toml", "experiment.step_s", "-1"]),
        ("[experiment]\nprocess_noise = [0.1, 0.0, 1, 1, 1, 1]\n", ["my.toml", "process_noise[1]", "is 0"]),
        ("[sensors]\nrate_hz = 0\n", ["my.toml", "sensors.rate_hz", "0.001"]),
        ("[sensors]\nangle_deg = 0\n", ["my.toml", "sensors.angle_deg", "is 0"]),
        ("[filters]\nfly = [\"ekf\", \"ukf\"]\n", ["my.toml", "filters.fly", "ukf"]),
        ("[filters]\nfly = []\n", ["my.toml", "filters.fly", "ekf"]),
        ("[sensors]\nrange_m = -1.0\n", ["my.toml", "sensors.range_m", "-1"]),
        ("[sensors]\nrnge_m = 1.0\n", ["my.toml", "rnge_m", "unknown"]),
        ("[experiment]\nstep_s = \"slow\"\n", ["my.toml", "experiment.step_s", "string"]),
        ("[experiment\n", ["my.toml", "line 1", ""]),
        ("[tuning]\nprocess = []\n", ["my.toml", "tuning.process", "at least one"]),
    ] {
        scratch.config(config);
        assert_refused_in_a_line(&scratch.run(&["my.toml", "--runs", "2"]), &words);
    }
    assert_refused_in_a_line(&scratch.run(&["--runs", "0"]), &["--runs 0", "1 to"]);
    assert_refused_in_a_line(&scratch.run(&["nowhere.toml"]), &["nowhere.toml"]);
    assert_refused_in_a_line(&scratch.run(&["--tuned", "nowhere.toml"]), &["nowhere.toml"]);
    scratch.config("command = \"\"\nstep_s = 1.0\n[[tuned]]\ncase = \"tuned\"\nfilter = \"ekf\"\nsettings = { process = -1, accelerometer = 1, input = 1 }\n");
    assert_refused_in_a_line(&scratch.run(&["--tuned", "my.toml"]), &["my.toml", "tuned[0].settings.process", "-1"]);
    fs::create_dir(scratch.path.join("mine")).expect("a folder");
    fs::write(scratch.path.join("mine/letter.txt"), "x").expect("a file");
    assert_refused_in_a_line(&scratch.run(&["--runs", "2", "--out", "mine"]), &["mine", "letter.txt", "--out"]);
    assert!(!scratch.path.join("studies").exists(), "a refused study leaves no folder");
}
