//! Monitors that judge the health of a frame, and the log of typed events.

mod log;
mod monitor;

pub use log::{EventLog, FIRST_EVENTS, LAST_EVENTS, PENDING_EVENTS};
pub use monitor::{FrameReport, Monitor, Verdict};
