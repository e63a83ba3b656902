//! The program that runs on the target: built from the workspace that this program was built from, or given as a file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde::Deserialize;
use sha2::{Digest, Sha256};

use super::{Target, TargetError};

/// The profile of everything that flies.
const PROFILE: &str = "flight";

/// A linked program for a target.
#[derive(Clone, Debug)]
pub struct Image {
    /// The file.
    pub path: PathBuf,
    /// SHA-256 of what it puts into memory, hexadecimal. The same sources give the same, wherever they lie.
    pub sha256: String,
    /// The file's content.
    pub elf: Vec<u8>,
}

impl Image {
    /// Builds the binary `image` of the package `firmware`; quick when nothing has changed.
    ///
    /// # Errors
    /// No sources, no compiler, or the compiler's own words.
    pub fn build(target: Target, image: &str) -> Result<Self, TargetError> {
        let workspace = workspace()?;
        let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .current_dir(&workspace)
            .args(["build", "--package", "firmware", "--bin", image, "--profile", PROFILE])
            .args(["--target", target.triple(), "--message-format", "json-render-diagnostics"])
            .stdin(Stdio::null())
            .output()
            .map_err(TargetError::NoCargo)?;
        if !output.status.success() {
            return Err(build_failure(target, image, &output));
        }
        let path = executable(&output.stdout, image).ok_or_else(|| TargetError::Build {
            image: image.into(),
            triple: target.triple(),
            said: "it built, but named no executable".into(),
        })?;
        Self::open(target, &path)
    }

    /// Takes an image from a file.
    ///
    /// # Errors
    /// It cannot be read, or is none for the target.
    pub fn open(target: Target, path: &Path) -> Result<Self, TargetError> {
        let elf = fs::read(path).map_err(|source| TargetError::ImageFile { path: path.to_owned(), source })?;
        let header = Header::of(&elf).and_then(|header| header.is_for(target).map(|()| header));
        let header = header.map_err(|reason| TargetError::WrongImage {
            path: path.to_owned(),
            target: target.title(),
            reason,
        })?;
        let sha256 = header.hash_of_memory(&elf);
        Ok(Self { path: path.to_owned(), sha256, elf })
    }
}

/// The workspace that this program was built from, if it still has a firmware.
///
/// # Errors
/// The sources are not where they were.
pub fn workspace() -> Result<PathBuf, TargetError> {
    let ours = Path::new(env!("CARGO_MANIFEST_DIR"));
    let workspace = ours.parent().unwrap_or(ours).to_owned();
    if workspace.join("firmware/Cargo.toml").is_file() { Ok(workspace) } else { Err(TargetError::NoSources(workspace)) }
}

fn build_failure(target: Target, image: &str, output: &Output) -> TargetError {
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    let triple = target.triple();
    // The library of the target is what no crate can be compiled without.
    if said.contains("can't find crate for `core`") {
        return TargetError::NoCompilerTarget { triple };
    }
    TargetError::Build { image: image.into(), triple, said }
}

/// The executable that cargo's messages name for a binary.
fn executable(messages: &[u8], image: &str) -> Option<PathBuf> {
    #[derive(Deserialize)]
    struct Message {
        target: Option<Built>,
        executable: Option<PathBuf>,
    }
    #[derive(Deserialize)]
    struct Built {
        name: String,
    }
    let messages =
        messages.split(|byte| *byte == b'\n').filter_map(|line| serde_json::from_slice::<Message>(line).ok());
    messages.filter(|m| m.target.as_ref().is_some_and(|t| t.name == image)).find_map(|m| m.executable)
}

/// What of an ELF header is needed here; both targets are little-endian.
struct Header {
    machine: u16,
    wide: bool,
    segments_at: usize,
    segment_size: usize,
    segments: usize,
}

/// ELF numbers of the machines.
const EM_ARM: u16 = 40;
const EM_RISCV: u16 = 243;
/// A segment that is loaded.
const PT_LOAD: u64 = 1;

impl Header {
    fn of(elf: &[u8]) -> Result<Self, String> {
        let known = elf.starts_with(b"\x7fELF") && matches!(elf.get(4), Some(1 | 2)) && elf.get(5) == Some(&1);
        let wide = elf.get(4) == Some(&2);
        let at = |narrow: usize, broad: usize, size: usize| field(elf, if wide { broad } else { narrow }, size);
        let header = || {
            Some(Self {
                machine: u16::try_from(at(18, 18, 2)?).ok()?,
                wide,
                segments_at: usize::try_from(at(28, 32, if wide { 8 } else { 4 })?).ok()?,
                segment_size: usize::try_from(at(42, 54, 2)?).ok()?,
                segments: usize::try_from(at(44, 56, 2)?).ok()?,
            })
        };
        header().filter(|_| known).ok_or_else(|| "it is not a little-endian ELF file".to_owned())
    }

