//! Flights on the emulated processors against flights in this process.
//!
//! They need QEMU and the compiler's bare-metal targets and take minutes, so a plain `cargo test` passes them over:
//! `cargo xtask test` installs what they need and runs them.
#![cfg(target_os = "linux")]

mod costs;
mod failures;
mod flights;
mod modes;

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use fsw_host::record::Summary;

/// A folder of its own for one test, removed at the end of it.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-on-target-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    /// Runs the program as a user would.
    fn aeroshell(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(arguments).current_dir(&self.0).output().expect("the program starts")
    }

    fn summary(&self, run: &str) -> Summary {
        let path = self.0.join(run).join("summary.json");
        let text = fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}
