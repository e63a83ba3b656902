//! Guidance: from the navigation estimate to a commanded bank angle.

pub mod trigger;
