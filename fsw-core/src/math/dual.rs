//! [`Dual`]: a number with its derivatives with respect to `N` variables (forward differentiation).

use core::ops::{Add, Div, Mul, Neg, Sub};

use super::{Scalar, fun};

/// A value and its partial derivatives with respect to `N` independent variables.
///
/// Each operation applies the chain rule, so that a function written for [`Scalar`] returns its exact Jacobian
/// (to rounding) next to its value: no step size, no hand-typed derivative that can disagree with the function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Partial derivatives, one per independent variable.
    pub partials: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A constant: all derivatives zero.
    #[must_use]
    pub const fn constant(value: f64) -> Self {
        Self { value, partials: [0.0; N] }
    }

    /// Independent variable number `index`; a constant when `index` is not below `N`.
    #[must_use]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut dual = Self::constant(value);
        if let Some(partial) = dual.partials.get_mut(index) {
            *partial = 1.0;
        }
        dual
    }

    /// A whole state as independent variables: variable `i` is `values[i]`.
    #[must_use]
    pub fn variables(values: &[f64; N]) -> [Self; N] {
        let mut state = [Self::constant(0.0); N];
        for (i, (dual, &value)) in state.iter_mut().zip(values).enumerate() {
            *dual = Self::variable(value, i);
        }
        state
    }

    /// Chain rule of a function of one argument: its `value` here and its `slope` here.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        let partials = if N > FEW { apart::scaled(&self.partials, slope) } else { scaled(&self.partials, slope) };
        Self { value, partials }
    }

    /// Both partial vectors weighted: `a·∂x + b·∂y`.
    #[inline(always)]
    fn weighted(x: &Self, a: f64, y: &Self, b: f64) -> [f64; N] {
        let (x, y) = (&x.partials, &y.partials);
        if N > FEW { apart::weighted(x, a, y, b) } else { weighted(x, a, y, b) }
    }
}

/// Up to so many derivatives are worked on where they are needed. More are worked on by a function of their own: inlined
/// into every operation of a model, they would fill the flight computer's memory and save a tenth of the time.
const FEW: usize = 3;

#[inline(always)]
fn scaled<const N: usize>(x: &[f64; N], factor: f64) -> [f64; N] {
    let mut out = *x;
    out.iter_mut().for_each(|p| *p *= factor);
    out
}

#[inline(always)]
fn weighted<const N: usize>(x: &[f64; N], a: f64, y: &[f64; N], b: f64) -> [f64; N] {
    let mut out = [0.0; N];
    for (out, (p, q)) in out.iter_mut().zip(x.iter().zip(y)) {
        *out = a * p + b * q;
    }
    out
}

#[inline(always)]
fn sum<const N: usize>(x: &[f64; N], y: &[f64; N]) -> [f64; N] {
    let mut out = *x;
    out.iter_mut().zip(y).for_each(|(p, q)| *p += q);
    out
}

#[inline(always)]
fn difference<const N: usize>(x: &[f64; N], y: &[f64; N]) -> [f64; N] {
    let mut out = *x;
    out.iter_mut().zip(y).for_each(|(p, q)| *p -= q);
    out
}

/// The same, each once in the program.
mod apart {
    #[inline(never)]
    pub fn scaled<const N: usize>(x: &[f64; N], factor: f64) -> [f64; N] {
        super::scaled(x, factor)
    }

    #[inline(never)]
    pub fn weighted<const N: usize>(x: &[f64; N], a: f64, y: &[f64; N], b: f64) -> [f64; N] {
        super::weighted(x, a, y, b)
    }

    #[inline(never)]
    pub fn sum<const N: usize>(x: &[f64; N], y: &[f64; N]) -> [f64; N] {
        super::sum(x, y)
    }

