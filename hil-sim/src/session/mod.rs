//! The ground's end of the link: what a flight computer is told, flown with, and how that can fail.

mod conductor;
mod error;
mod refusal;

pub use conductor::{Conductor, End, Phase, Plan, Plant, Status};
pub use error::SessionError;