    fn is_for(&self, target: Target) -> Result<(), String> {
        let (machine, wide) = match target {
            Target::M7 => (EM_ARM, false),
            Target::Rv64 => (EM_RISCV, true),
        };
        if (self.machine, self.wide) == (machine, wide) {
            return Ok(());
        }
        let name = match self.machine {
            EM_ARM => "Arm".to_owned(),
            EM_RISCV => "RISC-V".to_owned(),
            other => format!("machine {other}"),
        };
        Err(format!("it is a {} bit program for {name}", if self.wide { 64 } else { 32 }))
    }

    /// Hash over address and content of every loaded segment.
    fn hash_of_memory(&self, elf: &[u8]) -> String {
        let mut hash = Sha256::new();
        let size = if self.wide { 8 } else { 4 };
        for number in 0..self.segments {
            let at = self.segments_at + number * self.segment_size;
            let part = |narrow: usize, broad: usize| field(elf, at + if self.wide { broad } else { narrow }, size);
            let (Some(kind), Some(offset), Some(address), Some(length)) =
                (field(elf, at, 4), part(4, 8), part(12, 24), part(16, 32))
            else {
                continue;
            };
            let content = usize::try_from(offset).ok().zip(usize::try_from(offset.saturating_add(length)).ok());
            if let (PT_LOAD, Some(content)) = (kind, content.and_then(|(from, to)| elf.get(from..to))) {
                hash.update(address.to_le_bytes());
                hash.update(content);
            }
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// A little-endian number of an ELF file.
fn field(elf: &[u8], at: usize, size: usize) -> Option<u64> {
    let bytes = elf.get(at..at.checked_add(size)?)?;
    Some(bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 32 bit Arm program of one segment with two bytes, and `rest` behind it that is not loaded.
    fn program(content: [u8; 2], rest: &[u8]) -> Vec<u8> {
        let mut elf = vec![0u8; 52 + 32];
        elf[..6].copy_from_slice(b"\x7fELF\x01\x01");
        elf[18] = EM_ARM as u8;
        (elf[28], elf[42], elf[44]) = (52, 32, 1);
        (elf[52], elf[56], elf[64], elf[68]) = (1, 84, 0x10, 2);
        elf.extend(content);
        elf.extend(rest);
        elf
    }

    fn opened(name: &str, elf: &[u8], target: Target) -> Result<Image, TargetError> {
        let path = std::env::temp_dir().join(format!("aeroshell-image-{name}-{}", std::process::id()));
        fs::write(&path, elf).unwrap();
        let image = Image::open(target, &path);
        fs::remove_file(&path).unwrap();
        image
    }

    #[test]
    fn the_hash_of_an_image_is_that_of_its_memory() {
        let hash = |elf: &[u8]| opened("hash", elf, Target::M7).unwrap().sha256;
        let plain = hash(&program([1, 2], b""));
        assert_eq!(plain, hash(&program([1, 2], b"debug information with a path")));
        assert_ne!(plain, hash(&program([1, 3], b"")));
        assert_eq!(plain.len(), 64);
    }

    #[test]
    fn what_is_no_image_for_the_target_is_refused_by_name() {
        let refused = |elf: &[u8], target| opened("refused", elf, target).unwrap_err().to_string();
        let arm = program([1, 2], b"");
        assert!(refused(&arm, Target::Rv64).contains("it is a 32 bit program for Arm"));
        assert!(refused(b"#!/bin/sh", Target::M7).contains("it is not a little-endian ELF file"));
        assert!(refused(&arm[..30], Target::M7).contains("not a little-endian ELF"));
        let none = Image::open(Target::M7, Path::new("/nonexistent/image")).unwrap_err().to_string();
        assert!(none.starts_with("the image /nonexistent/image cannot be read"), "{none}");
    }

    #[test]
    fn a_program_with_a_broken_segment_table_is_hashed_without_it() {
        let mut elf = program([1, 2], b"");
        (elf[28], elf[29]) = (0xff, 0xff);
        opened("broken", &elf, Target::M7).unwrap();
    }

    #[test]
    fn the_executable_is_the_one_of_the_binary_asked_for() {
        let messages =
            b"{\"reason\":\"compiler-artifact\",\"target\":{\"name\":\"flight\"},\"executable\":\"/a/flight\"}\n\
            {\"reason\":\"compiler-artifact\",\"target\":{\"name\":\"bench\"},\"executable\":\"/a/bench\"}\n\
            {\"reason\":\"build-finished\",\"success\":true}\n";
        assert_eq!(executable(messages, "bench"), Some(PathBuf::from("/a/bench")));
        assert_eq!(executable(messages, "fly"), None);
    }
}
