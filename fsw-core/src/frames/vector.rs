//! [`Vec3`]: three components that carry their axes as a type.

use core::marker::PhantomData;
use core::ops::{Add, AddAssign, Mul, Neg, Sub};

use nalgebra::Vector3;

use super::Axes;
use crate::math::fun::sqrt;

/// A vector with components in the axes `F`. Adding vectors of different axes does not compile:
///
/// ```compile_fail
/// use fsw_core::frames::{Body, Inertial, Vec3};
/// let sum = Vec3::<Body>::new(1.0, 0.0, 0.0) + Vec3::<Inertial>::new(0.0, 1.0, 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<F> {
    components: Vector3<f64>,
    axes: PhantomData<F>,
}

impl<F: Axes> Vec3<F> {
    /// A vector from its components.
    #[must_use]
    pub const fn new(x: f64, y: f64, z: f64) -> Self {
        Self { components: Vector3::new(x, y, z), axes: PhantomData }
    }

    /// The zero vector.
    #[must_use]
    pub const fn zero() -> Self {
        Self::new(0.0, 0.0, 0.0)
    }

    /// A vector from an array of components.
    #[must_use]
    pub const fn from_array(c: [f64; 3]) -> Self {
        let [x, y, z] = c;
        Self::new(x, y, z)
    }

    /// Declares that bare components are in the axes `F`; the caller vouches for it.
    #[must_use]
    pub const fn from_components(components: Vector3<f64>) -> Self {
        Self { components, axes: PhantomData }
    }

    /// The bare components, for a kernel.
    #[must_use]
    pub const fn components(&self) -> &Vector3<f64> {
        &self.components
    }

    /// The components as an array.
    #[must_use]
    pub fn to_array(&self) -> [f64; 3] {
        [self.components.x, self.components.y, self.components.z]
    }

    /// First component.
    #[must_use]
    pub fn x(&self) -> f64 {
        self.components.x
    }

    /// Second component.
    #[must_use]
    pub fn y(&self) -> f64 {
        self.components.y
    }

    /// Third component.
    #[must_use]
    pub fn z(&self) -> f64 {
        self.components.z
    }

    /// Scalar product.
    #[must_use]
    pub fn dot(&self, other: &Self) -> f64 {
        let (a, b) = (&self.components, &other.components);
        a.x * b.x + a.y * b.y + a.z * b.z
    }

    /// Vector product.
    #[must_use]
    pub fn cross(&self, other: &Self) -> Self {
        let (a, b) = (&self.components, &other.components);
        Self::new(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
    }

    /// Length.
    #[must_use]
    pub fn norm(&self) -> f64 {
        sqrt(self.dot(self))
    }

    /// Unit vector, or `None` when the length is not above `1e-12`.
    #[must_use]
    pub fn unit(&self) -> Option<Self> {
        let n = self.norm();
        if n > 1e-12 && n.is_finite() { Some(*self * (1.0 / n)) } else { None }
    }

    /// True when every component is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.components.x.is_finite() && self.components.y.is_finite() && self.components.z.is_finite()
    }
}

impl<F: Axes> Default for Vec3<F> {
    fn default() -> Self {
        Self::zero()
    }
}

impl<F: Axes> Add for Vec3<F> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self::from_components(self.components + other.components)
    }
}

impl<F: Axes> AddAssign for Vec3<F> {
    fn add_assign(&mut self, other: Self) {
        self.components += other.components;
    }
}

impl<F: Axes> Sub for Vec3<F> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self::from_components(self.components - other.components)
    }
}

impl<F: Axes> Mul<f64> for Vec3<F> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self::from_components(self.components * factor)
    }
}

impl<F: Axes> Neg for Vec3<F> {
    type Output = Self;
    fn neg(self) -> Self {
        Self::from_components(-self.components)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Body;

    #[test]
    fn the_vector_product_is_right_handed() {
        let z = Vec3::<Body>::new(1.0, 0.0, 0.0).cross(&Vec3::new(0.0, 1.0, 0.0));
        assert_eq!(z, Vec3::new(0.0, 0.0, 1.0));
    }

    #[test]
    fn the_zero_vector_has_no_direction() {
        assert_eq!(Vec3::<Body>::zero().unit(), None);
        assert_eq!(Vec3::<Body>::new(f64::NAN, 0.0, 0.0).unit(), None);
    }
}
