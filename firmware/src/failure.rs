//! The end of a failed run: outputs safe, reason into the black box, reset. What the reason was is told after it.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use fsw_core::link::packet::{RestartReason, RestartReport};

use crate::blackbox;
use crate::board::Board;
use crate::boards::Present;

/// The last minor frame run, for the black box and the time stamps of the log.
static FRAME: AtomicU32 = AtomicU32::new(0);

/// Notes which minor frame was run last.
pub fn note_frame(frame: u32) {
    FRAME.store(frame, Ordering::Relaxed);
}

/// The minor frame noted last.
pub fn frame() -> u32 {
    FRAME.load(Ordering::Relaxed)
}

/// Ends this run. `address` is that of the instruction at fault, or of the access beyond the stack; 0 if unknown.
pub fn restart(reason: RestartReason, address: u32) -> ! {
    Present::make_safe();
    blackbox::store(RestartReport { reason, frame: frame(), address });
    Present::reset()
}

/// No message is formatted: that would bring the whole formatting machinery into an image that cannot panic.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    restart(RestartReason::Panic, 0)
}
