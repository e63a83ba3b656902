//! Flights of the real programs against each other, as a user would start them.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use xshell::{Shell, cmd};

use crate::symbols::target_directory;

/// A flight that is to be cut has flown when its log has this many bytes.
const BYTES_BEFORE_THE_CUT: u64 = 20_000;
/// Longest wait for that.
const PATIENCE: Duration = Duration::from_secs(30);

/// The folder of the programs that users start, built. With the whole workspace in view, as the tests are: by themselves
/// they would be built a second time, with other features of the crates that they share.
pub fn programs(shell: &Shell) -> Result<PathBuf> {
    cmd!(shell, "cargo build --quiet --release --workspace --bin aeroshell --bin hil-sim").quiet().run()?;
    Ok(target_directory(shell)?.join("release"))
}

/// The default flight as a new user starts it, and its replay.
pub fn default_flight(shell: &Shell) -> Result<()> {
    let (aeroshell, folder) = (programs(shell)?.join("aeroshell"), shell.create_temp_dir()?);
    let out = folder.path().join("run");
    cmd!(shell, "{aeroshell} fly --quiet --out {out}").quiet().run()?;
    Ok(cmd!(shell, "{aeroshell} replay --quiet {out}").quiet().run()?)
}

/// One seed in process, over TCP and over a pseudo-terminal against a `hil-sim` process: the same hash, each replayed
/// identically; another seed another hash. A `hil-sim` that dies in mid-flight leaves a run marked failed.
pub fn separate_processes(shell: &Shell) -> Result<()> {
    let bench = Bench { programs: programs(shell)?, folder: shell.create_temp_dir()? };

    let here = bench.fly("in-process", "1")?;
    let simulator = Simulator::start(&bench.programs)?;
    let over_tcp = bench.fly(&simulator.place, "1")?;
    let over_pty = bench.fly("pty", "1")?;
    ensure!(over_tcp == here, "over TCP the flight has the hash {over_tcp}, in process {here}");
    ensure!(over_pty == here, "over a pseudo-terminal the flight has the hash {over_pty}, in process {here}");
    ensure!(bench.fly(&simulator.place, "2")? != here, "another seed gives the same flight");
    bench.lose(simulator)
}

struct Bench {
    programs: PathBuf,
    folder: xshell::TempDir,
}

impl Bench {
    fn aeroshell(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(self.programs.join("aeroshell"));
        command.args(arguments).current_dir(self.folder.path());
        command
    }

    /// Flies and replays; the hash of the flight.
    fn fly(&self, place: &str, seed: &str) -> Result<String> {
        let flown = self.aeroshell(&["fly", "--quiet", "--force", "--out", "run", "--seed", seed, "--truth", place]);
        ensure!(run(flown)? == Some(0), "the flight with --truth {place} failed");
        let replayed = self.aeroshell(&["replay", "--quiet", "run"]);
        ensure!(run(replayed)? == Some(0), "the replay of the flight with --truth {place} differs");
        field(&self.folder.path().join("run/summary.json"), "output_hash")
    }

    /// Loses the simulator in mid-flight.
    fn lose(&self, mut simulator: Simulator) -> Result<()> {
        let arguments = ["fly", "--quiet", "--realtime", "--out", "cut", "--truth", &simulator.place];
        let mut flight = self.aeroshell(&arguments).stderr(Stdio::null()).spawn()?;
        let (log, start) = (self.folder.path().join("cut/link.bin"), Instant::now());
        while std::fs::metadata(&log).map_or(0, |m| m.len()) < BYTES_BEFORE_THE_CUT {
            if flight.try_wait()?.is_some() || start.elapsed() > PATIENCE {
                let _ = flight.kill();
                bail!("the flight that was to be cut did not get off the ground");
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        simulator.process.kill()?;
        let code = flight.wait()?.code();
        ensure!(code == Some(1), "a flight whose simulator died ended with the exit code {code:?}");
        let reason = field(&self.folder.path().join("cut/summary.json"), "reason")?;
        ensure!(reason.contains("cut in mid-flight"), "it gives the reason {reason}");
        ensure!(run(self.aeroshell(&["replay", "--quiet", "cut"]))? == Some(0), "what was recorded does not replay");
        Ok(())
    }
}

fn run(mut command: Command) -> Result<Option<i32>> {
    Ok(command.status().with_context(|| format!("{command:?}"))?.code())
}

/// A `hil-sim --listen` of our own; it ends when this goes away.
struct Simulator {
    process: Child,
    place: String,
}

impl Simulator {
    fn start(programs: &Path) -> Result<Self> {
        let mut command = Command::new(programs.join("hil-sim"));
        command.args(["--listen", "tcp:127.0.0.1:0", "--quiet"]).stdout(Stdio::piped());
        let mut process = command.spawn().context("hil-sim does not start")?;
        let mut line = String::new();
        let out = process.stdout.take().context("hil-sim has no standard output")?;
        BufReader::new(out).read_line(&mut line)?;
        let place = line.trim().strip_prefix("listening on ").map(String::from);
        let mut simulator = Self { process, place: String::new() };
        simulator.place = place.with_context(|| format!("hil-sim says {line:?} where its address was expected"))?;
        Ok(simulator)
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// A text field of a summary, which has one field on a line.
fn field(summary: &Path, name: &str) -> Result<String> {
    let text = std::fs::read_to_string(summary).with_context(|| summary.display().to_string())?;
    let start = format!("\"{name}\": ");
    let line = text.lines().find_map(|line| line.trim().strip_prefix(&start));
    let value = line.with_context(|| format!("{} has no {name}", summary.display()))?;
    Ok(value.trim_end_matches(',').trim_matches('"').to_owned())
}
