//! The elementary functions of the core: `libm` on every target, square root by the FPU. Bits never differ.

pub use fsw_sqrt::sqrt;
pub use libm::{
    acos, asin, atan, atan2, cbrt, cos, exp, expm1, fabs, floor, hypot, log as ln, log1p, pow, round, sin, tan,
};

/// Sine and cosine of `x` (rad), in that order.
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    (sin(x), cos(x))
}
