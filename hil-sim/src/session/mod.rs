//! The ground's end of the link: what a flight computer is told, flown with, and how that can fail.

pub mod bench;
mod conductor;
mod error;
mod pump;
mod refusal;
mod remote;
#[cfg(test)]
mod scripted;
mod uplink;

pub use conductor::{Conductor, End, Phase, Plan, Plant, Status};
pub use error::SessionError;
pub use pump::{Pace, pump};
pub use remote::{RemoteTruth, TruthEnd};
pub use uplink::BYTES_PER_FRAME;
