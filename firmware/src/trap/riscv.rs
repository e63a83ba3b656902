//! Every trap of the hart: exceptions, and the timer interrupt, which is the watchdog's bite.

use core::arch::global_asm;

use fsw_core::link::packet::RestartReason;

use super::{FAILURE_STACK, STACK_BYTES};
use crate::failure;
use crate::stack::is_in_guard;

/// Cause: interrupt of the machine timer.
const TIMER: usize = 1 << (usize::BITS - 1) | 7;
/// Cause: load access fault.
const LOAD_FAULT: usize = 5;
/// Cause: store access fault.
const STORE_FAULT: usize = 7;

// Changes to the stack of its own; nothing is saved, because nothing is returned to. Takes the place of the runtime's
// trap entry, which would push registers on the failed stack.
global_asm!(
    ".section .trap.start, \"ax\"",
    ".balign 4",
    ".global _start_trap",
    "_start_trap:",
    "la sp, {stack} + {bytes}",
    "csrr a0, mcause",
    "csrr a1, mepc",
    "csrr a2, mtval",
    "j {handler}",
    stack = sym FAILURE_STACK,
    bytes = const STACK_BYTES,
    handler = sym handle,
);

// The first instructions of the hart, at the beginning of its RAM: over to the flash.
global_asm!(".section .start, \"ax\"", ".global _hart_start", "_hart_start:", "la t0, _start", "jr t0");

extern "C" fn handle(cause: usize, interrupted: usize, value: usize) -> ! {
    if matches!(cause, LOAD_FAULT | STORE_FAULT) && is_in_guard(value) {
        failure::restart(RestartReason::StackOverflow, value as u32);
    }
    let reason = if cause == TIMER { RestartReason::Watchdog } else { RestartReason::ProcessorFault };
    failure::restart(reason, interrupted as u32)
}

/// Executes an instruction that the processor does not know.
pub fn unknown_instruction() {
    // SAFETY: it ends in the handler above.
    unsafe { core::arch::asm!("unimp", options(noreturn)) }
}