    #[inline(never)]
    pub fn difference<const N: usize>(x: &[f64; N], y: &[f64; N]) -> [f64; N] {
        super::difference(x, y)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (x, y) = (&self.partials, &other.partials);
        Self { value: self.value + other.value, partials: if N > FEW { apart::sum(x, y) } else { sum(x, y) } }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (x, y) = (&self.partials, &other.partials);
        let partials = if N > FEW { apart::difference(x, y) } else { difference(x, y) };
        Self { value: self.value - other.value, partials }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self { value: self.value * other.value, partials: Self::weighted(&self, other.value, &other, self.value) }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value / other.value;
        Self { value, partials: Self::weighted(&self, inverse, &other, -value * inverse) }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, partials: self.partials.map(|p| -p) }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, constant: f64) -> Self {
        Self { value: self.value + constant, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, constant: f64) -> Self {
        Self { value: self.value - constant, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.chain(self.value * factor, factor)
    }
}

impl<const N: usize> Scalar for Dual<N> {
    fn from_f64(value: f64) -> Self {
        Self::constant(value)
    }
    fn value(self) -> f64 {
        self.value
    }
    /// At zero the slope is unbounded; the derivative is given as zero there, so that a vehicle at rest stays finite.
    fn sqrt(self) -> Self {
        let root = fun::sqrt(self.value);
        self.chain(root, if root > 0.0 { 0.5 / root } else { 0.0 })
    }
    fn exp(self) -> Self {
        let e = fun::exp(self.value);
        self.chain(e, e)
    }
    fn ln(self) -> Self {
        self.chain(fun::ln(self.value), 1.0 / self.value)
    }
    fn sin(self) -> Self {
        let (s, c) = fun::sin_cos(self.value);
        self.chain(s, c)
    }
    fn cos(self) -> Self {
        let (s, c) = fun::sin_cos(self.value);
        self.chain(c, -s)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = fun::sin_cos(self.value);
        (self.chain(s, c), self.chain(c, -s))
    }
    fn recip(self) -> Self {
        let inverse = 1.0 / self.value;
        self.chain(inverse, -inverse * inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Every operation of the trait, each result feeding the next.
    fn chain_of_all<S: Scalar>(x: S, y: S) -> [S; 8] {
        let product = x * y - x * 3.0 + 2.0;
        let quotient = (x - 1.5) / (y * y + 1.0);
        let root = (x * x + y * y + 0.5).sqrt();
        [
            product,
            quotient,
            root,
            (quotient - 1.0).exp(),
            root.ln() + y,
            product.sin() - 0.25,
            -(quotient * root).cos(),
            (root + 2.0).recip(),
        ]
    }

    proptest! {
        #[test]
        fn derivatives_agree_with_central_differences(x in -2.0..2.0f64, y in -2.0..2.0f64) {
            let [dx, dy] = Dual::variables(&[x, y]);
            let exact = chain_of_all(dx, dy);
            // Step h gives an error of h² in truncation and 1e-16/h in rounding: 1e-10 at best, times third derivatives up to ~1e3.
            let h = 1e-5;
            let (right, left) = (chain_of_all(x + h, y), chain_of_all(x - h, y));
            let (above, below) = (chain_of_all(x, y + h), chain_of_all(x, y - h));
            let plain = chain_of_all(x, y);
            for i in 0..8 {
                prop_assert_eq!(exact[i].value.to_bits(), plain[i].to_bits(), "value {}", i);
                let differences = [(right[i] - left[i]) / (2.0 * h), (above[i] - below[i]) / (2.0 * h)];
                for (partial, difference) in exact[i].partials.iter().zip(differences) {
                    prop_assert!((partial - difference).abs() < 1e-6 * (1.0 + partial.abs()), "{} {} {}", i, partial, difference);
                }
            }
        }
    }

    #[test]
    fn sine_and_cosine_together_are_sine_and_cosine_apart() {
        let x = Dual::<2>::variable(0.7, 1) * 3.0;
        assert_eq!(x.sin_cos(), (x.sin(), x.cos()));
        assert_eq!(Scalar::sin_cos(0.7_f64), (Scalar::sin(0.7_f64), Scalar::cos(0.7_f64)));
    }

    #[test]
    fn derivatives_are_those_of_the_closed_forms() {
        // d/dx exp(x²) = 2x exp(x²); d/dx ln(sin x) = cot x; d/dx x^½ = ½ x^-½; d/dx 1/x = −1/x².
        for x in [0.3_f64, 1.1, 2.5] {
            let d = Dual::<1>::variable(x, 0);
            let slope = |of: Dual<1>| of.partials[0];
            // Two or three roundings each.
            let close = |found: f64, exact: f64| (found / exact - 1.0).abs() < 1e-15 * 8.0;
            assert!(close(slope((d * d).exp()), 2.0 * x * (x * x).exp()));
            assert!(close(slope(d.sin().ln()), x.cos() / x.sin()));
            assert!(close(slope(d.sqrt()), 0.5 / x.sqrt()));
            assert!(close(slope(d.recip()), -1.0 / (x * x)));
        }
    }

    #[test]
    fn the_root_of_zero_has_a_finite_derivative() {
        let root = Dual::<1>::variable(0.0, 0).sqrt();
        assert_eq!((root.value, root.partials), (0.0, [0.0]));
    }

    #[test]
    fn a_variable_beyond_the_dimension_is_a_constant() {
        assert_eq!(Dual::<2>::variable(4.0, 2), Dual::constant(4.0));
    }
}
