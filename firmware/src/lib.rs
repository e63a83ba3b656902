//! What all images share: one small board trait, drivers, black box, stack meter, log, and the road from a failure to a
//! restart that tells its reason.
//!
//! * [`board`] what a board must offer; `boards` the two that exist. Porting is one more file there, a memory map and
//!   the drivers it lacks: `doc/porting.md`.
//! * [`drivers`] one peripheral each, behind `embedded-hal` and `embedded-io`.
//! * `computer` boot and board loop of every image. * `trap`, `failure` where the processor goes when something fails.
//! * [`blackbox`] memory that outlives a reset. * [`stack`] paint and high-water mark. * [`patient`] waiting that feeds
//!   the watchdog.
//!
//! On a host only the parts without hardware are built, for their tests.
#![cfg_attr(not(test), no_std)]
#![deny(missing_docs, clippy::undocumented_unsafe_blocks, clippy::missing_safety_doc)]

pub mod blackbox;
pub mod board;
mod burning;
pub mod command_line;
pub mod drivers;
pub mod patient;
pub mod stack;

#[cfg(target_os = "none")]
pub mod boards;
#[cfg(target_os = "none")]
mod computer;
#[cfg(target_os = "none")]
pub mod doomed;
#[cfg(target_os = "none")]
pub mod failure;
#[cfg(target_os = "none")]
pub mod job;
#[cfg(target_os = "none")]
mod logger;
#[cfg(target_os = "none")]
pub mod trap;

pub use burning::Burning;
#[cfg(target_os = "none")]
pub use computer::{BoardMeter, Computer};
pub use patient::Patient;

#[cfg(all(target_os = "none", target_arch = "arm"))]
pub use cortex_m_rt::entry;
#[cfg(all(target_os = "none", target_arch = "riscv64"))]
pub use riscv_rt::entry;
