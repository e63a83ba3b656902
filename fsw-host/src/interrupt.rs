//! Ctrl-C during long work: the first asks for an end in good order, the second ends the program.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::HostError;

/// Set by the first Ctrl-C.
static ASKED: AtomicBool = AtomicBool::new(false);
/// One handler serves all work of a process.
static CAUGHT: AtomicBool = AtomicBool::new(false);

/// Whether an end was asked for; who went on regardless may take it back.
#[must_use]
pub fn asked() -> &'static AtomicBool {
    &ASKED
}

/// From here on Ctrl-C asks instead of killing.
///
/// # Errors
/// The system refuses a handler.
pub fn catch() -> Result<(), HostError> {
    if CAUGHT.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    ctrlc::set_handler(|| {
        if ASKED.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })
    .map_err(|e| HostError::Option(format!("Ctrl-C cannot be caught: {e}")))
}
