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
        for k in (0..N).take(j) {
            pivot -= a[(j, k)] * a[(j, k)];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return Err(NotPositiveDefinite { row: j, pivot });
        }
        let diagonal = sqrt(pivot);
        let inverse = 1.0 / diagonal;
        a[(j, j)] = diagonal;
        for i in (0..N).skip(j + 1) {
            let mut element = a[(i, j)];
            for k in (0..N).take(j) {
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
        for k in (0..N).take(i) {
            x -= l[(i, k)] * b[k];
        }
        b[i] = x / l[(i, i)];
    }
}

/// Replaces `b` by L⁻ᵀ·b, for a lower triangular `l` with a nonzero diagonal.
pub fn solve_lower_transposed<const N: usize>(l: &SMatrix<f64, N, N>, b: &mut SVector<f64, N>) {
    for row in 0..N {
        let i = N - 1 - row;
        let mut x = b[i];
        for k in (0..N).skip(i + 1) {
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
    // Beyond its last element that is not zero, the mirror vector changes nothing: many a row of a filter is short.
    let mut count = 0;
    for j in (0..M).skip(i + 1) {
        if a[(i, j)] != 0.0 {
            count = j - i;
        }
    }
    let mut tail = 0.0;
    for j in (0..M).skip(i + 1).take(count) {
        tail += a[(i, j)] * a[(i, j)];
    }
    let head = a[(i, i)];
    if tail <= f64::MIN_POSITIVE {
        // Nothing to eliminate (below, the reflection would divide by zero); a column may change its sign freely.
        for j in (0..M).skip(i + 1).take(count) {
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
    for k in (0..N).skip(i + 1) {
        let mut along = a[(k, i)] * first;
        for j in (0..M).skip(i + 1).take(count) {
            along += a[(k, j)] * a[(i, j)];
        }
        let shift = factor * along;
        a[(k, i)] -= shift * first;
        for j in (0..M).skip(i + 1).take(count) {
            a[(k, j)] -= shift * a[(i, j)];
        }
    }
    a[(i, i)] = norm;
    for j in (0..M).skip(i + 1).take(count) {
        a[(i, j)] = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Wide = SMatrix<f64, 5, 9>;

    fn wide() -> impl Strategy<Value = Wide> {
        prop::collection::vec(-2.0..2.0f64, 45).prop_map(|numbers| Wide::from_column_slice(&numbers))
    }

    fn largest(m: &SMatrix<f64, 5, 5>) -> f64 {
        m.iter().fold(0.0, |largest, x| if x.abs() > largest { x.abs() } else { largest })
    }

    fn is_lower_with_nonnegative_diagonal<const M: usize>(l: &SMatrix<f64, 5, M>) -> bool {
        (0..5).all(|i| l[(i, i)] >= 0.0 && ((i + 1)..M).all(|j| l[(i, j)] == 0.0))
    }

    proptest! {
        // Elements of the products reach 36: rounding of a few 1e-14 is allowed for throughout.
        #[test]
        fn the_cholesky_factor_squares_to_the_matrix(a in wide()) {
            let p = a * a.transpose() + SMatrix::<f64, 5, 5>::identity();
            let mut l = p;
            cholesky(&mut l).unwrap();
            prop_assert!(is_lower_with_nonnegative_diagonal(&l));
            prop_assert!(largest(&(l * l.transpose() - p)) < 1e-12);
        }

        #[test]
        fn only_the_lower_triangle_is_read(a in wide()) {
            let p = a * a.transpose() + SMatrix::<f64, 5, 5>::identity();
            let (mut clean, mut spoiled) = (p, p);
            for i in 0..5 {
                for j in (i + 1)..5 {
                    spoiled[(i, j)] = f64::NAN;
                }
            }
            cholesky(&mut clean).unwrap();
            cholesky(&mut spoiled).unwrap();
            prop_assert_eq!(clean, spoiled);
        }

        #[test]
        fn the_solves_undo_the_products(a in wide(), x in prop::array::uniform5(-3.0..3.0f64)) {
            let mut l = a * a.transpose() + SMatrix::<f64, 5, 5>::identity();
            cholesky(&mut l).unwrap();
            let x = SVector::<f64, 5>::from(x);
            let (mut lower, mut upper, mut both) = (l * x, l.transpose() * x, l * (l.transpose() * x));
            solve_lower(&l, &mut lower);
            solve_lower_transposed(&l, &mut upper);
            solve_cholesky(&l, &mut both);
            for i in 0..5 {
                // The condition number of L·Lᵀ is at most 200 or so here.
                prop_assert!((lower[i] - x[i]).abs() < 1e-11 && (upper[i] - x[i]).abs() < 1e-11);
                prop_assert!((both[i] - x[i]).abs() < 1e-10);
            }
        }

        #[test]
        fn triangularization_keeps_the_product(a in wide()) {
            let mut l = a;
            tria(&mut l);
            prop_assert!(is_lower_with_nonnegative_diagonal(&l));
            prop_assert!(largest(&(l * l.transpose() - a * a.transpose())) < 1e-12);
        }

        #[test]
        fn triangularization_of_a_square_root_is_the_cholesky_factor(a in wide()) {
            let mut l = a;
            tria(&mut l);
            let mut factor = a * a.transpose();
            prop_assume!(cholesky(&mut factor).is_ok());
            // Forming the product squares the condition number; 1e-6 leaves room for the nearly singular draws.
            prop_assert!(largest(&(l.fixed_columns::<5>(0).into_owned() - factor)) < 1e-6);
        }
    }

    #[test]
    fn triangularization_survives_lost_rank_and_zeros() {
        for a in [Wide::zeros(), Wide::from_fn(|i, _| i as f64), Wide::from_fn(|i, j| if i == j { -1.0 } else { 0.0 })]
        {
            let mut l = a;
            tria(&mut l);
            assert!(is_lower_with_nonnegative_diagonal(&l), "{l}");
            assert!(largest(&(l * l.transpose() - a * a.transpose())) < 1e-12);
        }
    }

    #[test]
    fn triangularization_survives_numbers_whose_squares_vanish() {
        let mut l = Wide::from_fn(|i, j| if i == 2 { 1e-170 } else { (i + j) as f64 });
        tria(&mut l);
        assert!(l.iter().all(|x| x.is_finite()), "{l}");
    }

    #[test]
    fn the_pivot_that_fails_is_named() {
        let mut indefinite = SMatrix::<f64, 3, 3>::new(4.0, 0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        assert_eq!(cholesky(&mut indefinite), Err(NotPositiveDefinite { row: 1, pivot: 0.0 }));
        let mut broken = SMatrix::<f64, 2, 2>::new(1.0, 0.0, f64::NAN, 1.0);
        assert!(matches!(cholesky(&mut broken), Err(NotPositiveDefinite { row: 1, .. })));
    }
}
