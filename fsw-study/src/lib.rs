//! Engines of the papers' experiments on navigation filters: settings, draws, filters over the kernels of
//! [`fsw_core::nav::estimators`], statistics. No files and no pages: `fsw-host` has those.
//!
//! What every study shares:
//! * [`settings`] a study's TOML: one sentence for what is wrong in it.
//! * [`runs`] runs on all threads, taken in their own order: sums do not depend on the number of threads.
//! * [`track`] what a filter did in one run, [`tally`] and in all of them: RMSE, NEES, divergences, definiteness.
//! * [`consistency`] normalised error and definiteness of a covariance.
//! * [`cost`] host time of a step. * [`bound`] posterior Cramér–Rao bound of any model and sensors.
//! * [`limit`] the bound over time, averaged over flights.
//! * [`inertial`] that of inertial navigation with every error of its sensors.
//! * [`counted`] every filter as its study flies it, for who counts instructions. * [`m7`] what was counted on a Cortex-M7.
//!
//! Studies: [`sekf`] P1's self-calibrating Kalman filter, [`ddf`] P2's divided-difference filters, [`mmae`] P3's multiple
//! models.
//!
//! Noise is [`hil_noise::Stream`]: one stream for each (seed, run, purpose).
//!
//! Without the feature `std` only settings, draws and filters are there: the very code, for a flight processor.
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

#[cfg(feature = "std")]
pub mod bound;
pub mod consistency;
#[cfg(feature = "std")]
pub mod cost;
pub mod counted;
pub mod ddf;
#[cfg(feature = "std")]
pub mod inertial;
#[cfg(feature = "std")]
pub mod limit;
#[cfg(feature = "std")]
pub mod m7;
pub mod mmae;
pub mod rate;
#[cfg(feature = "std")]
pub mod runs;
pub mod sekf;
#[cfg(feature = "std")]
pub mod settings;
#[cfg(feature = "std")]
pub mod tally;
pub mod track;
