//! Navigation: where the vehicle is, how it moves and how it is banked.
//!
//! * [`Navigator`] the entry point: one `step` per minor frame in any navigation mode.
//! * [`Estimate`] what it tells the rest. * [`strapdown`] integration of the inertial increments.
//! * [`filter`] the error-state filter around it: covariance, measurements, corrections.
//! * [`estimators`] the filters of the papers and those that surpass them, each one kernel over models.
//! * [`modelled`] those filters in flight, over the onboard model.

mod bridge;
mod estimate;
pub mod estimators;
pub mod filter;
pub mod modelled;
mod navigator;
pub mod strapdown;

pub use bridge::{BridgeNoise, MAX_BRIDGED_FRAMES, RECOVERY_FRAMES};
pub use estimate::Estimate;
pub use navigator::{
    MAX_ATTITUDE_SIGMA_RAD, MAX_POSITION_SIGMA_M, MAX_VELOCITY_SIGMA_MPS, NavContext, NavCounters, Navigator,
};
