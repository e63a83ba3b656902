//! Truth simulator of a Mars entry: scenarios, the vehicle's true motion and sensors, and the ground's end of the link.
//!
//! Shares with the flight software only constants, frames, time and packets, never its equations.

pub mod scenario;
