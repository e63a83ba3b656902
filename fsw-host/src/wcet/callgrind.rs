//! The hard flights under Callgrind: exact instruction counts of this machine, the same at every repetition.
//!
//! The program `host-bench` flies what went up the link, as the bench image does on a target. It is built when it is
//! needed, because its bindings to Valgrind need libclang, which nobody needs who only flies.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use rayon::prelude::*;

use super::bar::Bar;
use super::flights::HardFlight;
use super::ledger::FlightCost;
use super::table::Flown;
use super::target::flown;
use super::uplink::record;
use crate::error::HostError;
use crate::target::TargetError;
use crate::target::bench::Folder;
use crate::target::image::{PROFILE, cargo_build, executable};
use crate::target::qemu::bind_to_this_process;

/// What the figures are, in words.
pub const GRANULARITY: &str = "instructions of this machine, not cycles: counted by Callgrind, the same at every \
     repetition; budgets are those of the flight computer and do not apply";
/// What counts need beyond the toolchain.
const PACKAGES: &str = "valgrind libclang1-19 libclang-common-19-dev";
/// The program.
const BENCH: &str = "host-bench";
/// Time between two looks at the interrupt.
const GLANCE: Duration = Duration::from_millis(20);

/// The program that flies under Callgrind.
#[derive(Debug)]
pub struct Bench(PathBuf);

impl Bench {
    /// Builds it.
    ///
    /// # Errors
    /// One sentence that names what to install; or cargo's own words.
    pub fn build() -> Result<Self, TargetError> {
        let missing = || TargetError::NoCallgrind(PACKAGES);
        let version = Command::new("valgrind").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
        if !version.is_ok_and(|status| status.success()) {
            return Err(missing());
        }
        let output = cargo_build(&["--package", BENCH, "--features", "callgrind", "--profile", PROFILE])?;
        let said = String::from_utf8_lossy(&output.stderr);
        match executable(&output.stdout, BENCH) {
            Some(program) if output.status.success() => Ok(Self(program)),
            _ if said.contains("libclang") || said.contains("file not found") => Err(missing()),
            _ => Err(TargetError::Build { image: BENCH.into(), triple: "this machine", said: said.trim().into() }),
        }
    }

    /// Measures flights, as many at a time as there are processors.
    ///
    /// # Errors
    /// A flight cannot be flown, or the user has had enough.
    pub fn measure(&self, flights: &[HardFlight], interrupt: &AtomicBool, bar: &Bar) -> Result<Vec<Flown>, HostError> {
        let done = AtomicUsize::new(0);
        let one = |flight: &HardFlight| {
            bar.at(done.load(Ordering::Relaxed), &flight.name);
            let answer = self.fly(&record(flight)?.log, interrupt)?;
            bar.at(done.fetch_add(1, Ordering::Relaxed) + 1, &flight.name);
            flown(flight, FlightCost::of_answer(&answer))
        };
        flights.par_iter().map(one).collect()
    }

    /// Flies one recorded uplink; what came down the link.
    fn fly(&self, log: &[u8], interrupt: &AtomicBool) -> Result<Vec<u8>, TargetError> {
        let folder = Folder::new()?;
        let (uplink, answer) = (folder.0.join("uplink.bin"), folder.0.join("answer.bin"));
        fs::write(&uplink, log).map_err(TargetError::system(format!("write {}", uplink.display())))?;
        let mut child = self.start(&uplink, &answer).map_err(TargetError::system("start valgrind"))?;
        let status = loop {
            match child.try_wait().map_err(TargetError::system("wait for valgrind"))? {
                Some(status) => break status,
                None if interrupt.load(Ordering::Relaxed) => {
                    let _ = child.kill().and_then(|()| child.wait());
                    return Err(TargetError::Interrupted);
                }
                None => std::thread::sleep(GLANCE),
            }
        };
        if !status.success() {
            return Err(TargetError::Bench { target: "this machine", reason: format!("valgrind ended with {status}") });
        }
        fs::read(&answer).map_err(TargetError::system(format!("read {}", answer.display())))
    }

    /// Valgrind's log, its standard error, is what the program reads from its standard input.
    fn start(&self, uplink: &Path, answer: &Path) -> io::Result<std::process::Child> {
        let (status, log) = io::pipe()?;
        let mut command = Command::new("valgrind");
        command.args(["--tool=callgrind", "--collect-atstart=no", "--callgrind-out-file=/dev/null"]);
        // Its status lists the stack of functions that it keeps; nobody reads it, and without it a flight is four times
        // quicker. Functions of shared libraries are found before the flight, not in the middle of a frame.
        command.args(["--fn-skip=*fsw_core*", "--fn-skip=*host_bench*"]).env("LD_BIND_NOW", "1");
        command.arg(&self.0).arg(uplink);
        bind_to_this_process(&mut command);
        command.stdin(status).stderr(log).stdout(fs::File::create(answer)?).spawn()
    }
}
