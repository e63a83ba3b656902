//! A truth simulator somewhere else: over TCP, or behind a pseudo-terminal of its own.

use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::bench;
use super::{Conductor, Pace, Plant, SessionError};
use crate::scenario::Scenario;
use crate::transport::{Stream, Tcp};

/// Silence of the truth simulator after which it counts as lost.
const PATIENCE: Duration = Duration::from_secs(10);
/// Pieces in which the silence is waited for.
const PATIENCE_STEP: Duration = Duration::from_millis(200);

/// Where truth comes from, for a host that carries bytes between it and a flight computer.
pub trait TruthEnd {
    /// Hands over what the flight computer said and appends what it should hear next; nothing when none has come yet.
    ///
    /// # Errors
    /// The truth is lost.
    fn exchange(&mut self, said: &[u8], next: &mut Vec<u8>) -> Result<(), SessionError>;
}

impl<P: Plant> TruthEnd for Conductor<P> {
    fn exchange(&mut self, said: &[u8], next: &mut Vec<u8>) -> Result<(), SessionError> {
        self.receive(said);
        let before = next.len();
        self.transmit(next);
        if next.len() == before && self.status().finished.is_none() {
            self.timeout();
            self.transmit(next);
        }
        match self.status().finished {
            Some(super::End::Failed(error)) => Err(error),
            _ => Ok(()),
        }
    }
}

/// A flight that is simulated by another process, or by a thread at the other end of a real pseudo-terminal.
pub struct RemoteTruth {
    stream: Box<dyn Stream>,
    /// Bytes of the session that came with the last message of the preamble.
    waiting: Vec<u8>,
    bytes_heard: u64,
    /// Since when nothing has come.
    silent_since: Option<Instant>,
    helper: Option<Helper>,
}

/// Who sits at the other end of a pseudo-terminal.
enum Helper {
    Process(Child),
    #[allow(dead_code)] // kept so that the thread's fate is ours
    Thread(JoinHandle<()>),
}

impl Drop for Helper {
    fn drop(&mut self) {
        if let Self::Process(child) = self {
            // It ends by itself when the flight does; after a failure nobody else would end it.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl RemoteTruth {
    /// Orders a flight at `place`: `tcp:HOST:PORT` or `pty`.
    ///
    /// # Errors
    /// One sentence: no such place, nobody there, another protocol, flight refused.
    pub fn open(place: &str, scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Result<Self, SessionError> {
        let (mut stream, helper): (Box<dyn Stream>, Option<Helper>) = match place.split_once(':') {
            Some(("tcp", address)) => (Box::new(Tcp::connect(address)?), None),
            #[cfg(unix)]
            None if place == "pty" => return Self::behind_pty(scenario, seed, run, nominal),
            _ => {
                let reason = "not a place for the truth; expected in-process, tcp:HOST:PORT or pty".into();
                return Err(SessionError::Open { place: place.into(), reason });
            }
        };
        let waiting = bench::order(stream.as_mut(), scenario, seed, run, nominal)?;
        Ok(Self { stream, waiting, bytes_heard: 0, silent_since: None, helper })
    }

    /// Opens a pseudo-terminal and puts a truth simulator behind it: the `hil-sim` program where it lies beside this
    /// one, else a thread that runs the same server.
    #[cfg(unix)]
    fn behind_pty(scenario: &Scenario, seed: u64, run: u64, nominal: bool) -> Result<Self, SessionError> {
        use crate::transport::{PtyPair, open_terminal};
        let pair = PtyPair::open()?;
        let path = pair.slave_path.clone();
        let helper = match beside_this_program("hil-sim") {
            Some(program) => {
                let child = Command::new(&program)
                    .arg("--terminal")
                    .arg(&path)
                    .args(["--once", "--quiet"])
                    .stdin(Stdio::null())
                    .stdout(Stdio::null())
                    .spawn()
                    .map_err(|e| SessionError::Open { place: program.display().to_string(), reason: e.to_string() })?;
                Helper::Process(child)
            }
            None => {
                let mut far_end = open_terminal(&path)?;
                Helper::Thread(std::thread::spawn(move || {
                    // What goes wrong there shows here as a refusal or a cut link.
                    let _ = bench::serve(&mut far_end, Pace::LockStep);
                }))
            }
        };
        let mut stream: Box<dyn Stream> = Box::new(pair.master);
        let waiting = bench::order(stream.as_mut(), scenario, seed, run, nominal)?;
        // The simulator has its end open by now; with ours closed, its going away shows.
        drop(pair.slave);
        Ok(Self { stream, waiting, bytes_heard: 0, silent_since: None, helper: Some(helper) })
    }

    /// Whether another process simulates the flight.
    #[must_use]
    pub fn has_own_process(&self) -> bool {
        matches!(self.helper, Some(Helper::Process(_)))
    }

    fn cut(&self, e: &std::io::Error) -> SessionError {
        let when = if self.bytes_heard > 0 { "in mid-flight" } else { "before the flight" };
        SessionError::Cut { peer: "truth simulator", when: when.into(), reason: e.to_string() }
    }
}

impl TruthEnd for RemoteTruth {
    fn exchange(&mut self, said: &[u8], next: &mut Vec<u8>) -> Result<(), SessionError> {
        if !said.is_empty() {
            self.stream.write_all(said).map_err(|e| self.cut(&e))?;
        }
        if !self.waiting.is_empty() {
            self.bytes_heard += self.waiting.len() as u64;
            next.append(&mut self.waiting);
            return Ok(());
        }
        let mut buffer = [0u8; 4096];
        match self.stream.read_some(&mut buffer, PATIENCE_STEP) {
            // Back to the caller, who may have been told to stop.
            Ok(0) if self.silent_since.get_or_insert_with(Instant::now).elapsed() < PATIENCE => Ok(()),
            Ok(0) => {
                let waited_s = PATIENCE.as_secs_f64();
                Err(SessionError::NoAnswer { peer: "truth simulator", what: "in the session".into(), waited_s })
            }
            Ok(n) => {
                self.silent_since = None;
                self.bytes_heard += n as u64;
                next.extend_from_slice(&buffer[..n]);
                Ok(())
            }
            Err(e) => Err(self.cut(&e)),
        }
    }
}

/// A program in the folder of this one.
fn beside_this_program(name: &str) -> Option<std::path::PathBuf> {
    let folder = std::env::current_exe().ok()?.parent()?.to_path_buf();
    let name = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let beside = folder.join(&name);
    beside.is_file().then_some(beside)
}
