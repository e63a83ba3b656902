//! HardFault, to which every other fault escalates, and the non-maskable interrupt, which is the watchdog's first bite.

use core::arch::naked_asm;

use cortex_m::peripheral::{SCB, scb};
use fsw_core::link::packet::RestartReason;

use super::{FAILURE_STACK, STACK_BYTES};
use crate::failure;
use crate::stack::is_in_guard;

/// Fault status: pushing the exception frame failed.
const STACKING_FAILED: u32 = 1 << 4;
/// Fault status: the address register holds the address whose access was denied.
const ADDRESS_VALID: u32 = 1 << 7;
/// Bytes from the stack pointer to the interrupted address in the frame that the processor pushes.
const RETURN_ADDRESS: usize = 24;

/// Changes to the stack of its own, with the old stack pointer as argument.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "movw r1, #:lower16:({stack} + {bytes})",
        "movt r1, #:upper16:({stack} + {bytes})",
        "msr msp, r1",
        "b {handler}",
        stack = sym FAILURE_STACK,
        bytes = const STACK_BYTES,
        handler = sym handle,
    )
}

#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn NonMaskableInt() -> ! {
    naked_asm!("b {fault}", fault = sym HardFault)
}

extern "C" fn handle(stack_pointer: usize) -> ! {
    // SAFETY: the system control block of every Cortex-M.
    let control = unsafe { &*SCB::PTR };
    let status = control.cfsr.read();
    let denied = control.mmfar.read();
    let guard_hit = status & ADDRESS_VALID != 0 && is_in_guard(denied as usize);
    if status & STACKING_FAILED != 0 || guard_hit || is_in_guard(stack_pointer) {
        let address = if status & ADDRESS_VALID != 0 { denied } else { stack_pointer as u32 };
        failure::restart(RestartReason::StackOverflow, address);
    }
    // SAFETY: the processor pushed a whole frame there, or the case above would hold.
    let interrupted = unsafe { *((stack_pointer + RETURN_ADDRESS) as *const u32) };
    let reason = match SCB::vect_active() {
        scb::VectActive::Exception(scb::Exception::NonMaskableInt) => RestartReason::Watchdog,
        _ => RestartReason::ProcessorFault,
    };
    failure::restart(reason, interrupted)
}

/// Executes an instruction that the processor does not know.
pub fn unknown_instruction() {
    // SAFETY: it ends in the handler above.
    unsafe { core::arch::asm!("udf #0", options(noreturn)) }
}
