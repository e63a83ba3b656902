//! `campaign` and `compare` as a user meets them: results that depend on nothing but scenario, seed and run numbers, and
//! one sentence for every bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use fsw_host::campaign::statistics::{deviation, mean};
use fsw_host::campaign::summary::Runs;
use fsw_host::campaign::table::Reader;
use hil_sim::scenario::{Dispersion, Scenario};

/// Several chunks, so that an interruption leaves some whole and some not.
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
    assert_refused(&merge(&["a", "nowhere"]), &["nowhere is no campaign folder"]);
    assert_refused(&scratch.aeroshell(&["campaign", "--merge", "a", "b"]), &["--merge needs --out"]);
    assert!(!scratch.0.join("x").exists(), "a refused merge leaves nothing behind");
}

#[test]
fn a_killed_campaign_goes_on_and_ends_as_if_nothing_had_been() {
    let scratch = Scratch::new("killed");
    let (mut flying, chunks) = fly_until_chunks(&scratch, "killed", 2);
    flying.kill().unwrap();
    flying.wait().unwrap();
    assert!(!scratch.0.join("killed/runs.parquet").exists(), "it was killed too late to show anything");
    // What a kill in the middle of a write, or a failing disk, may leave behind.
    let whole_chunks = chunks_in(&chunks);
    fs::write(chunks.join("000000000004-0123456789abcdef.parquet"), "torn").unwrap();
    fs::write(chunks.join("000000000003-0123456789abcdef.parquet.part"), "half").unwrap();
    let mut bytes = fs::read(&whole_chunks[0]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&whole_chunks[0], bytes).unwrap();
    let resumed = scratch.aeroshell(&begun_with("killed"));
    assert!(resumed.status.success(), "{}", stderr(&resumed));
    let kept = format!("goes on in killed: {} of 80 runs are there", 16 * (whole_chunks.len() - 1));
    assert!(stderr(&resumed).contains(&kept), "{}", stderr(&resumed));
    assert_same_as_whole(&scratch.0.join("killed"));
    // Once more: nothing is left to fly, and the results and their rate stay.
    let before = fs::read(scratch.0.join("killed/summary.json")).unwrap();
    let again = scratch.aeroshell(&[&begun_with("killed")[..], &["--json"]].concat());
    let said: serde_json::Value = serde_json::from_slice(&again.stdout).expect("--json prints JSON and nothing else");
    assert!(said["runs_per_s"].as_f64().is_some_and(|rate| rate > 0.0));
    assert_eq!(fs::read(scratch.0.join("killed/summary.json")).unwrap(), before);
    assert_same_as_whole(&scratch.0.join("killed"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_flown_and_the_same_command_goes_on() {
    let scratch = Scratch::new("interrupted");
    let (mut flying, _) = fly_until_chunks(&scratch, "stopped", 1);
    let id = flying.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let mut said = String::new();
    std::io::Read::read_to_string(&mut flying.stderr.take().unwrap(), &mut said).unwrap();
    assert_eq!(flying.wait().unwrap().code(), Some(2), "{said}");
    assert!(said.contains("interrupted: ") && said.contains(" of 80 runs are kept in stopped"), "{said}");
    let resumed = scratch.aeroshell(&begun_with("stopped"));
    assert!(resumed.status.success() && stderr(&resumed).contains("goes on in stopped"), "{}", stderr(&resumed));
    assert_same_as_whole(&scratch.0.join("stopped"));
}

/// The arguments of the whole campaign on one thread.
fn begun_with(out: &str) -> Vec<&str> {
    [&["campaign"], &SCENARIO[..], &["--runs", RUNS, "--jobs", "1", "--out", out]].concat()
}

/// Begins the whole campaign and waits until so many chunks are whole; the program and the folder of the chunks.
fn fly_until_chunks(scratch: &Scratch, out: &str, count: usize) -> (Child, PathBuf) {
    let mut command = scratch.command(&begun_with(out));
    let mut flying = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let chunks = scratch.0.join(out).join("chunks");
    let begun = Instant::now();
    // The limit only keeps a broken program from hanging the test.
    while chunks_in(&chunks).len() < count {
        assert!(begun.elapsed() < Duration::from_secs(300) && flying.try_wait().unwrap().is_none(), "no chunk came");
        std::thread::sleep(Duration::from_millis(10));
    }
    (flying, chunks)
}

/// The whole chunks in a folder, in order.
fn chunks_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "parquet"));
    paths.sort();
    paths
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
    let mut arguments = vec!["campaign", "msl-ideal", "--runs", "3", "--out", "zero", "--quiet"];
    zero.iter().for_each(|set| arguments.extend(["--set", set.as_str()]));
    // Guidance learns lift and drag from the inertial unit, whose errors are no dispersions.
    let errors = ["accelerometer_bias_ug", "accelerometer_scale_ppm", "accelerometer_misalignment_mrad"];
    let noise = ["accelerometer_noise_ugprthz", "gyro_bias_degph", "gyro_scale_ppm", "gyro_noise_degprth"];
    let exact = errors.iter().chain(&noise).map(|field| format!("sensors.imu.{field}=0"));
    let exact: Vec<String> = exact.collect();
    exact.iter().for_each(|set| arguments.extend(["--set", set.as_str()]));
    let flown = scratch.aeroshell(&arguments);
    assert!(flown.status.success(), "{}", stderr(&flown));
    let runs = Runs::new(Reader::open(&scratch.0.join("zero/runs.parquet")).unwrap());
    assert_eq!(runs.numbers("input_speed_mps").unwrap(), [0.0; 3]);
    let misses = runs.numbers("miss_m").unwrap();
    // The wave has no amplitude, whatever its length.
    assert!(misses.iter().all(|miss| *miss == misses[0]), "{misses:?}");
}

