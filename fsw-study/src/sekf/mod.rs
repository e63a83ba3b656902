//! P1's experiment. A vehicle with an unknown input in its equations, estimated by an EKF that ignores it, by P1's
//! self-calibrating filter (SEKF), and by what else the linearised kernel can be: untuned as P1 flies them, and each tuned by
//! the same search.
//!
//! [`cases::fly`] flies a case; [`tune::search`] finds the tuned settings; [`mod@reference`] holds the figures to set beside.

#[cfg(feature = "std")]
pub mod cases;
#[cfg(feature = "std")]
mod check;
pub mod config;
pub mod draw;
pub mod filters;
pub mod kind;
#[cfg(feature = "std")]
pub mod limit;
mod printed;
#[cfg(feature = "std")]
pub mod reference;
pub mod table1;
#[cfg(feature = "std")]
pub mod tune;
#[cfg(feature = "std")]
pub mod tuned;

/// Components of P1's state x = [r, v, γ, θ, λ, ψ]: m, m/s, rad.
pub const STATES: usize = 6;
