//! Whether a covariance is one, and whether it tells the truth about the errors.

use fsw_core::math::fun;
use fsw_core::math::sqrt_tools::{cholesky, solve_lower};
use nalgebra::{SMatrix, SVector};

/// Negative eigenvalue of the correlations that counts as an indefinite covariance: far above rounding.
pub const INDEFINITE: f64 = 1e-12;

/// Normalised estimation error squared eᵀP⁻¹e of the first `N` components, given the lower triangular factor of P. Its mean
/// is `N` when the covariance is true.
///
/// The block of the first components of a lower triangular factor is the factor of their covariance.
#[must_use]
pub fn nees<const N: usize, const J: usize>(error: &[f64; N], factor: &SMatrix<f64, J, J>) -> f64 {
    let block = SMatrix::<f64, N, N>::from_fn(|i, j| *factor.get((i, j)).unwrap_or(&0.0));
    let mut whitened = SVector::from(*error);
    solve_lower(&block, &mut whitened);
    whitened.norm_squared()
}

/// [`nees`] of a covariance itself, of its symmetric part; nothing when that is not positive definite.
#[must_use]
pub fn nees_of_covariance<const N: usize>(error: &[f64; N], covariance: &SMatrix<f64, N, N>) -> Option<f64> {
    let mut factor = (covariance + covariance.transpose()) * 0.5;
    cholesky(&mut factor).ok()?;
    Some(nees(error, &factor))
}

/// Whether the covariance L·Lᵀ of a factor, scaled to correlations, has an eigenvalue below −[`INDEFINITE`], or holds
/// something that is no number.
#[must_use]
pub fn is_indefinite_factor<const J: usize>(factor: &SMatrix<f64, J, J>) -> bool {
    is_indefinite(&(factor * factor.transpose()))
}

/// Whether a covariance, scaled to correlations, has an eigenvalue below −[`INDEFINITE`], a negative variance, or holds
/// something that is no number.
#[must_use]
pub fn is_indefinite<const J: usize>(covariance: &SMatrix<f64, J, J>) -> bool {
    if covariance.iter().any(|x| !x.is_finite()) || covariance.diagonal().iter().any(|variance| *variance < 0.0) {
        return true;
    }
    // A component that is known exactly has no correlations; one that has some all the same fails the test below.
    let scale = covariance.diagonal().map(|variance| if variance > 0.0 { 1.0 / fun::sqrt(variance) } else { 1.0 });
    let mut correlations = SMatrix::<f64, J, J>::from_fn(|i, j| {
        let mean = 0.5 * (covariance[(i, j)] + covariance[(j, i)]);
        mean * scale[i] * scale[j] + if i == j { INDEFINITE } else { 0.0 }
    });
    cholesky(&mut correlations).is_err()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normalised_error_is_that_of_the_first_components() {
        let factor = SMatrix::<f64, 3, 3>::new(2.0, 0.0, 0.0, 1.0, 3.0, 0.0, 5.0, 7.0, 11.0);
        let covariance = (factor * factor.transpose()).fixed_view::<2, 2>(0, 0).into_owned();
        let error = [1.5, -2.0];
        let e = SVector::from(error);
        let expected = (e.transpose() * covariance.try_inverse().unwrap() * e)[0];
        assert!((nees(&error, &factor) - expected).abs() < 1e-12);
        assert!((nees_of_covariance(&error, &covariance).unwrap() - expected).abs() < 1e-12);
        assert!(nees_of_covariance(&error, &-covariance).is_none());
    }

    #[test]
    fn an_indefinite_covariance_is_found_out_and_a_singular_one_is_not_accused() {
        let mut covariance = SMatrix::<f64, 2, 2>::new(1e6, 1.0, 1.0, 1e-6);
        assert!(!is_indefinite(&covariance), "singular");
        covariance[(1, 1)] = 0.999e-6;
        assert!(is_indefinite(&covariance));
        assert!(is_indefinite(&SMatrix::<f64, 1, 1>::new(-1e-30)));
        assert!(!is_indefinite_factor(&SMatrix::<f64, 3, 3>::zeros()), "all known exactly");
    }

    #[test]
    fn what_is_no_number_is_indefinite() {
        let mut factor = SMatrix::<f64, 3, 3>::identity();
        assert!(!is_indefinite_factor(&factor));
        factor[(1, 1)] = f64::NAN;
        assert!(is_indefinite_factor(&factor));
    }
}
