//! The elementary functions of the core: `libm` on every target, square root by the FPU. Bits never differ.

pub use fsw_sqrt::sqrt;
pub use libm::{
    acos, asin, atan, atan2, cbrt, cos, exp, expm1, fabs, floor, hypot, log as ln, log1p, pow, round, sin, tan,
};

/// Sine and cosine of `x` (rad), in that order: the bits of [`sin`] and [`cos`], with one reduction of the argument.
#[must_use]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_together_are_the_bits_of_each() {
        // All magnitudes, both signs, by a low-discrepancy walk through exponents and mantissas.
        let golden = 0x9E37_79B9_7F4A_7C15_u64;
        for k in 0..1_000_000_u64 {
            let walk = k.wrapping_mul(golden);
            let exponent = 1023 - 60 + walk % 90;
            let x = f64::from_bits((walk >> 63) << 63 | exponent << 52 | (walk.wrapping_mul(golden) >> 12));
            let (s, c) = sin_cos(x);
            assert_eq!((s.to_bits(), c.to_bits()), (sin(x).to_bits(), cos(x).to_bits()), "{x:e}");
        }
        for x in [0.0, -0.0, f64::MIN_POSITIVE, core::f64::consts::PI, f64::MAX, f64::INFINITY, f64::NAN] {
            let (s, c) = sin_cos(x);
            assert!(s.to_bits() == sin(x).to_bits() || s.is_nan() && sin(x).is_nan(), "{x}");
            assert!(c.to_bits() == cos(x).to_bits() || c.is_nan() && cos(x).is_nan(), "{x}");
        }
    }
}
