//! [`Scalar`]: what the model equations need of a number.

use core::fmt::Debug;
use core::ops::{Add, Div, Mul, Neg, Sub};

use super::fun;

/// A number the model equations run on: `f64` in the predictor and the divided-difference filters,
/// [`Dual`](super::Dual) where a filter needs the Jacobian of the same equations.
///
/// Operations with a plain `f64` on the right are part of the trait, so that constants cost no derivative work.
pub trait Scalar:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// The constant `value`.
    fn from_f64(value: f64) -> Self;
    /// The number without its derivatives.
    fn value(self) -> f64;
    /// Square root.
    #[must_use]
    fn sqrt(self) -> Self;
    /// Exponential.
    #[must_use]
    fn exp(self) -> Self;
    /// Natural logarithm.
    #[must_use]
    fn ln(self) -> Self;
    /// Sine of an angle in rad.
    #[must_use]
    fn sin(self) -> Self;
    /// Cosine of an angle in rad.
    #[must_use]
    fn cos(self) -> Self;
    /// Sine and cosine, in that order: what one function needs for its derivative is the other's value.
    #[must_use]
    fn sin_cos(self) -> (Self, Self) {
        (self.sin(), self.cos())
    }
    /// `1 / self`.
    #[must_use]
    fn recip(self) -> Self;
}

impl Scalar for f64 {
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn value(self) -> f64 {
        self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        fun::sqrt(self)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        fun::exp(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        fun::ln(self)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        fun::sin(self)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        fun::cos(self)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        fun::sin_cos(self)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
}
