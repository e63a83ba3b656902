//! P2's experiment: an entry through air that is denser than the filters believe, with more lift, flown by plain and by
//! desensitized divided-difference filters, by P2's adaptive one, and by what they have to be measured against: an EKF, the
//! same tuned, and one that estimates density and lift.

mod config;
mod draw;
mod filters;
#[cfg(feature = "std")]
pub mod limit;
#[cfg(feature = "std")]
mod outcome;
#[cfg(feature = "std")]
pub mod reference;
#[cfg(feature = "std")]
mod tune;

pub use config::{Config, Factors, STATES, Units};
pub use draw::{Draw, SENSED, Suite};
pub use filters::{Filter, Flight, Kind, Setup};
#[cfg(feature = "std")]
pub use limit::{Knowledge, Limit, limits};
#[cfg(feature = "std")]
pub use outcome::{Outcome, fly, fly_all, fly_steps};
#[cfg(feature = "std")]
pub use tune::{Tuned, search};
