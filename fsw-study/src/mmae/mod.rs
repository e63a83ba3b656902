//! P3's experiment (Deng, Gao, Cui 2017, doi 10.15982/j.issn.2095-7777.2017.06.006): multiple models against errors of the
//! density, and what surpasses them.
//!
//! * [`config`] what is flown, from TOML. * [`truth`] one entry and its readings, by equations of its own.
//! * [`filters`] the filters as settings of the core's kernels. * [`run`] all of them over one entry. * [`case`] over many.
//! * [`roster`] each filter by its label. * [`bars`] what is asked of the figures.

mod banks;
#[cfg(feature = "std")]
pub mod bars;
#[cfg(feature = "std")]
pub mod case;
pub mod config;
pub mod filters;
#[cfg(feature = "std")]
pub mod limit;
pub mod roster;
pub mod run;
#[cfg(feature = "std")]
mod study;
#[cfg(feature = "std")]
mod sums;
#[cfg(feature = "std")]
mod timing;
pub mod truth;

#[cfg(feature = "std")]
pub use study::{Study, TIMED_FLIGHTS, cases};

/// Steps of a flight whose cost is measured: a step costs the same at any time.
pub const COST_STEPS: usize = 200;
