//! Images of the firmware: built, read, and held against the rules for what flies.

mod calls;
mod disassembly;
mod elf;
#[cfg(test)]
mod fixtures;
mod flow;
pub mod report;
mod riscv;
mod rules;
mod stack;
mod thumb;

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use xshell::{Shell, cmd};

pub use elf::Section;
pub use rules::{Rule, Violation};
pub use stack::Bound;

use crate::symbols::{llvm_tool, target_directory};

/// A processor that the firmware is built for.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// As commands call it.
    pub name: &'static str,
    pub triple: &'static str,
    /// Whether cycles can be estimated, not only instructions counted.
    pub has_cycle_model: bool,
}

/// Every one.
pub const TARGETS: [Target; 2] = [
    Target { name: "m7", triple: "thumbv7em-none-eabihf", has_cycle_model: true },
    Target { name: "rv64", triple: "riscv64gc-unknown-none-elf", has_cycle_model: false },
];

/// The image that flies.
const FLIGHT: &str = "flight";
/// It, the one that replays, and those that fail on purpose.
pub const IMAGES: [&str; 7] =
    [FLIGHT, "bench", "fail_panic", "fail_fault", "fail_stack", "fail_watchdog", "fail_overrun"];

/// What the firmware calls the stack of its handlers.
const HANDLER_STACK: &str = "::FAILURE_STACK";

/// All that is known of an image without running it.
#[derive(Debug)]
pub struct Inspection {
    pub sections: Vec<Section>,
    pub flash: u64,
    pub ram: u64,
    pub violations: Vec<Violation>,
    pub integer_helpers: Vec<String>,
    /// Missing when the image is recursive.
    pub stack: Option<Bound>,
    /// Bytes that the image sets aside for handlers that change to a stack of their own.
    pub handler_stack: Option<u64>,
}

impl Inspection {
    pub fn count(&self, rule: Rule) -> usize {
        self.violations.iter().filter(|violation| violation.rule == rule).count()
    }
}

/// Builds the flight image and inspects it.
pub fn inspect_flight(shell: &Shell, target: Target) -> Result<Inspection> {
    let frames = frames(shell, target)?;
    inspect(shell, &image_path(shell, target)?, &frames)
}

/// Inspects an image, given what the compiler said about the frames of its functions.
pub fn inspect(shell: &Shell, path: &Path, frames: &HashMap<String, u64>) -> Result<Inspection> {
    let image = elf::Image::read(path)?;
    let graph = calls::Graph::build(&image, &disassembly::disassemble(shell, image.machine, path)?);
    let violations = rules::violations(&image, &graph);
    let recursive = violations.iter().any(|violation| violation.rule == Rule::Recursion);
    Ok(Inspection {
        flash: image.flash(),
        ram: image.ram(),
        integer_helpers: rules::integer_helpers(&image, &graph),
        stack: if recursive { None } else { Some(stack::bound(&image, &graph, frames)?) },
        handler_stack: image.table_named(HANDLER_STACK).map(|table| table.end - table.start),
        violations,
        sections: image.sections,
    })
}

fn image_path(shell: &Shell, target: Target) -> Result<PathBuf> {
    Ok(target_directory(shell)?.join(target.triple).join("flight").join(FLIGHT))
}

/// The sizes of the functions' frames, from a build in which the compiler tells them; the image itself is left as the
/// plain build makes it, after a check that both are the same to the byte.
fn frames(shell: &Shell, target: Target) -> Result<HashMap<String, u64>> {
    let (triple, image) = (target.triple, image_path(shell, target)?);
    let cargo = ["--quiet", "--color", "never", "--profile", "flight", "--package", "firmware", "--bin", FLIGHT];
    // With LTO over the whole program only the last step lays out frames, so only it is run again. The note is part of
    // stable rustc; the `.stack_sizes` section with the same figures would need the switches of a nightly one.
    let telling = cmd!(shell, "cargo rustc {cargo...} --target {triple} -- -C remark=prologepilog").quiet();
    let output = telling.ignore_status().output()?;
    let notes = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "the image for {} does not build:\n{notes}", target.name);
    let told = loaded_bytes(shell, &image)?;
    cmd!(shell, "cargo build {cargo...} --target {triple}").quiet().run()?;
    ensure!(told == loaded_bytes(shell, &image)?, "the build that tells the frame sizes gives another image");
    let frames = stack::frames_in_notes(&notes);
    ensure!(!frames.is_empty(), "the compiler told no frame sizes for {}", target.name);
    Ok(frames)
}

/// What a programmer would write into the ROM.
fn loaded_bytes(shell: &Shell, image: &Path) -> Result<Vec<u8>> {
    let (objcopy, folder) = (llvm_tool(shell, "llvm-objcopy")?, shell.create_temp_dir()?);
    let out = folder.path().join("image.bin");
    cmd!(shell, "{objcopy} -O binary {image} {out}").quiet().run()?;
    std::fs::read(&out).with_context(|| out.display().to_string())
}
