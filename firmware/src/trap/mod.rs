//! Where the processor goes when something fails: on a stack of its own, because the other one may be what failed.

use core::cell::UnsafeCell;

#[cfg(target_arch = "arm")]
mod cortex_m;
#[cfg(target_arch = "arm")]
pub use cortex_m::unknown_instruction;
#[cfg(target_arch = "riscv64")]
mod riscv;
#[cfg(target_arch = "riscv64")]
pub use riscv::unknown_instruction;

/// Bytes of the stack on which a failure is handled.
const STACK_BYTES: usize = 512;

#[repr(C, align(16))]
struct FailureStack(UnsafeCell<[u8; STACK_BYTES]>);

// SAFETY: used by the handler alone, which never returns and is entered once between two resets.
unsafe impl Sync for FailureStack {}

static FAILURE_STACK: FailureStack = FailureStack(UnsafeCell::new([0; STACK_BYTES]));
