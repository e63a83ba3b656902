//! The byte stream: packets, their parameters, and framing.

pub mod packet;
pub mod parameters;
