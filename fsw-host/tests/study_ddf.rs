//! `study ddf` as a user meets it: files, figures that belong together, the search, and one sentence for every bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-ddf-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    fn study(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(["study", "ddf"]).args(arguments).current_dir(&self.0);
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
    for filter in study["filters"].as_array_mut().expect("filters") {
        filter["host_ms_per_run"] = Value::Null;
    }
    study
}

#[test]
fn the_experiment_is_flown_compared_and_drawn_the_same_on_any_number_of_threads() {
    let scratch = Scratch::new("whole");
    let flown = scratch.study(&["--runs", "2", "--seed", "3", "--no-count", "--out", "a", "--json"]);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&scratch.0.join("a/study.json"))).expect("study.json is JSON");
    assert_eq!(printed, written);
    let filters = written["filters"].as_array().expect("filters");
    assert_eq!(filters.len(), 9 + 3 + 3, "every kind, the adaptive ones at three thresholds");
    for filter in filters {
        assert_eq!((filter["indefinite_share"].as_f64(), filter["failed"].as_u64()), (Some(0.0), Some(0)), "{filter}");
        assert_eq!(filter["history"].as_array().map(Vec::len), Some(2_000));
    }
    let bars = written["bars"].as_array().expect("bars");
    assert_eq!(bars.len(), 9);

    let page = text(&scratch.0.join("a/study.html"));
    for word in ["RDDF1", "ARDDF, free 0.07", "degree of nonlinearity", "Three thresholds", "0.8917", "Fly it again"] {
        let word = if word == "0.8917" { "0.89" } else { word };
        assert!(page.contains(word), "{word} is missing in the page");
    }

    let again = scratch.study(&[
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
    let mut repeated: Value = serde_json::from_str(&text(&scratch.0.join("b/study.json"))).expect("JSON");
    repeated["command"] = written["command"].clone();
    assert_eq!(without_times(repeated), without_times(written));
}

#[test]
fn the_search_prints_its_grid_the_best_first() {
    let scratch = Scratch::new("tune");
    scratch.config("[tuning]\nprocess = [100.0, 1000.0]\nsensors = [1.0, 100.0]\nruns = 1\n");
    let found = scratch.study(&["my.toml", "--tune"]);
    assert!(found.status.success(), "{}", stderr(&found));
    let said = String::from_utf8_lossy(&found.stdout).into_owned();
    assert_eq!(said.matches("process").count(), 8, "{said}");
}

#[test]
fn bad_input_is_one_sentence_and_exit_code_two() {
    let scratch = Scratch::new("bad");
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
        assert_refused(&scratch.study(&["my.toml"]), &words);
    }
    assert_refused(&scratch.study(&["--runs", "0"]), &["--runs 0", "1"]);
    assert_refused(&scratch.study(&["nothing.toml"]), &["nothing.toml"]);
    assert_refused(&scratch.study(&["--only", "99", "--steps", "1"]), &["--only 99"]);
    assert!(!scratch.0.join("studies").exists(), "nothing is left behind");
}
