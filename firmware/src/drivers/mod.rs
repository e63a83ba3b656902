//! One peripheral a file. A driver knows its registers and nothing of the board: addresses and clocks are given to it.

mod register;
pub use register::Register;

mod lines;
pub use lines::{Bit, Lines};

pub mod clint;
pub mod cmsdk_uart;
pub mod cmsdk_watchdog;
pub mod fpga_counter;
pub mod ns16550;

#[cfg(all(target_os = "none", target_arch = "arm"))]
pub mod cycle_counter;
#[cfg(all(target_os = "none", target_arch = "arm"))]
pub mod mpu;
#[cfg(all(target_os = "none", target_arch = "arm"))]
pub mod systick;

#[cfg(all(target_os = "none", target_arch = "riscv64"))]
pub mod mcycle;
#[cfg(all(target_os = "none", target_arch = "riscv64"))]
pub mod minstret;
#[cfg(all(target_os = "none", target_arch = "riscv64"))]
pub mod pmp;
#[cfg(all(target_os = "none", target_arch = "riscv64"))]
pub mod semihosting_log;
