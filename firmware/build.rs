//! Gives the linker the memory map of the board and the scripts of the runtime; does nothing on a host.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=memory");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let map = match env::var("CARGO_CFG_TARGET_ARCH").as_deref() {
        Ok("arm") => "memory/mps2-an500.x",
        Ok("riscv64") => "memory/virt-rv64.x",
        other => panic!("firmware: no board for the architecture {other:?}"),
    };
    let out = PathBuf::from(env::var("OUT_DIR").expect("cargo names the output directory"));
    fs::copy(map, out.join("memory.x")).unwrap_or_else(|error| panic!("firmware: {map}: {error}"));
    println!("cargo:rustc-link-search={}", out.display());
    // The defaults of link.x, then the table of log strings.
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    // Sections start where the memory map says, not at the next page of a host.
    println!("cargo:rustc-link-arg-bins=--nmagic");
}
