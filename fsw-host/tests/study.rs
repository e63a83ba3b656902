//! `study` as a user meets it: every file there, figures that belong together, a study that goes on, and one sentence for
//! every bad input.

mod support;

use std::fs;

use serde_json::Value;
use support::{Scratch, assert_refused, stderr, text};

const RUNS: usize = 8;
const MODES: [&str; 3] = ["paper", "segmented", "segmented-table"];

#[test]
fn the_experiment_of_the_paper_is_flown_compared_drawn_and_goes_on_where_it_was() {
    let scratch = Scratch::new(&["study", "npc"], "whole");
    let arguments = ["--runs", "8", "--seed", "5", "--out", "npc"];
    let flown = scratch.run(&[&arguments[..], &["--json"]].concat());
    assert!(flown.status.success(), "{}", stderr(&flown));
    let folder = scratch.path.join("npc");

    let printed: Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON");
    let written: Value = serde_json::from_str(&text(&folder.join("study.json"))).expect("study.json is JSON");
    assert_eq!(printed, written);
    let modes = written["modes"].as_array().expect("the modes");
    let names: Vec<_> = modes.iter().map(|mode| mode["mode"].as_str().unwrap_or_default()).collect();
    assert_eq!(names, MODES);
    let evaluations: Vec<_> = modes.iter().map(|mode| mode["nominal"]["evaluations"].as_u64().unwrap_or(0)).collect();
    assert!(
        evaluations[1] < evaluations[0] && evaluations[2] < evaluations[0] && evaluations[2] > 0,
        "{evaluations:?}"
    );
    let runs: Vec<_> = modes.iter().map(|mode| mode["campaign"]["runs"].as_u64()).collect();
    assert_eq!(runs, [Some(8); 3]);
    let comparison = written["comparison"].as_array().expect("the comparison");
    let within = comparison.iter().find(|line| line["quantity"] == "runs within 5 km, %").expect("the paper's share");
    assert_eq!(within["published"], serde_json::json!([98.0, 86.0]));
    assert_eq!(within["ours"].as_array().map(Vec::len), Some(3));

    // Without rotation, J2 and errors of navigation, whatever the mode.
    for mode in MODES {
        let scenario = text(&folder.join(mode).join("scenario.toml"));
        for field in ["rotation_radps = 0.0", "j2 = 0.0", "filter = \"ideal\"", &format!("mode = \"{mode}\"")] {
            assert!(scenario.contains(field), "{mode}: {field}");
        }
    }
    let points = text(&folder.join("points.csv"));
    assert_eq!(points.lines().count(), 1 + MODES.len() * RUNS);
    let page = text(&folder.join("study.html"));
    for place in ["Fig. 2", "Fig. 3", "Fig. 4", "Fig. 5", "Fig. 6", "Fig. 7", "Table 1"] {
        assert!(page.contains(place), "{place}");
    }
    assert!(page.matches("<svg").count() > 10 && !page.contains("NaN"));
    assert!(
        fs::read_dir(&folder)
            .expect("the folder")
            .all(|entry| { entry.is_ok_and(|entry| !entry.file_name().to_string_lossy().ends_with(".part")) })
    );

    // One mode lost: it alone is flown again, to the same points.
    fs::remove_dir_all(folder.join("segmented")).expect("the mode can be removed");
    fs::remove_file(folder.join("points.csv")).expect("the points can be removed");
    let again = scratch.run(&[&arguments[..], &["--quiet"]].concat());
    assert!(again.status.success() && again.stdout.is_empty(), "{}", stderr(&again));
    assert_eq!(text(&folder.join("points.csv")), points);

    // Another study does not get into the folder.
    let other = scratch.run(&["--runs", "8", "--seed", "6", "--out", "npc", "--quiet"]);
    assert_refused(&other, &["npc/paper", "the seed is 5 there and 6 here", "--out"]);
}

#[test]
fn bad_input_is_one_sentence() {
    let scratch = Scratch::new(&["study", "npc"], "bad");
    assert_refused(&scratch.run(&["--runs", "0"]), &["--runs 0", "1 to"]);
    assert_refused(&scratch.run(&["--runs", "-3"]), &["--runs"]);
    assert_refused(&scratch.run(&["--runs", "2", "--config", "marz"]), &["marz"]);
    assert_refused(&scratch.run(&["--runs", "2", "--set", "vehicle.mass_kg=-1"]), &["vehicle.mass_kg"]);
    fs::write(scratch.path.join("file"), "x").expect("a file");
    assert_refused(&scratch.run(&["--runs", "2", "--out", "file"]), &["file", "--out"]);
    fs::create_dir(scratch.path.join("mine")).expect("a folder");
    fs::write(scratch.path.join("mine/letter.txt"), "x").expect("a file");
    let occupied = scratch.run(&["--runs", "2", "--out", "mine", "--force"]);
    assert_refused(&occupied, &["mine", "letter.txt", "--out"]);
    assert_eq!(text(&scratch.path.join("mine/letter.txt")), "x");
    assert!(!scratch.path.join("studies").exists(), "a refused study leaves no folder");
}
