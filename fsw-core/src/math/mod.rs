//! Ground floor of the numerics: one place for every transcendental function and comparison.
//!
//! * [`fun`] `libm` functions and the FPU square root; nothing else in the core calls a transcendental.
//! * [`num`] comparisons with a defined result for NaN and signed zeros.

pub mod fun;
pub mod num;