#[test]
fn bad_input_gets_one_sentence_and_leaves_nothing_behind() {
    let scratch = Scratch::new("bad");
    let campaign = |more: &[&str]| scratch.aeroshell(&[&["campaign", "msl-ideal"], more].concat());
    assert_refused(&campaign(&[]), &["--runs is missing"]);
    for bad in ["0", "-5", "many", "1e3", "2000000000", "99999999999999999999"] {
        assert_refused(&campaign(&["--runs", bad]), &["--runs", bad, "a whole number from 1 to 1000000000"]);
    }
    for bad in ["0", "-2", "100000"] {
        assert_refused(&campaign(&["--runs", "1", "--jobs", bad]), &["--jobs", bad, "from 1 to 1024"]);
    }
    assert_refused(&campaign(&["--runs", "1", "--first", "-1"]), &["--first", "from 0 to 1000000000"]);
    assert_refused(&campaign(&["--runs", "1", "--split", "x"]), &["--split", "from 0 to 1000000000"]);
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
fn nothing_is_lost_when_a_folder_cannot_be_used() {
    let scratch = Scratch::new("lost");
    scratch.campaign("a", &["--runs", "2"]);
    scratch.campaign("b", &["--runs", "2", "--first", "2"]);
    let table = |name: &str| fs::read(scratch.0.join(name).join("runs.parquet")).unwrap();
    let before = (table("a"), table("b"));
    let merge = |shards: &[&str], out: &[&str]| {
        scratch.aeroshell(&[&["campaign", "--quiet", "--merge"], shards, &["--out"], out].concat())
    };
    // The whole where a shard is would take the shard away.
    assert_refused(&merge(&["a", "b"], &["./a", "--force"]), &["--out ./a is a shard itself"]);
    // Tables that are not those of their campaigns.
    for (name, bytes) in [("swapped", before.1.clone()), ("torn", before.0[..before.0.len() / 2].to_vec())] {
        fs::create_dir(scratch.0.join(name)).unwrap();
        for file in ["campaign.json", "scenario.toml"] {
            fs::copy(scratch.0.join("a").join(file), scratch.0.join(name).join(file)).unwrap();
        }
        fs::write(scratch.0.join(name).join("runs.parquet"), bytes).unwrap();
    }
    assert_refused(&merge(&["swapped", "b"], &["m"]), &["swapped/runs.parquet does not hold runs 0 to 1"]);
    assert_refused(&merge(&["torn", "b"], &["m"]), &["cannot read torn/runs.parquet"]);
    assert_refused(&scratch.aeroshell(&["compare", "a", "swapped"]), &["swapped/runs.parquet does not hold"]);
    assert_refused(&scratch.aeroshell(&["compare", "."]), &[". is no campaign folder", "campaign.json"]);
    assert!(!scratch.0.join("m").exists(), "a refused merge leaves nothing behind");
    // The same once more from the beginning: all of its files are there again.
    scratch.campaign("a", &["--runs", "2", "--force"]);
    scratch.campaign("a", &["--runs", "2"]);
    assert_eq!((table("a"), table("b")), before);
    assert!(scratch.0.join("a/campaign.json").exists());
    // Another program at work in the folder.
    let file = fs::File::open(scratch.0.join("a/campaign.json")).unwrap();
    file.try_lock().unwrap();
    let same = [&["campaign"], &SCENARIO[..], &["--runs", "2", "--out", "a"]].concat();
    for more in [&[][..], &["--force"]] {
        assert_refused(&scratch.aeroshell(&[&same[..], more].concat()), &["another program", "a: wait"]);
    }
    assert_eq!((table("a"), table("b")), before);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_and_costs_no_file() {
    let scratch = Scratch::new("full");
    scratch.campaign("a", &["--runs", "2"]);
    let before = fs::read(scratch.0.join("a/summary.json")).unwrap();
    // Every write to this device fails as on a full disk.
    std::os::unix::fs::symlink("/dev/full", scratch.0.join("a/summary.json.part")).unwrap();
    let same = [&["campaign"], &SCENARIO[..], &["--runs", "2", "--out", "a"]].concat();
    assert_refused(&scratch.aeroshell(&same), &["cannot write a/summary.json", "No space left"]);
    assert_eq!(fs::read(scratch.0.join("a/summary.json")).unwrap(), before);
    let full = |arguments: &[&str]| scratch.aeroshell(&[arguments, &["--out", "/dev/full"]].concat());
    for arguments in [&["compare", "a"][..], &["footprint"], &["sweep", "entry.speed_mps=5500:5510:2", "--runs", "0"]] {
        assert_refused(&full(arguments), &["cannot write /dev/full", "No space left"]);
    }
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
    assert_refused(&scratch.aeroshell(&["compare", whole, "nowhere"]), &["nowhere is no campaign folder"]);
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
