//! `campaign` and `compare` as a user meets them: results that depend on nothing but scenario, seed and run numbers, and
//! one sentence for every bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use fsw_host::campaign::statistics::{deviation, mean};
use fsw_host::campaign::summary::Runs;
use fsw_host::campaign::table::Reader;
use hil_sim::scenario::{Dispersion, Scenario};

/// More than two chunks, so that an interruption leaves some whole and some not.
const RUNS: &str = "80";
/// Every one of the cheap flights, with winds so that no dispersion is left out.
const SCENARIO: [&str; 3] = ["msl-ideal", "--set", "dispersions.winds=true"];

/// A folder of its own for one test, removed at the end of it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-campaign-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(arguments).current_dir(&self.0);
        command
    }

    fn aeroshell(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    /// Flies a part of the campaign that all tests share.
    #[track_caller]
    fn campaign(&self, out: &str, more: &[&str]) {
        let flown = self.aeroshell(&[&["campaign"], &SCENARIO[..], &["--quiet", "--out", out], more].concat());
        assert!(flown.status.success(), "{}", stderr(&flown));
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[track_caller]
fn assert_refused(output: &Output, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is missing in: {said}");
    }
}

/// The whole campaign, flown once on two threads without a break.
fn whole() -> &'static Path {
    static WHOLE: OnceLock<(Scratch, PathBuf)> = OnceLock::new();
    let (_, path) = WHOLE.get_or_init(|| {
        let scratch = Scratch::new("whole");
        scratch.campaign("whole", &["--runs", RUNS, "--jobs", "2"]);
        let path = scratch.0.join("whole");
        (scratch, path)
    });
    path
}

fn summary(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("summary.json")).expect("a campaign leaves its summary");
    let mut summary: serde_json::Value = serde_json::from_str(&text).expect("the summary is JSON");
    // The only two figures that tell of the sitting and not of the runs.
    for of_the_sitting in ["wall_s", "runs_per_s"] {
        summary.as_object_mut().and_then(|s| s.remove(of_the_sitting)).expect("the sitting is told");
    }
    summary
}

