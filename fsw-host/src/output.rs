//! Standard output: whole texts, and a reader that went away is no error.

use std::io::{self, Write};

use serde::Serialize;

use crate::error::HostError;

/// Prints a text as it is.
///
/// # Errors
/// Standard output cannot be written.
pub fn print(text: &str) -> Result<(), HostError> {
    written(io::stdout().lock().write_all(text.as_bytes()))
}

/// Prints a value as indented JSON.
///
/// # Errors
/// Standard output cannot be written.
pub fn print_json(value: &impl Serialize) -> Result<(), HostError> {
    print(&json_text(value).map_err(HostError::file("write", "standard output"))?)
}

/// A value as indented JSON, with a line feed behind it. All JSON passes through here: for each writer of its own, what serde
/// makes of every type would be compiled again.
///
/// # Errors
/// The value refuses.
pub fn json_text(value: &impl Serialize) -> io::Result<String> {
    let mut text = serde_json::to_string_pretty(value)?;
    text.push('\n');
    Ok(text)
}

/// Judges the outcome of writing to standard output.
///
/// # Errors
/// It cannot be written, and not because its reader has seen enough, as `head` does.
pub fn written(outcome: io::Result<()>) -> Result<(), HostError> {
    match outcome {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(HostError::file("write", "standard output")(e)),
        _ => Ok(()),
    }
}
