//! Command line of the host harness.
fn main() {}