/// Every file of the campaign has the same bytes as that of the whole one.
#[track_caller]
fn assert_same_as_whole(folder: &Path) {
    let list = |folder: &Path| {
        let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    assert_eq!(list(folder), list(whole()));
    for name in ["runs.parquet", "report.html", "campaign.json", "scenario.toml"] {
        let same = fs::read(folder.join(name)).unwrap() == fs::read(whole().join(name)).unwrap();
        assert!(same, "{name} differs");
    }
    assert_eq!(summary(folder), summary(whole()));
}

#[test]
fn the_number_of_threads_leaves_no_trace() {
    let scratch = Scratch::new("threads");
    scratch.campaign("one", &["--runs", RUNS, "--jobs", "1"]);
    assert_same_as_whole(&scratch.0.join("one"));
}

#[test]
fn four_shards_merge_to_the_whole_campaign_whatever_their_order() {
    let scratch = Scratch::new("shards");
    for (name, first, runs) in [("a", "0", "7"), ("b", "7", "33"), ("c", "40", "25"), ("d", "65", "15")] {
        scratch.campaign(name, &["--first", first, "--runs", runs]);
    }
    let merged = scratch.aeroshell(&["campaign", "--merge", "c", "a", "d", "b", "--out", "merged", "--quiet"]);
    assert!(merged.status.success(), "{}", stderr(&merged));
    assert_same_as_whole(&scratch.0.join("merged"));

    let merge = |folders: &[&str]| scratch.aeroshell(&[&["campaign", "--merge"], folders, &["--out", "x"]].concat());
    assert_refused(&merge(&["a", "c", "d"]), &["leave a gap: runs 7 to 39", "a and c"]);
    scratch.campaign("overlapping", &["--first", "5", "--runs", "3"]);
    assert_refused(&merge(&["a", "overlapping"]), &["overlap in runs 5 to 6"]);
    scratch.campaign("reseeded", &["--first", "7", "--runs", "1", "--seed", "2"]);
    assert_refused(&merge(&["a", "reseeded"]), &["not shards of one campaign", "the seed is 1"]);
    fs::remove_file(scratch.0.join("d/runs.parquet")).unwrap();
    assert_refused(&merge(&["a", "b", "c", "d"]), &["d is not complete"]);
    assert_refused(&merge(&["a", "nowhere"]), &["cannot read nowhere/campaign.json"]);
    assert_refused(&scratch.aeroshell(&["campaign", "--merge", "a", "b"]), &["--merge needs --out"]);
    assert!(!scratch.0.join("x").exists(), "a refused merge leaves nothing behind");
}

#[test]
fn a_killed_campaign_goes_on_and_ends_as_if_nothing_had_been() {
    let scratch = Scratch::new("killed");
    let arguments = [&["campaign"], &SCENARIO[..], &["--runs", RUNS, "--jobs", "1", "--out", "killed"]].concat();
    let mut flying = scratch.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let chunks = scratch.0.join("killed/chunks");
    let begun = Instant::now();
    let is_whole = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|e| e == "parquet");
    // Until a first chunk is whole. The limit only keeps a broken program from hanging the test.
    while !fs::read_dir(&chunks).is_ok_and(|entries| entries.flatten().any(|entry| is_whole(&entry))) {
        assert!(begun.elapsed() < Duration::from_secs(300) && flying.try_wait().unwrap().is_none(), "no chunk came");
        std::thread::sleep(Duration::from_millis(20));
    }
    flying.kill().unwrap();
    flying.wait().unwrap();
    assert!(!scratch.0.join("killed/runs.parquet").exists(), "it was killed too late to show anything");
    // What a kill in the middle of a write, or a full disk, may leave behind.
    fs::write(chunks.join("000000000001.parquet"), "torn").unwrap();
    fs::write(chunks.join("000000000002.parquet.part"), "half").unwrap();
    let resumed = scratch.aeroshell(&arguments);
    assert!(resumed.status.success(), "{}", stderr(&resumed));
    assert!(stderr(&resumed).contains("goes on in killed: 32 of 80 runs are there"), "{}", stderr(&resumed));
    assert_same_as_whole(&scratch.0.join("killed"));
    // Once more: nothing is left to fly, and the results stay.
    let again = scratch.aeroshell(&[&arguments[..], &["--json"]].concat());
    let said: serde_json::Value = serde_json::from_slice(&again.stdout).expect("--json prints JSON and nothing else");
    assert_eq!(said["runs_per_s"], serde_json::Value::Null);
    assert_same_as_whole(&scratch.0.join("killed"));
}

#[test]
fn the_truth_of_the_runs_had_the_dispersions_that_were_asked_for() {
    let runs = Runs::new(Reader::open(&whole().join("runs.parquet")).unwrap());
    let scenario = Scenario::resolve("msl-ideal", &["dispersions.winds=true".to_owned()]).unwrap();
    let n = runs.count() as f64;
    for (name, asked) in scenario.dispersions.all() {
        let values = runs.numbers(&format!("input_{name}")).unwrap();
        assert_eq!(values.len(), 80, "{name}");
        let (middle, sigma, kurtosis) = match asked {
            Dispersion::None => panic!("{name} is not dispersed"),
            Dispersion::Normal { three_sigma } => (0.0, three_sigma / 3.0, 3.0),
            Dispersion::Uniform { bounds: [low, high] } => {
                assert!(values.iter().all(|v| (low..=high).contains(v)), "{name}");
                (0.5 * (low + high), (high - low) / 12f64.sqrt(), 1.8)
            }
        };
        // Four standard errors each, of the mean σ/√n and of the deviation σ√((κ − 1)/4n).
        let (mean, deviation) = (mean(&values).unwrap(), deviation(&values).unwrap());
        assert!((mean - middle).abs() < 4.0 * sigma / n.sqrt(), "{name}: mean {mean} of {middle}");
        let error: f64 = ((kurtosis - 1.0) / (4.0 * n)).sqrt();
        assert!((deviation / sigma - 1.0).abs() < 4.0 * error, "{name}: deviation {deviation} of {sigma}");
    }
}

