//! Central + J2 gravity and its gradient. z is the spin axis, so that every planet-centred frame with that axis will do.

use nalgebra::Matrix3;

use crate::math::Scalar;
use crate::math::fun::sqrt;
use crate::planet::Planet;

/// Gravitational acceleration (no centrifugal part) at the position `r`, m → m/s²; `r` must not be the planet's centre.
///
/// The gradient of U = μ/r [1 − J2 (R/r)² (3 sin²φ − 1)/2]; its radial and northward parts are `guidance.md` §1's
/// g_r and g_N.
#[must_use]
pub fn acceleration<S: Scalar>(planet: &Planet, r: &[S; 3]) -> [S; 3] {
    let [x, y, z] = *r;
    let inverse_square = (x * x + y * y + z * z).recip();
    acceleration_from(planet, r, inverse_square, inverse_square.sqrt())
}

/// [`acceleration`] for a caller that already has 1/r² and 1/r.
#[inline(always)]
pub(super) fn acceleration_from<S: Scalar>(planet: &Planet, r: &[S; 3], inverse_square: S, inverse: S) -> [S; 3] {
    let [x, y, z] = *r;
    // g = μ/r³, q = 3/2 J2 (R/r)², s = 5 sin²φ.
    let g = inverse_square * inverse * planet.mu_m3ps2;
    let q = inverse_square * (1.5 * planet.j2 * planet.radius_m * planet.radius_m);
    let qs = q * (z * z * inverse_square * 5.0);
    let equatorial = g * (q - qs + 1.0);
    let polar = equatorial + g * q * 2.0;
    [-(equatorial * x), -(equatorial * y), -(polar * z)]
}

/// Gradient ∂a/∂r of [`acceleration`], 1/s²; symmetric, trace zero.
#[must_use]
pub fn gradient(planet: &Planet, r: &[f64; 3]) -> Matrix3<f64> {
    let [x, y, z] = *r;
    let r2 = x * x + y * y + z * z;
    let inverse_square = 1.0 / r2;
    let g = planet.mu_m3ps2 * inverse_square * sqrt(inverse_square);
    let q = 1.5 * planet.j2 * planet.radius_m * planet.radius_m * inverse_square;
    let s = z * z * inverse_square;
    // ∂a/∂r = −g [ d I + a r rᵀ/r² − 10 q (r zᵀ + z rᵀ) z/r² + 2 q z zᵀ ], z the unit vector of the axis where no number.
    let d = 1.0 + q * (1.0 - 5.0 * s);
    let a = (-3.0 + q * (35.0 * s - 5.0)) * inverse_square;
    let b = -10.0 * q * z * inverse_square;
    let (xx, yy, zz) = (d + a * x * x, d + a * y * y, d + a * z * z + 2.0 * b * z + 2.0 * q);
    let (xy, xz, yz) = (a * x * y, a * x * z + b * x, a * y * z + b * y);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz) * -g
}
