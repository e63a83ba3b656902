//! `rank` as a user meets it: one table for all filters on the same bytes, and one sentence for every bad input.

mod support;

use std::fs;

use serde_json::Value;
use support::{Scratch, assert_refused};

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("no {path} in {value}"))
}

#[test]
fn filters_are_ranked_on_the_same_logs_beside_the_bound_whatever_the_threads() {
    let scratch = Scratch::new(&["rank"], "whole");
    let filters = "ekf,dead-reckoning,augmented,rddf2-lite,mmae-product";
    let run = |jobs: &str, out: &str| {
        let flown = scratch.run(&["msl", "--runs", "2", "--filters", filters, "--jobs", jobs, "--out", out, "--json"]);
        assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
        String::from_utf8(flown.stdout).expect("JSON is text")
    };
    let told = run("1", "one");
    assert_eq!(told, run("2", "two"));
    let ranking: Value = serde_json::from_str(&told).expect("JSON");
    let plain = &ranking[0];
    assert_eq!(plain["case"], "plain");
    let placed = plain["filters"].as_array().expect("filters");
    assert_eq!(placed.len(), 5);
    let of = |name: &str| placed.iter().find(|p| p["filter"] == name).unwrap_or_else(|| panic!("no {name}"));
    // The limit lies far below dead reckoning; the filter that flies comes near it, and its miss is known.
    let bound = number(plain, "/bound/deploy/0");
    assert!(bound > 1.0 && 3.0 * bound < number(of("dead-reckoning"), "/deploy/0"), "{bound}");
    assert!(number(of("ekf"), "/deploy/0") < 3.0 * bound);
    assert!(number(of("ekf"), "/miss_m/2") < 2_500.0);
    assert_eq!(of("mmae-product")["given_up"], 2, "a plain product of densities underflows and is found out");
    assert!(placed.iter().all(|p| p["not_finite"] == 0 && p["opened"] == 2));
    let page = fs::read_to_string(scratch.path.join("one/rank.html")).expect("the page");
    assert!(page.contains("Cramér–Rao bound") && page.contains("<svg"));
    assert!(fs::read_to_string(scratch.path.join("one/rank.json")).is_ok());
}

#[test]
fn the_default_filter_stands_on_the_bound_with_an_orbiter_and_with_a_beacon() {
    let scratch = Scratch::new(&["rank"], "bound");
    for scenario in ["msl", "msl-beacon"] {
        let arguments = [scenario, "--runs", "100", "--filters", "ekf", "--open-loop", "--out", scenario, "--json"];
        let flown = scratch.run(&arguments);
        assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
        let told: Value = serde_json::from_slice(&flown.stdout).expect("JSON");
        let default = &told[0]["filters"][0];
        println!("{scenario}: {} {}", default["over_bound"], default["nees"]);
        for over_bound in ["/over_bound/0", "/over_bound/1"].map(|path| number(default, path)) {
            // 100 entries know a root mean square to 7 %: less than half of the bound would be a fault of the bound.
            assert!((0.5..=1.1).contains(&over_bound), "{scenario}: {over_bound}");
        }
        assert!((4.5..7.5).contains(&number(default, "/nees")), "{scenario}: {}", default["nees"]);
        assert_eq!((&default["restarted"], &default["not_finite"]), (&Value::from(0), &Value::from(0)));
    }
}

#[test]
fn every_filter_ends_its_entries_with_an_open_parachute() {
    let scratch = Scratch::new(&["rank"], "all");
    for scenario in ["msl", "msl-beacon"] {
        let flown = scratch.run(&[scenario, "--runs", "3", "--seed", "11", "--out", scenario, "--json"]);
        assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
        let told: Value = serde_json::from_slice(&flown.stdout).expect("JSON");
        let placed = told[0]["filters"].as_array().expect("filters");
        assert_eq!(placed.len(), 21);
        for p in placed {
            let sound = p["opened"] == 3 && p["not_finite"] == 0 && p["restarted"] == 0 && p["indefinite_pct"] == 0.0;
            assert!(sound, "{scenario}: {p}");
        }
    }
}

#[test]
fn bad_input_is_refused_in_one_sentence() {
    let scratch = Scratch::new(&["rank"], "refused");
    for (arguments, words) in [
        (&["msl", "--filters", "kalman"][..], "kalman"),
        (&["msl", "--filters", "ekf,imm,ekf"], "ekf twice"),
        (&["msl", "--runs", "0"], "0"),
        (&["msl", "--case", "storm"], "storm"),
        (&["nowhere"], "nowhere"),
        (&["msl-ideal"], "ideal"),
    ] {
        assert_refused(&scratch.run(arguments), &[words]);
    }
    let theirs = scratch.path.join("theirs");
    fs::create_dir_all(&theirs).expect("a folder");
    fs::write(theirs.join("entries.jsonl"), "{}\n").expect("a file");
    let output = scratch.run(&["msl", "--runs", "1", "--filters", "ekf", "--open-loop", "--out", "theirs"]);
    assert_refused(&output, &["no list of entries of a ranking"]);
    assert!(!scratch.path.join("rankings").exists(), "nothing is written before the input is known to be good");
}
