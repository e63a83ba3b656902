//! The executive: schedule, modes, one-screen [`Executive::tick`], and the byte-stream shell around it.
//!
//! * [`schedule`] `const` table of slots, rates, offsets and budgets. * [`modes`] transition table.
//! * [`Executive`] all mutable state of the flight software; a snapshot is a copy.
//! * [`FlightComputer`] decodes bytes, answers commands, ticks once per minor frame, encodes what goes down.
//! * [`Board`] the flight computer on its hardware: byte stream by `embedded-io`, discretes by `embedded-hal`.

mod board;
mod computer;
mod cost;
pub mod modes;
pub mod schedule;
mod tick;

pub use board::{Board, BoardError, Clock, Room};
pub use computer::{FlightComputer, MAX_BRIDGED_FRAMES};
pub use cost::{CostLedger, WHOLE_FRAME};
pub use tick::{Executive, Outputs};
