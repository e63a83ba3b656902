//! [`Rot`]: a rotation that maps components in the axes `A` to components in the axes `B`.

use core::marker::PhantomData;

use nalgebra::Matrix3;

use super::{Axes, Vec3};
use crate::math::fun::{atan2, sin_cos, sqrt};
use crate::math::num::abs;

/// Rotation from the axes `A` to the axes `B`, a unit quaternion `(w, x, y, z)`, Hamilton convention.
///
/// Applying it to a vector of other axes does not compile, nor does chaining rotations that do not meet:
///
/// ```compile_fail
/// use fsw_core::frames::{Body, Inertial, Rot, Vec3};
/// let attitude_bi = Rot::<Body, Inertial>::identity();
/// let wrong = attitude_bi.apply(&Vec3::<Inertial>::new(1.0, 0.0, 0.0));
/// ```
///
/// ```compile_fail
/// use fsw_core::frames::{Body, Inertial, PlanetFixed, Rot};
/// let attitude_bi = Rot::<Body, Inertial>::identity();
/// let wrong = attitude_bi.then(&Rot::<PlanetFixed, Inertial>::identity());
/// ```
///
/// What is meant does:
///
/// ```
/// use fsw_core::frames::{Body, Inertial, PlanetFixed, Rot, Vec3};
/// let attitude_bi = Rot::<Body, Inertial>::identity();
/// let attitude_bp: Rot<Body, PlanetFixed> = attitude_bi.then(&Rot::about_z(0.1));
/// let nose_p: Vec3<PlanetFixed> = attitude_bp.apply(&Vec3::new(1.0, 0.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rot<A, B> {
    q: [f64; 4],
    axes: PhantomData<(A, B)>,
}

impl<A: Axes, B: Axes> Rot<A, B> {
    /// The rotation that changes nothing.
    #[must_use]
    pub const fn identity() -> Self {
        Self { q: [1.0, 0.0, 0.0, 0.0], axes: PhantomData }
    }

    /// No rotation at all, all zero: stands where an attitude is not known yet.
    pub(crate) const fn unset() -> Self {
        Self { q: [0.0; 4], axes: PhantomData }
    }

    /// A rotation from a quaternion `(w, x, y, z)`, normalised here; `None` when its length is not in `[0.5, 2]`.
    #[must_use]
    pub fn from_quaternion(q: [f64; 4]) -> Option<Self> {
        let n2 = q.iter().map(|c| c * c).sum::<f64>();
        if !(0.25..=4.0).contains(&n2) {
            return None;
        }
        let s = 1.0 / sqrt(n2);
        Some(Self { q: q.map(|c| c * s), axes: PhantomData })
    }

    /// Rotation whose vector (axis times angle, rad) is `rotation_vector`: axes A turned by it are the axes B
    /// means components in A of a vector fixed to B' = turned axes; see [`Rot::apply`] for the sign.
    ///
    /// For a body that turned by `Δθ` between two instants, `from_rotation_vector(Δθ)` maps components in the body
    /// axes *after* the turn to components in the body axes *before* it.
    #[must_use]
    pub fn from_rotation_vector(rotation_vector: &nalgebra::Vector3<f64>) -> Self {
        let v = rotation_vector;
        let angle2 = v.x * v.x + v.y * v.y + v.z * v.z;
        // Series of sin(a/2)/a below 1e-2 rad: the next term is under 1e-17.
        let (s, w) = if angle2 < 1e-4 {
            let s = 0.5 - angle2 / 48.0 + angle2 * angle2 / 3840.0;
            (s, 1.0 - angle2 / 8.0 + angle2 * angle2 / 384.0)
        } else {
            let angle = sqrt(angle2);
            let (sin_half, cos_half) = sin_cos(0.5 * angle);
            (sin_half / angle, cos_half)
        };
        Self { q: [w, s * v.x, s * v.y, s * v.z], axes: PhantomData }.normalised()
    }

    /// Rotation of the axes by `angle_rad` about z: maps components in A to components in B, where B is A turned by
    /// `angle_rad` about +z.
    #[must_use]
    pub fn about_z(angle_rad: f64) -> Self {
        let (s, c) = sin_cos(0.5 * angle_rad);
        Self { q: [c, 0.0, 0.0, -s], axes: PhantomData }
    }

    /// Rotation from three unit vectors: the axes of A expressed in B (the columns of the matrix A → B).
    /// `None` when the columns are not orthonormal and right-handed to 1e-6.
    #[must_use]
    pub fn from_columns(x: &Vec3<B>, y: &Vec3<B>, z: &Vec3<B>) -> Option<Self> {
        let orthonormal = abs(x.dot(y)) < 1e-6
            && abs(y.dot(z)) < 1e-6
            && abs(z.dot(x)) < 1e-6
            && abs(x.dot(x) - 1.0) < 1e-6
            && abs(y.dot(y) - 1.0) < 1e-6
            && abs(x.cross(y).dot(z) - 1.0) < 1e-6;
        if !orthonormal {
            return None;
        }
        // Shepperd: divide by the largest of the four components.
        let (m00, m11, m22) = (x.x(), y.y(), z.z());
        let trace = m00 + m11 + m22;
        let q = if trace > 0.0 {
            let s = 2.0 * sqrt(1.0 + trace);
            [0.25 * s, (y.z() - z.y()) / s, (z.x() - x.z()) / s, (x.y() - y.x()) / s]
        } else if m00 > m11 && m00 > m22 {
            let s = 2.0 * sqrt(1.0 + m00 - m11 - m22);
            [(y.z() - z.y()) / s, 0.25 * s, (y.x() + x.y()) / s, (z.x() + x.z()) / s]
        } else if m11 > m22 {
            let s = 2.0 * sqrt(1.0 + m11 - m00 - m22);
            [(z.x() - x.z()) / s, (y.x() + x.y()) / s, 0.25 * s, (z.y() + y.z()) / s]
        } else {
            let s = 2.0 * sqrt(1.0 + m22 - m00 - m11);
            [(x.y() - y.x()) / s, (z.x() + x.z()) / s, (z.y() + y.z()) / s, 0.25 * s]
        };
        Self::from_quaternion(q)
    }

