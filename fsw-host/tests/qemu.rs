//! Processor in the loop as a user meets it when something is missing or broken. What needs an emulator or an image is
//! flown by the gates, which install and build them; here stand-ins take their place.
#![cfg(target_os = "linux")]

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::{Command, Output};

struct Scratch(PathBuf);

impl Scratch {
    /// A folder with an image that no emulator is needed to tell from others.
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-qemu-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(path.join("bin")).expect("a scratch folder can be made");
        let mut elf = vec![0u8; 52];
        elf[..6].copy_from_slice(b"\x7fELF\x01\x01");
        elf[18] = 40;
        fs::write(path.join("image"), elf).expect("it can be written");
        Self(path)
    }

    /// A program that stands in for the emulator of the Cortex-M7.
    fn emulator(&self, script: &str) {
        let program = self.0.join("bin/qemu-system-arm");
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).expect("it can be written");
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("it can be made a program");
    }

    /// Flies with nothing but the programs of the folder to be found.
    fn fly(&self, arguments: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.arg("fly").args(arguments).current_dir(&self.0).env("PATH", self.0.join("bin"));
        let Output { status, stderr, .. } = command.output().expect("the program starts");
        (status.code(), String::from_utf8_lossy(&stderr).into_owned())
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_missing_emulator_is_named_with_the_command_that_installs_it() {
    let scratch = Scratch::new("missing");
    let (code, said) = scratch.fly(&["--computer", "qemu:m7", "--image", "image"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("qemu-system-arm is not installed: `sudo apt-get install qemu-system-arm`"), "{said}");
    assert!(!scratch.0.join("runs").exists());
}

#[test]
fn an_emulator_that_ends_at_once_is_quoted_and_the_run_folder_says_so() {
    let scratch = Scratch::new("ended");
    scratch.emulator("echo 'qemu: no such machine' >&2; exit 3");
    let (code, said) = scratch.fly(&["--computer", "qemu:m7", "--image", "image", "--out", "run"]);
    assert_eq!(code, Some(1), "{said}");
    let sentence = "the flight computer qemu:m7 is lost: qemu: no such machine (exit status: 3)";
    assert!(said.contains(sentence), "{said}");
    let summary = fs::read_to_string(scratch.0.join("run/summary.json")).expect("a summary is written");
    assert!(summary.contains(sentence) && summary.contains("\"place\": \"qemu:m7\""), "{summary}");
    assert!(scratch.0.join("run/board.log").exists());
}

#[test]
fn what_is_no_image_is_refused_by_name() {
    let scratch = Scratch::new("images");
    for (arguments, words) in [
        (
            ["--computer", "qemu:rv64", "--image", "image"],
            "the image image is no program for RISC-V 64: it is a 32 bit",
        ),
        (["--computer", "qemu:m7", "--image", "none"], "the image none cannot be read"),
        (["--computer", "in-process", "--image", "image"], "in-process takes no image"),
    ] {
        let (code, said) = scratch.fly(&arguments);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(words), "{said}");
    }
    assert!(!scratch.0.join("runs").exists());
}

#[test]
fn without_cargo_an_image_is_asked_for() {
    let scratch = Scratch::new("cargo");
    let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
    command.args(["fly", "--computer", "qemu:m7"]).current_dir(&scratch.0).env("PATH", "").env_remove("CARGO");
    let refused = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains("--image"), "{said}");
}

#[test]
fn real_time_scheduling_is_for_flights_in_real_time() {
    let scratch = Scratch::new("rt");
    let (code, said) = scratch.fly(&["--rt"]);
    assert_eq!(code, Some(2), "{said}");
    assert!(said.contains("--realtime"), "{said}");
}
