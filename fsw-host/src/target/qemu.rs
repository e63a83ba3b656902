//! QEMU as a child of this process: it never outlives it, and its last words are kept.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::{Image, Target, TargetError};

/// Wait for the last words of an emulator that has ended.
const LAST_WORDS_PATIENCE: Duration = Duration::from_millis(500);
/// Most of what an emulator says that is kept, bytes.
const MOST_WORDS: usize = 16 * 1024;

/// A running emulator; ended when this goes away.
#[derive(Debug)]
pub struct Qemu {
    target: Target,
    child: Child,
    words: Arc<Mutex<Vec<u8>>>,
    listener: Option<JoinHandle<()>>,
}

impl Qemu {
    /// Starts the emulator with an image. `devices` says where its serial lines lead; `ends` become its standard input
    /// and output.
    ///
    /// # Errors
    /// It is not installed, or does not start.
    pub fn start(target: Target, image: &Image, devices: &[String], ends: [Stdio; 2]) -> Result<Self, TargetError> {
        let program = target.emulator();
        let mut command = Command::new(program);
        command.args(target.machine());
        command.args(["-display", "none", "-monitor", "none", "-nodefaults", "-kernel"]).arg(&image.path).args(devices);
        let [input, output] = ends;
        command.stdin(input).stdout(output).stderr(Stdio::piped());
        bind_to_this_process(&mut command);
        let mut child = command.spawn().map_err(|source| match source.kind() {
            io::ErrorKind::NotFound => TargetError::EmulatorMissing { program, package: target.debian_package() },
            _ => TargetError::EmulatorStart { program, source },
        })?;
        let words = Arc::new(Mutex::new(Vec::new()));
        let listener = child.stderr.take().map(|said| {
            let words = Arc::clone(&words);
            std::thread::spawn(move || keep_words(said, &words))
        });
        Ok(Self { target, child, words, listener })
    }

    /// Why it has ended, if it has: exit status and last words.
    pub fn ended(&mut self) -> Option<String> {
        let status = self.child.try_wait().ok().flatten()?;
        Some(self.last_words(status))
    }

    /// Waits until it ends by itself. None when it still runs after `patience`.
    pub fn wait(&mut self, patience: Duration) -> Option<ExitStatus> {
        let due = Instant::now() + patience;
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if Instant::now() < due => std::thread::sleep(Duration::from_millis(2)),
                _ => return None,
            }
        }
    }

    /// Exit status and what was said before.
    pub fn last_words(&mut self, status: ExitStatus) -> String {
        let due = Instant::now() + LAST_WORDS_PATIENCE;
        while self.listener.as_ref().is_some_and(|l| !l.is_finished()) && Instant::now() < due {
            std::thread::sleep(Duration::from_millis(2));
        }
        let words =
            self.words.lock().map(|words| String::from_utf8_lossy(&words).trim().to_owned()).unwrap_or_default();
        let program = self.target.emulator();
        if words.is_empty() { format!("{program} ended with {status}") } else { format!("{words} ({status})") }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A process group of its own, so that Ctrl-C reaches us first; and the end of this process is its end too, even when
/// nothing of this program runs any more to say so.
pub(crate) fn bind_to_this_process(command: &mut Command) {
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        command.process_group(0);
        #[cfg(target_os = "linux")]
        // SAFETY: between fork and exec the closure makes one system call that is allowed there, and allocates nothing.
        unsafe {
            command.pre_exec(|| {
                nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGKILL).map_err(io::Error::from)
            });
        }
    }
}

fn keep_words(mut said: impl Read, words: &Mutex<Vec<u8>>) {
    let mut buffer = [0u8; 1024];
    while let Ok(n) = said.read(&mut buffer) {
        let (Ok(mut words), 1..) = (words.lock(), n) else { return };
        let room = MOST_WORDS.saturating_sub(words.len()).min(n);
        words.extend_from_slice(&buffer[..room]);
    }
}
