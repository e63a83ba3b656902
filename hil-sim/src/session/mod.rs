//! The ground's end of the link: what a flight computer is told, flown with, and how that can fail.

pub mod bench;
mod conductor;
mod error;
mod plan;
mod plant;
mod pump;
mod refusal;
mod remote;
#[cfg(test)]
mod scripted;
mod uplink;

pub use conductor::{Conductor, End, Phase, Status};
pub use error::SessionError;
pub use plan::Plan;
pub use plant::Plant;
pub use pump::{Pace, pump};
pub use remote::{RemoteTruth, TruthEnd};
pub use uplink::BYTES_PER_FRAME;
