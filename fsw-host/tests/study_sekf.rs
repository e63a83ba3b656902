//! `study sekf` as a user meets it: files, figures that belong together, the search, and one sentence for every bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-sekf-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    fn study(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(["study", "sekf"]).args(arguments).current_dir(&self.0);
        command.output().expect("the program starts")
    }

    fn config(&self, text: &str) {
        fs::write(self.0.join("my.toml"), text).expect("a file can be written");
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn assert_refused(output: &Output, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(!said.contains("panicked") && said.trim_end().lines().count() == 1, "{said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is missing in: {said}");
    }
}

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
    let scratch = Scratch::new("whole");
    let flown = scratch.study(&["--runs", "4", "--seed", "3", "--out", "a", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&scratch.0.join("a/study.json"))).expect("study.json is JSON");
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
    let page = text(&scratch.0.join("a/study.html"));
    assert!(page.matches("<svg").count() >= 5 && ["Fig. 1", "Fig. 2", "Fig. 3"].iter().all(|fig| page.contains(fig)));
    // A NaN of a filter that was lost is a dash.
    assert!(!page.contains("NaN") && page.contains("SEKF as printed"));

    // The configuration in the folder is the whole study.
    let config = scratch.0.join("a/study.toml");
    let again = scratch.study(&[
        &config.to_string_lossy(),
        "--runs",
        "4",
        "--seed",
        "3",
        "--jobs",
        "1",
        "--out",
        "b",
        "--quiet",
    ]);
    assert!(again.status.success() && again.stdout.is_empty(), "{}", stderr(&again));
    let mut repeated: Value = serde_json::from_str(&text(&scratch.0.join("b/study.json"))).expect("JSON");
    repeated["command"] = written["command"].clone();
    assert_eq!(without_times(repeated), without_times(written));
}

#[test]
fn the_search_writes_settings_that_the_study_flies_with() {
    let scratch = Scratch::new("tune");
    scratch.config(
        "[experiment]\nduration_s = 60\n[tuning]\nruns = 2\ngrid_runs = 1\nfactors = [2.0]\nprocess = [0.3, 0.9]\naccelerometer = [3.0]\ninput = [0.7]\n",
    );
    let tuned = scratch.study(&["my.toml", "--tune", "--out", "t", "--quiet"]);
    assert!(tuned.status.success(), "{}", stderr(&tuned));
    assert!(text(&scratch.0.join("t/tuned.toml")).contains("aeroshell study sekf my.toml --tune"));
    let flown =
        scratch.study(&["--config", "my.toml", "--tuned", "t/tuned.toml", "--runs", "2", "--out", "t", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let study: Value = serde_json::from_slice(&flown.stdout).expect("JSON");
    let settings = &outcome(&study, "tuned", "aekf12")["settings"];
    let (accelerometer, input) = (settings["accelerometer"].as_f64(), settings["input"].as_f64());
    let line =
        format!("accelerometer = {:?}\ninput = {:?}", accelerometer.expect("a number"), input.expect("a number"));
    assert!(text(&scratch.0.join("t/tuned.toml")).contains(&line), "{line}");
    let shipped = scratch.study(&["--config", "my.toml", "--runs", "1", "--out", "s", "--json"]);
    let shipped: Value = serde_json::from_slice(&shipped.stdout).expect("JSON");
    assert_ne!(&outcome(&shipped, "tuned", "aekf12")["settings"], settings);
}

#[test]
fn bad_input_is_one_sentence() {
    let scratch = Scratch::new("bad");
    for (config, words) in [
        ("[experiment]\nstep_s = 0\n", ["my.toml", "experiment.step_s", "0.01"]),
        ("[experiment]\nstep_s = -1.0\n", ["my.toml", "experiment.step_s", "-1"]),
        ("[experiment]\nprocess_noise = [0.1, 0.0, 1, 1, 1, 1]\n", ["my.toml", "process_noise[1]", "is 0"]),
        ("[sensors]\nrate_hz = 0\n", ["my.toml", "sensors.rate_hz", "0.001"]),
        ("[sensors]\nangle_deg = 0\n", ["my.toml", "sensors.angle_deg", "is 0"]),
        ("[filters]\nflown = [\"ekf\", \"ukf\"]\n", ["my.toml", "filters.flown", "ukf"]),
        ("[filters]\nflown = []\n", ["my.toml", "filters.flown", "ekf"]),
        ("[sensors]\nrange_m = -1.0\n", ["my.toml", "sensors.range_m", "-1"]),
        ("[sensors]\nrnge_m = 1.0\n", ["my.toml", "rnge_m", "unknown"]),
        ("[experiment]\nstep_s = \"slow\"\n", ["my.toml", "experiment.step_s", "string"]),
        ("[experiment\n", ["my.toml", "line 1", ""]),
        ("[tuning]\nprocess = []\n", ["my.toml", "tuning.process", "at least one"]),
    ] {
        scratch.config(config);
        assert_refused(&scratch.study(&["my.toml", "--runs", "2"]), &words);
    }
    assert_refused(&scratch.study(&["--runs", "0"]), &["--runs 0", "1 to"]);
    assert_refused(&scratch.study(&["nowhere.toml"]), &["nowhere.toml"]);
    assert_refused(&scratch.study(&["--tuned", "nowhere.toml"]), &["nowhere.toml"]);
    scratch.config("command = \"\"\nstep_s = 1.0\n[[tuned]]\ncase = \"tuned\"\nfilter = \"ekf\"\nsettings = { process = -1, accelerometer = 1, input = 1 }\n");
    assert_refused(&scratch.study(&["--tuned", "my.toml"]), &["my.toml", "tuned[0].settings.process", "-1"]);
    fs::create_dir(scratch.0.join("mine")).expect("a folder");
    fs::write(scratch.0.join("mine/letter.txt"), "x").expect("a file");
    assert_refused(&scratch.study(&["--runs", "2", "--out", "mine"]), &["mine", "letter.txt", "--out"]);
    assert!(!scratch.0.join("studies").exists(), "a refused study leaves no folder");
}