#[test]
fn the_worst_runs_fly_again_to_the_same_miss() {
    let worst = &summary(whole())["worst"][0];
    let command = worst["command"].as_str().expect("a command");
    let arguments: Vec<&str> = command.split(' ').skip(1).chain(["--json", "--out", "again"]).collect();
    let flown = Scratch::new("again").aeroshell(&arguments);
    let said: serde_json::Value = serde_json::from_slice(&flown.stdout).expect("--json prints JSON and nothing else");
    assert_eq!(said["miss_m"], worst["miss_m"], "{command}");
}

#[test]
fn without_dispersion_every_run_is_the_same_flight() {
    let scratch = Scratch::new("sigma-zero");
    let zero: Vec<String> = Scenario::builtin("msl")
        .unwrap()
        .dispersions
        .all()
        .iter()
        .filter(|(_, d)| matches!(d, Dispersion::Normal { .. }))
        .map(|(name, _)| format!("dispersions.{name}.three_sigma=0"))
        .collect();
    let mut arguments = vec!["campaign", "msl-ideal", "--guidance", "paper", "--runs", "3", "--out", "zero", "--quiet"];
    zero.iter().for_each(|set| arguments.extend(["--set", set.as_str()]));
    let flown = scratch.aeroshell(&arguments);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let runs = Runs::new(Reader::open(&scratch.0.join("zero/runs.parquet")).unwrap());
    assert_eq!(runs.numbers("input_speed_mps").unwrap(), [0.0; 3]);
    let misses = runs.numbers("miss_m").unwrap();
    // The wave has no amplitude, whatever its length. The noise of the inertial unit, which is no dispersion, does not reach
    // a guidance that learns nothing from it.
    assert!(misses.iter().all(|miss| *miss == misses[0]), "{misses:?}");
}

#[test]
fn bad_input_gets_one_sentence_and_leaves_nothing_behind() {
    let scratch = Scratch::new("bad");
    let campaign = |more: &[&str]| scratch.aeroshell(&[&["campaign", "msl-ideal"], more].concat());
    assert_refused(&campaign(&[]), &["--runs is missing"]);
    assert_refused(&campaign(&["--runs", "0"]), &["--runs 0", "1 to"]);
    for bad in ["-5", "many", "1e3", "99999999999999999999"] {
        assert_refused(&campaign(&["--runs", bad]), &["--runs", bad]);
    }
    assert_refused(&campaign(&["--runs", "2000000000"]), &["--runs 2000000000"]);
    assert_refused(&campaign(&["--runs", "1", "--jobs", "0"]), &["--jobs", "0"]);
    assert_refused(&campaign(&["--runs", "1", "--first", "-1"]), &["--first"]);
    let unknown = "dispersions.mass={distribution=\"cauchy\",three_sigma=1.0}";
    assert_refused(&campaign(&["--runs", "1", "--set", unknown]), &["dispersions.mass", "cauchy"]);
    let negative = "dispersions.mass={distribution=\"normal\",three_sigma=-1.0}";
    assert_refused(&campaign(&["--runs", "1", "--set", negative]), &["three_sigma"]);
    assert_eq!(fs::read_dir(&scratch.0).unwrap().count(), 0, "refused campaigns left something behind");

    fs::write(scratch.0.join("file"), "mine").unwrap();
    assert_refused(&campaign(&["--runs", "1", "--out", "file"]), &["file is a file"]);
    fs::create_dir(scratch.0.join("thesis")).unwrap();
    fs::write(scratch.0.join("thesis/chapter.txt"), "mine").unwrap();
    for force in [&[][..], &["--force"]] {
        let taken = campaign(&[&["--runs", "1", "--out", "thesis"], force].concat());
        assert_refused(&taken, &["thesis is occupied"]);
    }
    assert_eq!(fs::read_to_string(scratch.0.join("thesis/chapter.txt")).unwrap(), "mine");
}

