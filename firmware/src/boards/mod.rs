//! The boards, one file each; [`Present`] is the one this image is for.

#[cfg(target_arch = "arm")]
mod mps2_an500;
#[cfg(target_arch = "arm")]
pub use mps2_an500::Mps2An500 as Present;

#[cfg(target_arch = "riscv64")]
mod virt_rv64;
#[cfg(target_arch = "riscv64")]
pub use virt_rv64::VirtRv64 as Present;