    /// The quaternion `(w, x, y, z)`.
    #[must_use]
    pub const fn quaternion(&self) -> [f64; 4] {
        self.q
    }

    /// The direction-cosine matrix A → B.
    #[must_use]
    pub fn dcm(&self) -> Matrix3<f64> {
        let [w, x, y, z] = self.q;
        Matrix3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        )
    }

    /// Components in B of a vector given in A.
    #[must_use]
    pub fn apply(&self, v: &Vec3<A>) -> Vec3<B> {
        let [w, x, y, z] = self.q;
        let u: Vec3<B> = Vec3::new(x, y, z);
        let v: Vec3<B> = Vec3::from_components(*v.components());
        let t = u.cross(&v) * 2.0;
        v + t * w + u.cross(&t)
    }

    /// The opposite rotation, B → A.
    #[must_use]
    pub fn inverse(&self) -> Rot<B, A> {
        let [w, x, y, z] = self.q;
        Rot { q: [w, -x, -y, -z], axes: PhantomData }
    }

    /// This rotation followed by `next`: A → B → C.
    #[must_use]
    pub fn then<C: Axes>(&self, next: &Rot<B, C>) -> Rot<A, C> {
        let [aw, ax, ay, az] = next.q;
        let [bw, bx, by, bz] = self.q;
        Rot {
            q: [
                aw * bw - ax * bx - ay * by - az * bz,
                aw * bx + ax * bw + ay * bz - az * by,
                aw * by - ax * bz + ay * bw + az * bx,
                aw * bz + ax * by - ay * bx + az * bw,
            ],
            axes: PhantomData,
        }
    }

    /// The same rotation with its length brought back to one; call once per chain to stop rounding from growing.
    #[must_use]
    pub fn normalised(&self) -> Self {
        let n2 = self.q.iter().map(|c| c * c).sum::<f64>();
        // n2 is one to a few roundings: one Newton step of the inverse root is exact to the last bits.
        let s = 1.5 - 0.5 * n2;
        Self { q: self.q.map(|c| c * s), axes: PhantomData }
    }

    /// The rotation vector (axis times angle, rad, angle in [0, π]); inverse of [`Rot::from_rotation_vector`].
    #[must_use]
    pub fn rotation_vector(&self) -> nalgebra::Vector3<f64> {
        let sign = if self.q[0] < 0.0 { -1.0 } else { 1.0 };
        let [w, x, y, z] = self.q.map(|c| c * sign);
        let sin_half = sqrt(x * x + y * y + z * z);
        let factor = if sin_half < 1e-8 { 2.0 } else { 2.0 * atan2(sin_half, w) / sin_half };
        nalgebra::Vector3::new(x * factor, y * factor, z * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Body, Inertial, PlanetFixed};
    use proptest::prelude::*;

    fn rotation() -> impl Strategy<Value = Rot<Body, Inertial>> {
        prop::array::uniform4(-1.0..1.0f64).prop_filter_map("length", Rot::from_quaternion)
    }

    proptest! {
        #[test]
        fn a_rotation_and_its_inverse_restore_every_vector(r in rotation(), v in prop::array::uniform3(-1e4..1e4f64)) {
            let v = Vec3::<Body>::from_array(v);
            prop_assert!((r.inverse().apply(&r.apply(&v)) - v).norm() < 1e-10);
        }

        #[test]
        fn chained_rotations_equal_the_product_of_their_matrices(a in rotation(), angle in -7.0..7.0f64) {
            let b = Rot::<Inertial, PlanetFixed>::about_z(angle);
            let difference = a.then(&b).dcm() - b.dcm() * a.dcm();
            prop_assert!(difference.iter().all(|d| d.abs() < 1e-14));
        }

        #[test]
        fn columns_and_rotation_vector_round_trip(r in rotation()) {
            let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)].map(|v| r.apply(&v));
            let again = Rot::<Body, Inertial>::from_columns(&axes[0], &axes[1], &axes[2]).unwrap();
            let vector = Rot::<Body, Inertial>::from_rotation_vector(&r.rotation_vector());
            for other in [again, vector] {
                prop_assert!((other.dcm() - r.dcm()).iter().all(|d| d.abs() < 1e-9));
            }
        }
    }

    #[test]
    fn axes_turned_about_z_see_a_fixed_vector_turn_backwards() {
        let east = Rot::<Inertial, PlanetFixed>::about_z(core::f64::consts::FRAC_PI_2).apply(&Vec3::new(0.0, 1.0, 0.0));
        assert!((east - Vec3::new(1.0, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn a_body_turn_maps_the_axes_after_it_to_the_axes_before() {
        let after_to_before = Rot::<Body, Body>::from_rotation_vector(&nalgebra::Vector3::new(0.0, 0.0, 0.3));
        let nose = after_to_before.apply(&Vec3::new(1.0, 0.0, 0.0));
        assert!((nose - Vec3::new(0.3f64.cos(), 0.3f64.sin(), 0.0)).norm() < 1e-15);
    }
}
