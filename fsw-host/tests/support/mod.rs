//! What tests of the program have in common: a folder of its own for each, the program run in it, and its refusals.
#![allow(dead_code, reason = "every test takes of it what it needs")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for one test, removed at the end of it.
pub struct Scratch {
    /// Where it is.
    pub path: PathBuf,
    command: &'static [&'static str],
}

impl Scratch {
    /// For a test of a command of the program, such as `["study", "ddf"]`.
    pub fn new(command: &'static [&'static str], name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-{}-{name}-{}", command.join("-"), std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self { path, command }
    }

    /// Runs the command in it.
    pub fn run(&self, arguments: &[&str]) -> Output {
        let mut program = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        program.args(self.command).args(arguments).current_dir(&self.path).output().expect("the program starts")
    }

    /// Writes `my.toml`.
    pub fn config(&self, text: &str) {
        fs::write(self.path.join("my.toml"), text).expect("a file can be written");
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.path);
    }
}

/// Content of a file.
pub fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// What the program complained of.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Exit code 2 and these words, without a panic.
#[track_caller]
pub fn assert_refused(output: &Output, words: &[&str]) {
    let said = stderr(output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    for word in words {
        assert!(said.contains(word), "{word:?} is missing in: {said}");
    }
}

/// The same in a single line.
#[track_caller]
pub fn assert_refused_in_a_line(output: &Output, words: &[&str]) {
    assert_refused(output, words);
    let said = stderr(output);
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
}
