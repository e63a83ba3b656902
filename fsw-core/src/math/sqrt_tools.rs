//! Square-root covariance tools, all in place: Cholesky factor, triangular solves, triangularization.
//!
//! Nothing is returned by value, because a 25 × 25 matrix is 5 KB of stack. Only lower triangles are read; all loops
//! have constant bounds, so that the index checks vanish in the compiled code.
#![allow(
    clippy::indexing_slicing,
    reason = "loop indices are below the const dimensions N and M of the matrices they index"
)]
#![allow(clippy::needless_range_loop, reason = "row and column indices are used together")]

use nalgebra::{SMatrix, SVector};

use super::fun::sqrt;

/// A matrix has no Cholesky factor: a pivot is not positive (or not finite).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NotPositiveDefinite {
    /// Row of the pivot that failed.
    pub row: usize,
    /// Its value.
    pub pivot: f64,
}

impl core::fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "matrix is not positive definite: pivot {} is {}", self.row, self.pivot)
    }
}

impl core::error::Error for NotPositiveDefinite {}

/// Replaces the symmetric matrix `a` by its lower Cholesky factor L, a = L·Lᵀ; only the lower triangle of `a` is read,
/// the upper one becomes zero.
///
/// # Errors
/// A pivot is not positive and finite; `a` is then partly overwritten.
pub fn cholesky<const N: usize>(a: &mut SMatrix<f64, N, N>) -> Result<(), NotPositiveDefinite> {
    for j in 0..N {
        let mut pivot = a[(j, j)];
        for k in 0..j {
            pivot -= a[(j, k)] * a[(j, k)];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositiveDefinite { row: j, pivot });
        }
        let diagonal = sqrt(pivot);
        let inverse = 1.0 / diagonal;
        a[(j, j)] = diagonal;
        for i in (j + 1)..N {
            let mut element = a[(i, j)];
            for k in 0..j {
                element -= a[(i, k)] * a[(j, k)];
            }
            a[(i, j)] = element * inverse;
            a[(j, i)] = 0.0;
        }
    }
    Ok(())
}

/// Replaces `b` by L⁻¹·b, for a lower triangular `l` with a nonzero diagonal (a zero there gives numbers that are not finite).
pub fn solve_lower<const N: usize>(l: &SMatrix<f64, N, N>, b: &mut SVector<f64, N>) {
    for i in 0..N {
        let mut x = b[i];
        for k in 0..i {
            x -= l[(i, k)] * b[k];
        }
        b[i] = x / l[(i, i)];
    }
}

/// Replaces `b` by L⁻ᵀ·b, for a lower triangular `l` with a nonzero diagonal.
pub fn solve_lower_transposed<const N: usize>(l: &SMatrix<f64, N, N>, b: &mut SVector<f64, N>) {
    for i in (0..N).rev() {
        let mut x = b[i];
        for k in (i + 1)..N {
            x -= l[(k, i)] * b[k];
        }
        b[i] = x / l[(i, i)];
    }
}

/// Replaces `b` by (L·Lᵀ)⁻¹·b: the solution of a symmetric system from its Cholesky factor.
pub fn solve_cholesky<const N: usize>(l: &SMatrix<f64, N, N>, b: &mut SVector<f64, N>) {
    solve_lower(l, b);
    solve_lower_transposed(l, b);
}

/// Triangularization ("tria"): replaces the wide matrix `a` (N ≤ M) by `[L 0]` with L·Lᵀ = a·aᵀ, L lower triangular with a
/// diagonal that is not negative. Householder reflections from the right; works for any rank.
///
/// Stacking square roots side by side in `a` adds their covariances without ever forming them.
pub fn tria<const N: usize, const M: usize>(a: &mut SMatrix<f64, N, M>) {
    const { assert!(N <= M, "tria wants at least as many columns as rows") };
    for i in 0..N {
        reflect_row(a, i);
    }
}

/// Reflects columns i… of the rows i… of `a` so that row `i` is zero right of its diagonal and not negative on it.
fn reflect_row<const N: usize, const M: usize>(a: &mut SMatrix<f64, N, M>, i: usize) {
    let mut tail = 0.0;
    for j in (i + 1)..M {
        tail += a[(i, j)] * a[(i, j)];
    }
    let head = a[(i, i)];
    if tail <= f64::MIN_POSITIVE {
        // Nothing to eliminate (below, the reflection would divide by zero); a column may change its sign freely.
        for j in (i + 1)..M {
            a[(i, j)] = 0.0;
        }
        if head < 0.0 {
            for k in i..N {
                a[(k, i)] = -a[(k, i)];
            }
        }
        return;
    }
    let norm = sqrt(head * head + tail);
    // Mirror vector v = (head − norm, rest). The subtraction is done without cancellation when head is positive.
    let first = if head > 0.0 { -tail / (head + norm) } else { head - norm };
    let factor = 2.0 / (first * first + tail);
    for k in (i + 1)..N {
        let mut along = a[(k, i)] * first;
        for j in (i + 1)..M {
            along += a[(k, j)] * a[(i, j)];
        }
        let shift = factor * along;
        a[(k, i)] -= shift * first;
        for j in (i + 1)..M {
            a[(k, j)] -= shift * a[(i, j)];
        }
    }
    a[(i, i)] = norm;
    for j in (i + 1)..M {
        a[(i, j)] = 0.0;
    }
}
