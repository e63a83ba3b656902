//! The program as a user meets it: exit codes, run folders, and one sentence for every bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hil_sim::session::{Pace, bench};
use hil_sim::transport::{Listener, Stream, Tcp};

/// A folder of its own for one test, removed at the end of it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-cli-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    fn aeroshell(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(arguments).current_dir(&self.0).output().expect("the program starts")
    }

    fn file(&self, path: &str) -> String {
        fs::read_to_string(self.0.join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    fn hash(&self, run: &str) -> String {
        let summary: serde_json::Value = serde_json::from_str(&self.file(&format!("{run}/summary.json"))).unwrap();
        summary["output_hash"].as_str().expect("a summary has a hash").to_owned()
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

#[test]
fn a_flight_leaves_a_whole_run_folder_and_replays_identically() {
    let scratch = Scratch::new("flight");
    let flown = scratch.aeroshell(&["--json", "--csv"]);
    assert_eq!(flown.status.code(), Some(0), "{}", stderr(&flown));
    let summary: serde_json::Value =
        serde_json::from_slice(&flown.stdout).expect("--json prints JSON and nothing else");
    assert_eq!(summary["success"], true);
    for name in fsw_host::runfolder::FILES.into_iter().filter(|name| *name != fsw_host::runfolder::BOARD_LOG) {
        let size = fs::metadata(scratch.0.join("runs/msl-seed1").join(name)).map(|m| m.len()).unwrap_or(0);
        assert!(size > 100, "{name} has {size} bytes");
    }
    let resolved = scratch.aeroshell(&["scenario", "check", "runs/msl-seed1/scenario.toml"]);
    assert_eq!(resolved.status.code(), Some(0), "{}", stderr(&resolved));
    let replayed = scratch.aeroshell(&["replay", "runs/msl-seed1"]);
    assert_eq!(replayed.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&replayed.stdout).starts_with("identical"));
    // Again: another folder, the same bits; another seed: other bits.
    assert_eq!(scratch.aeroshell(&["--quiet"]).status.code(), Some(0));
    scratch.aeroshell(&["--quiet", "--seed", "2"]);
    assert_eq!(scratch.hash("runs/msl-seed1"), scratch.hash("runs/msl-seed1-2"));
    assert_ne!(scratch.hash("runs/msl-seed1"), scratch.hash("runs/msl-seed2"));
}

#[test]
fn a_changed_log_is_told_from_the_flight_it_was() {
    let scratch = Scratch::new("changed");
    scratch.aeroshell(&["--quiet", "--out", "run"]);
    let path = scratch.0.join("run/link.bin");
    let mut bytes = fs::read(&path).unwrap();
    // Inside a packet to the flight computer near the middle, not in the header of a record.
    let packet = packet_near(&bytes, bytes.len() / 2);
    bytes[packet.start + packet.len() / 2] ^= 0x08;
    fs::write(&path, bytes).unwrap();
    let replayed = scratch.aeroshell(&["replay", "run"]);
    assert_eq!(replayed.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&replayed.stdout).starts_with("different: frame"));
}

/// Where the bytes of a packet to the flight computer lie, at or behind a place in a link log.
fn packet_near(log: &[u8], place: usize) -> std::ops::Range<usize> {
    let mut at = 18;
    loop {
        let length = u32::from_le_bytes(log[at + 1..at + 5].try_into().unwrap()) as usize;
        if at >= place && log[at] == 0 {
            return at + 5..at + 5 + length;
        }
        at += 5 + length;
    }
}

#[test]
fn a_log_that_is_garbled_or_empty_is_refused_and_one_cut_off_is_not() {
    let scratch = Scratch::new("garbled");
    scratch.aeroshell(&["--quiet", "--out", "run"]);
    let path = scratch.0.join("run/link.bin");
    let whole = fs::read(&path).unwrap();
    let record = packet_near(&whole, whole.len() / 2).start - 5;
    let mut garbled = whole.clone();
    garbled[record] = 7;
    for (bytes, words) in
        [(&garbled[..], ["garbled at byte", "run/link.bin"]), (&whole[..18], ["no whole record", "run/link.bin"])]
    {
        fs::write(&path, bytes).unwrap();
        assert_refused(&scratch.aeroshell(&["replay", "run"]), &words);
    }
    fs::write(&path, &whole[..record + 3]).unwrap();
    let replayed = scratch.aeroshell(&["replay", "run"]);
    assert_eq!(replayed.status.code(), Some(0), "{}", stderr(&replayed));
    assert!(String::from_utf8_lossy(&replayed.stdout).contains("cut off"));
}

#[test]
fn bad_input_is_refused_in_one_sentence_and_leaves_nothing_behind() {
    let scratch = Scratch::new("bad");
    fs::create_dir(scratch.0.join("full")).unwrap();
    fs::write(scratch.0.join("full/notes.txt"), "mine").unwrap();
    fs::write(scratch.0.join("typo.toml"), "name = \"typo\"\n[entry]\nsped_mps = 5000\n").unwrap();
    fs::write(scratch.0.join("text.toml"), "name = \"text\"\n[entry]\nspeed_mps = \"fast\"\n").unwrap();
    let cases: &[(&[&str], &[&str])] = &[
        (&["nosuch"], &["nosuch", "msl-beacon"]),
        (&["typo.toml"], &["typo.toml", "sped_mps", "speed_mps"]),
        (&["text.toml"], &["text.toml", "speed_mps"]),
        (&["--set", "entry.speed_mps=nan"], &["entry.speed_mps", "NaN", "15000"]),
        (&["--set", "entry.speed_mps=1e9"], &["entry.speed_mps", "15000"]),
        (&["--set", "vehicle.aero_table=\"no.csv\""], &["no.csv"]),
        (&["--set", "nonsense"], &["nonsense"]),
        (&["--set", "target.longitude_deg=90"], &["msl: target: out of reach", "off the entry heading"]),
        (&["--set", "target.longitude_deg=-40"], &["msl: target: out of reach", "this entry reaches"]),
        (&["--set", "planet.mu_m3ps2=1e12"], &["planet.mu_m3ps2", "surface gravity", "0.1 to 100"]),
        (&["--seed", "-1"], &["--seed", "-1"]),
        (&["--out", "typo.toml"], &["typo.toml", "is a file"]),
        (&["--out", "typo.toml", "--force"], &["typo.toml", "is a file"]),
        (&["propagate", "--bank", "1", "--out", "full", "--force"], &["full", "is a folder"]),
        (&["propagate", "--bank", "1", "--every", "-1"], &["--every", "-1"]),
        (&["/dev/zero"], &["/dev/zero", "longer than"]),
        (&["--out", "full"], &["full", "occupied", "--out", "--force"]),
        (&["--out", "full", "--force"], &["full", "occupied"]),
        (&["--truth", "tcp:127.0.0.1:1"], &["127.0.0.1:1"]),
        (&["--truth", "udp:here"], &["udp:here", "tcp:HOST:PORT"]),
        (&["--nav", "guess"], &["guess", "dead-reckoning"]),
        (&["--seed", "many"], &["many"]),
        (&["replay", "nowhere"], &["nowhere"]),
        (&["replay", "typo.toml"], &["typo.toml", "AEROLINK"]),
        (&["propagate", "--bank", "60", "--until", "depth=3"], &["depth", "altitude_km="]),
        (&["propagate", "--bank", "60", "--until", "altitude_km=low"], &["altitude_km=low"]),
        (&["propagate", "--bank", "nan"], &["--bank", "NaN"]),
        (&["propagate", "--bank", "1", "--out", "typo.toml"], &["typo.toml", "--force"]),
        (&["scenario", "check", "text.toml"], &["text.toml", "speed_mps"]),
        (&["scenario", "show", "nosuch"], &["nosuch"]),
    ];
    for (arguments, words) in cases {
        assert_refused(&scratch.aeroshell(arguments), words);
    }
    let mut left: Vec<_> = fs::read_dir(&scratch.0).unwrap().map(|e| e.unwrap().file_name()).collect();
    left.sort();
    assert_eq!(left, ["full", "text.toml", "typo.toml"]);
    assert_eq!(scratch.file("full/notes.txt"), "mine");
}

/// Serves one flight on a port of the system's choice; `wrap` may spoil the stream.
fn server(wrap: impl FnOnce(Tcp) -> Box<dyn Stream> + Send + 'static) -> (String, std::thread::JoinHandle<()>) {
    let listener = Listener::bind("127.0.0.1:0").expect("a free port");
    let address = listener.local_address().unwrap();
    let thread = std::thread::spawn(move || {
        let stream = listener.accept().expect("the program connects");
        let _ = bench::serve(wrap(stream).as_mut(), Pace::LockStep);
    });
    (format!("tcp:{address}"), thread)
}

#[test]
fn flights_in_process_over_tcp_and_over_a_pseudo_terminal_are_the_same() {
    let scratch = Scratch::new("places");
    let (address, thread) = server(|stream| Box::new(stream));
    for (place, run) in [("in-process", "a"), (address.as_str(), "b"), ("pty", "c")] {
        let flown = scratch.aeroshell(&["--quiet", "--truth", place, "--out", run]);
        assert_eq!(flown.status.code(), Some(0), "{place}: {}", stderr(&flown));
        assert_eq!(scratch.aeroshell(&["replay", run, "--quiet"]).status.code(), Some(0), "{place}");
    }
    thread.join().unwrap();
    assert_eq!(scratch.hash("a"), scratch.hash("b"));
    assert_eq!(scratch.hash("a"), scratch.hash("c"));
    assert!(fs::read(scratch.0.join("a/link.bin")).unwrap() == fs::read(scratch.0.join("b/link.bin")).unwrap());
}

/// A stream that breaks after so many bytes.
struct Cut {
    stream: Tcp,
    left: usize,
}

impl Stream for Cut {
    fn read_some(&mut self, buffer: &mut [u8], patience: std::time::Duration) -> std::io::Result<usize> {
        self.stream.read_some(buffer, patience)
    }

    fn write_all(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.left = self.left.checked_sub(bytes.len()).ok_or(std::io::ErrorKind::BrokenPipe)?;
        self.stream.write_all(bytes)
    }
}

#[test]
fn a_link_cut_in_mid_flight_keeps_what_was_recorded() {
    let scratch = Scratch::new("cut");
    let (address, thread) = server(|stream| Box::new(Cut { stream, left: 300_000 }));
    let flown = scratch.aeroshell(&["--quiet", "--truth", &address, "--out", "run"]);
    thread.join().unwrap();
    assert_eq!(flown.status.code(), Some(1), "{}", stderr(&flown));
    let summary: serde_json::Value = serde_json::from_str(&scratch.file("run/summary.json")).unwrap();
    assert_eq!(summary["outcome"], "failed");
    assert!(summary["frames"].as_u64().is_some_and(|frames| frames > 100), "{summary}");
    assert!(stderr(&flown).contains("cut in mid-flight"), "{}", stderr(&flown));
    assert!(Path::new(&scratch.0.join("run/report.html")).exists());
    assert_eq!(scratch.aeroshell(&["replay", "run", "--quiet"]).status.code(), Some(0));
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_a_readable_run_folder() {
    let scratch = Scratch::new("interrupt");
    let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
    let arguments = ["--quiet", "--realtime", "--out", "run"];
    let mut child = command.args(arguments).current_dir(&scratch.0).spawn().expect("the program starts");
    // The log grows from the first frame on: once it is there the handler is in place.
    let log = scratch.0.join("run/link.bin");
    while fs::metadata(&log).map_or(0, |m| m.len()) < 10_000 {
        assert!(child.try_wait().unwrap().is_none(), "the flight ended before it was interrupted");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().expect("kill runs");
    assert!(killed.success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert!(scratch.file("run/summary.json").contains("\"interrupted\""));
    assert_eq!(scratch.aeroshell(&["replay", "run", "--quiet"]).status.code(), Some(0));
}

#[test]
fn propagation_reaches_its_stop_and_prints_what_was_asked_for() {
    let scratch = Scratch::new("propagate");
    let flown =
        scratch.aeroshell(&["propagate", "--bank", "-42.5", "--until", "speed_mps=450", "--json", "--out", "p.csv"]);
    assert_eq!(flown.status.code(), Some(0), "{}", stderr(&flown));
    let outcome: serde_json::Value = serde_json::from_slice(&flown.stdout).unwrap();
    // The stop is located to 1e-9 s; at 20 m/s² that is 2e-8 m/s.
    assert!((outcome["speed_mps"].as_f64().unwrap() - 450.0).abs() < 1e-7, "{outcome}");
    let table = scratch.file("p.csv");
    let last = table.lines().last().unwrap();
    assert!((last.split(',').nth(4).unwrap().parse::<f64>().unwrap() - 450.0).abs() < 1e-7);
    let never = scratch.aeroshell(&["propagate", "--bank", "0", "--until", "range_km=90000", "--quiet"]);
    assert_eq!(never.status.code(), Some(1));
    assert!(stderr(&never).contains("not reached"), "{}", stderr(&never));
}