#[test]
fn a_folder_of_another_campaign_is_refused_with_the_difference_and_kept() {
    let scratch = Scratch::new("other");
    scratch.campaign("a", &["--runs", "2"]);
    let before = fs::read(scratch.0.join("a/runs.parquet")).unwrap();
    let campaign = |more: &[&str]| scratch.aeroshell(&[&["campaign", "--quiet", "--out", "a"], more].concat());
    assert_refused(
        &campaign(&["msl", "--runs", "2"]),
        &["a holds another campaign", "the scenario is msl-ideal there"],
    );
    assert_refused(&campaign(&["msl-ideal", "--runs", "2"]), &["a field of scenario msl-ideal differs"]);
    let same = |more: &[&str]| campaign(&[&SCENARIO[..], more].concat());
    assert_refused(&same(&["--runs", "3"]), &["the number of runs is 2 there and 3 here"]);
    assert_refused(&same(&["--runs", "2", "--seed", "9"]), &["the seed is 1 there and 9 here"]);
    assert_eq!(fs::read(scratch.0.join("a/runs.parquet")).unwrap(), before);
    let replaced = same(&["--runs", "1", "--seed", "9", "--force"]);
    assert!(replaced.status.success(), "{}", stderr(&replaced));
    assert_eq!(summary(&scratch.0.join("a"))["seed"], 9);
}

#[test]
fn campaigns_stand_side_by_side() {
    let scratch = Scratch::new("compare");
    scratch.campaign("few", &["--runs", "4"]);
    let whole = whole().to_str().unwrap();
    let compared = scratch.aeroshell(&["compare", whole, "few", "--out", "page.html"]);
    let said = String::from_utf8_lossy(&compared.stdout).into_owned();
    assert!(compared.status.success(), "{}", stderr(&compared));
    assert!(said.contains("A  whole (msl-ideal") && said.contains("miss 99 %, m"), "{said}");
    let page = fs::read_to_string(scratch.0.join("page.html")).unwrap();
    assert!(page.contains("B") && page.contains("<svg") && !page.contains("NaN"));
    assert_refused(&scratch.aeroshell(&["compare", whole, "few", "--out", "page.html"]), &["page.html exists"]);
    assert_refused(&scratch.aeroshell(&["compare", whole, "nowhere"]), &["cannot read nowhere/campaign.json"]);
    let json = scratch.aeroshell(&["compare", whole, "few", "--json"]);
    let said: serde_json::Value = serde_json::from_slice(&json.stdout).expect("--json prints JSON and nothing else");
    assert_eq!(said[0]["summary"]["runs"], 80);
}

#[test]
fn a_sweep_gives_a_row_for_every_value_and_refuses_what_cannot_be_flown() {
    let scratch = Scratch::new("sweep");
    let sweep = |more: &[&str]| scratch.aeroshell(&[&["sweep"], more].concat());
    let range = "entry.flight_path_angle_deg=-14.5:-14.0:3";
    let swept = sweep(&[range, "msl-ideal", "--runs", "2", "--json", "--out", "page.html"]);
    let said: serde_json::Value = serde_json::from_slice(&swept.stdout).expect("--json prints JSON and nothing else");
    let values: Vec<f64> = said.as_array().unwrap().iter().map(|row| row["value"].as_f64().unwrap()).collect();
    assert_eq!(values, [-14.5, -14.25, -14.0]);
    assert!(said[1]["p50_m"]["value"].as_f64().is_some_and(|miss| miss > 0.0));
    assert!(fs::read_to_string(scratch.0.join("page.html")).unwrap().contains("<svg"));
    assert_refused(&sweep(&[range, "msl-ideal", "--out", "page.html"]), &["page.html exists"]);
    assert_refused(&sweep(&["entry.speed_mps=1:2"]), &["FIELD=FROM:TO:COUNT"]);
    assert_refused(&sweep(&["entry.sped_mps=5400:5600:3"]), &["sped_mps", "speed_mps"]);
    assert_refused(&sweep(&["entry.flight_path_angle_deg=-14:5:2"]), &["flight_path_angle_deg = 5", "out of reach"]);
}

#[test]
fn a_footprint_shows_the_target_within_what_can_be_reached() {
    let scratch = Scratch::new("footprint");
    let shown = scratch.aeroshell(&["footprint", "msl", "--json", "--out", "page.html"]);
    let said: serde_json::Value = serde_json::from_slice(&shown.stdout).expect("--json prints JSON and nothing else");
    assert_eq!(said["target_inside"], true);
    assert!(said["corridor"].as_array().is_some_and(|slices| slices.iter().any(|slice| slice["open"] == true)));
    assert!(fs::read_to_string(scratch.0.join("page.html")).unwrap().contains("<svg"));
    assert_refused(&scratch.aeroshell(&["footprint", "nowhere"]), &["nowhere"]);
}
