//! Truth simulator of a Mars entry: scenarios, the vehicle's true motion and sensors, and the ground's end of the link.
//!
//! Written independently of the flight software: its own Cartesian inertial equations of motion, its own atmosphere,
//! aerodynamics and orbits. It shares with `fsw-core` constants, frames, time and the packets of the link, nothing else.
//!
//! * [`atmosphere`], [`wind`], [`aero`] the world around the vehicle. * [`dynamics`] its motion; [`propagate`] open-loop
//!   flights with located stops. * [`actuator`], [`attitude`] bank and trim. * [`sensors`], [`orbiter`] measurements.
//! * [`noise`] seeded streams of random numbers. * [`case`](mod@case) one fully determined flight; [`dispersion`] draws it.
//! * [`truth`] the simulator, frame by frame. * [`scenario`] the files that describe a flight.
//! * [`session`] the ground's end of the link. * [`transport`] TCP, pseudo-terminals and serial lines.
#![forbid(unsafe_code)]

pub mod actuator;
pub mod aero;
pub mod angle;
pub mod atmosphere;
pub mod attitude;
pub mod case;
pub mod dispersion;
pub mod dynamics;
pub mod orbiter;
pub mod propagate;
pub mod reach;
pub mod readback;
pub mod scenario;
pub mod sensors;
pub mod session;
pub mod transport;
pub mod truth;
pub mod wind;

pub use hil_noise as noise;
