//! Central + J2 gravity and its gradient. z is the spin axis, so that every planet-centred frame with that axis will do.

use nalgebra::Matrix3;

use super::entry::Constants;
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
    acceleration_from(&Constants::new(planet, 0.0), r, inverse_square, inverse_square.sqrt())
}

/// [`acceleration`] for a caller that already has 1/r² and 1/r.
#[inline(always)]
pub(super) fn acceleration_from<S: Scalar>(constants: &Constants, r: &[S; 3], inverse_square: S, inverse: S) -> [S; 3] {
    let [x, y, z] = *r;
    // g = μ/r³, q = 3/2 J2 (R/r)², s = 5 sin²φ.
    let g = inverse_square * inverse * constants.mu_m3ps2;
    let q = inverse_square * constants.oblateness_m2;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Dual;
    use crate::planet::MARS;
    use proptest::prelude::*;

    fn position() -> impl Strategy<Value = [f64; 3]> {
        (3.3e6..4.2e6f64, -1.57..1.57f64, -3.1..3.1f64)
            .prop_map(|(r, lat, lon)| [r * lat.cos() * lon.cos(), r * lat.cos() * lon.sin(), r * lat.sin()])
    }

    /// The potential, written apart from the acceleration: μ/r [1 − J2 (R/r)² (3 sin²φ − 1)/2].
    fn potential(planet: &Planet, [x, y, z]: [f64; 3]) -> f64 {
        let r = (x * x + y * y + z * z).sqrt();
        let sine = z / r;
        planet.mu_m3ps2 / r * (1.0 - planet.j2 * (planet.radius_m / r).powi(2) * (1.5 * sine * sine - 0.5))
    }

    proptest! {
        #[test]
        fn gravity_is_the_gradient_of_the_potential(r in position()) {
            let a = acceleration(&MARS, &r);
            for i in 0..3 {
                let (mut ahead, mut behind) = (r, r);
                ahead[i] += 100.0;
                behind[i] -= 100.0;
                let slope = (potential(&MARS, ahead) - potential(&MARS, behind)) / 200.0;
                // Rounding of a potential of 1.3e7 over 200 m: 1e-11; truncation (100 m / r)² of 4 m/s²: 4e-9.
                prop_assert!((a[i] - slope).abs() < 1e-8, "{} {}", a[i], slope);
            }
        }

        #[test]
        fn the_gradient_is_the_derivative_symmetric_and_without_trace(r in position()) {
            let g = gradient(&MARS, &r);
            let exact = acceleration(&MARS, &Dual::variables(&r));
            for i in 0..3 {
                for j in 0..3 {
                    // Elements are about 1e-6 1/s²; rounding is 1e-16 of that, a few times.
                    prop_assert!((g[(i, j)] - exact[i].partials[j]).abs() < 1e-20, "{} {}", i, j);
                    prop_assert_eq!(g[(i, j)], g[(j, i)]);
                }
            }
            prop_assert!((g[(0, 0)] + g[(1, 1)] + g[(2, 2)]).abs() < 1e-20);
        }
    }

    #[test]
    fn the_poles_pull_less_than_the_equator_at_the_same_distance() {
        // q = 3/2 J2 (R/r)²: the equator pulls 1 + q, the pole 1 − 2q.
        let r = MARS.radius_m;
        let central = MARS.mu_m3ps2 / (r * r);
        let q = 1.5 * MARS.j2;
        let [equator, ..] = acceleration(&MARS, &[r, 0.0, 0.0]);
        let [.., pole] = acceleration(&MARS, &[0.0, 0.0, r]);
        assert!((equator / central + 1.0 + q).abs() < 1e-14);
        assert!((pole / central + 1.0 - 2.0 * q).abs() < 1e-14);
    }
}
