//! The flight computer as a processor of its own: emulated in QEMU, or a board on a serial line.
//!
//! [`Image`] is what runs there, [`Qemu`] the emulator that runs it, [`RemoteComputer`] the end of the link in this
//! process, [`BoardLog`] what the board says about itself beside the link, [`mod@bench`] a board that works off files.

pub mod bench;
mod board_log;
mod computer;
mod error;
pub mod image;
mod qemu;
mod remote;

use std::fmt;
use std::str::FromStr;

pub use board_log::{BoardLog, LogStream, Show};
pub use computer::{Opening, Remote};
pub use error::TargetError;
pub use image::Image;
pub use qemu::Qemu;
pub use remote::RemoteComputer;

/// A processor for which images are built and which QEMU emulates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// Cortex-M7 with double-precision FPU, board `mps2-an500`.
    M7,
    /// RISC-V `riscv64gc`, board `virt`.
    Rv64,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::M7, Self::Rv64];

    /// Its name on the command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::M7 => "m7",
            Self::Rv64 => "rv64",
        }
    }

    /// Its name for people.
    #[must_use]
    pub const fn title(self) -> &'static str {
        match self {
            Self::M7 => "Cortex-M7",
            Self::Rv64 => "RISC-V 64",
        }
    }

    /// What the compiler calls it.
    #[must_use]
    pub const fn triple(self) -> &'static str {
        match self {
            Self::M7 => "thumbv7em-none-eabihf",
            Self::Rv64 => "riscv64gc-unknown-none-elf",
        }
    }

    /// The program that emulates it.
    #[must_use]
    pub const fn emulator(self) -> &'static str {
        match self {
            Self::M7 => "qemu-system-arm",
            Self::Rv64 => "qemu-system-riscv64",
        }
    }

    /// The Debian package that has the emulator.
    #[must_use]
    pub const fn debian_package(self) -> &'static str {
        match self {
            Self::M7 => "qemu-system-arm",
            Self::Rv64 => "qemu-system-misc",
        }
    }

    /// The machine, as arguments of the emulator: one instruction is one nanosecond of its clock, so that its
    /// instruction counters are exact.
    #[must_use]
    pub const fn machine(self) -> &'static [&'static str] {
        match self {
            Self::M7 => &["-M", "mps2-an500", "-icount", "shift=0"],
            Self::Rv64 => &["-M", "virt", "-bios", "none", "-icount", "shift=0"],
        }
    }
}

impl FromStr for Target {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|target| target.name() == text).ok_or_else(|| "expected m7 or rv64".to_owned())
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
