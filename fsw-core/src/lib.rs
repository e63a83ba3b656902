//! Entry flight software: everything that flies.
//!
//! Ground floor first; a module imports only from those above it in this list.
//!
//! * [`slot`] optional values that are zero bytes when there is none. * [`time`] integer microseconds since the entry epoch.
//! * [`probe`] where execution cost is read. * [`units`], [`planet`] constants.
//! * [`math`] elementary functions, comparisons, dual numbers, integrators, square-root tools, tables.
//! * [`frames`] typed vectors, rotations, spherical states. * [`model`] the onboard model of planet, air and vehicle.
//! * [`link`] packets and framing. * [`sensors`] validation and compensation. * [`nav`] strapdown and filter.
//! * [`control`] bank steering. * [`guidance`] predictor-corrector, lateral logic, heading alignment, parachute trigger.
//! * [`fault`] monitors and event log. * [`config`] the parameter tree.
//! * [`executive`] schedule, modes, `tick` and the byte-stream shell around it.
//!
//! No allocation, no panic, no clock, no randomness, no global state: all mutable state is one
//! `Executive` value, and `tick` is a pure function of it and of its inputs.
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::unreachable,
        clippy::todo,
        clippy::unimplemented
    )
)]

#[cfg(test)]
extern crate std;

pub mod config;
pub mod control;
pub mod executive;
pub mod fault;
pub mod frames;
pub mod guidance;
pub mod link;
pub mod math;
pub mod model;
pub mod nav;
pub mod planet;
pub mod probe;
pub mod sensors;
pub mod slot;
pub mod time;
pub mod units;
