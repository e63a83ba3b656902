//! Navigation: where the vehicle is, how it moves and how it is banked.
//!
//! * [`Estimate`] what it tells the rest. * [`strapdown`] integration of the inertial increments.
//! * [`filter`] the error-state filter around it: covariance, measurements, corrections.

#[allow(dead_code)] // until the navigator is wired
mod bridge;
#[allow(dead_code)] // until the navigator is wired
mod estimate;
pub mod filter;
pub mod strapdown;

pub use bridge::MAX_BRIDGED_FRAMES;
pub use estimate::Estimate;
