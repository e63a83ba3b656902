//! Ground floor of the numerics: one place for every transcendental function and comparison, and the tools built on them.
//!
//! * [`fun`] `libm` functions and the FPU square root; nothing else in the core calls a transcendental.
//! * [`num`] comparisons with a defined result for NaN and signed zeros.
//! * [`Scalar`] what model equations need of a number; [`Dual`] carries derivatives through the same equations.
//! * [`rk4`] one Runge–Kutta step. * [`Table`] clamped linear interpolation.
//! * [`sqrt_tools`] Cholesky, triangular solves and triangularization, in place. * [`factor`] a square root changed by one
//!   vector. * [`gate`] innovation gates.

mod dual;
pub mod factor;
pub mod fun;
pub mod gate;
pub mod num;
mod runge_kutta;
mod scalar;
pub mod sqrt_tools;
mod table;

pub use dual::Dual;
pub use runge_kutta::rk4;
pub use scalar::Scalar;
pub use table::{Table, TableError, TableRow};
