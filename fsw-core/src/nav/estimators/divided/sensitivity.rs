//! How a factor moves with the parameters when its covariance does (P2 eqs. 57–65, in closed form).
//!
//! P = L Lᵀ and dP = M + Mᵀ give dL = L Low(L⁻¹ dP L⁻ᵀ), where Low keeps the lower triangle and halves the diagonal: no linear
//! system of the size of P, as P2 and its predecessors solve one.
#![allow(clippy::indexing_slicing, reason = "loop indices are below the const dimension N of the matrices they index")]

use nalgebra::SMatrix;

use super::super::{EstimatorError, Part, finite};
use super::points::Column;

/// Adds what one column of differences contributes to M of each parameter: dS1 S1ᵀ + dS2 S2ᵀ.
pub(super) fn gather<const N: usize, const P: usize>(half: &mut [SMatrix<f64, N, N>; P], column: &Column<N, P>) {
    if !column.is_moving {
        return;
    }
    let of_each = half.iter_mut().zip(column.first_by.iter().zip(&column.second_by));
    for (half, (first_by, second_by)) in of_each {
        for k in 0..N {
            for i in 0..N {
                half[(i, k)] += first_by[i] * column.first[k] + second_by[i] * column.second[k];
            }
        }
    }
}

/// Replaces M of each parameter by the derivative of the factor `l`.
///
/// # Errors
/// A derivative that is not finite.
pub(super) fn of_factor<const N: usize, const P: usize>(
    l: &SMatrix<f64, N, N>,
    half: &mut [SMatrix<f64, N, N>; P],
) -> Result<(), EstimatorError> {
    for m in half {
        differentiate(l, m);
        finite(Part::Transition, m.as_slice())?;
    }
    Ok(())
}

/// Replaces M by dL.
fn differentiate<const N: usize>(l: &SMatrix<f64, N, N>, m: &mut SMatrix<f64, N, N>) {
    solve_columns(l, m);
    m.transpose_mut();
    solve_columns(l, m);
    // Now Aᵀ with A = L⁻¹ M L⁻ᵀ; of A + Aᵀ the lower triangle, its diagonal halved.
    for i in 0..N {
        for k in (0..N).take(i) {
            m[(i, k)] += m[(k, i)];
            m[(k, i)] = 0.0;
        }
    }
    multiply_lower(l, m);
}

/// Replaces M by L⁻¹ M. What is known exactly (a zero on the diagonal of L) moves with nothing.
fn solve_columns<const N: usize>(l: &SMatrix<f64, N, N>, m: &mut SMatrix<f64, N, N>) {
    for i in 0..N {
        let inverse = if l[(i, i)] > 0.0 { 1.0 / l[(i, i)] } else { 0.0 };
        for column in 0..N {
            let mut x = m[(i, column)];
            for k in (0..N).take(i) {
                x -= l[(i, k)] * m[(k, column)];
            }
            m[(i, column)] = x * inverse;
        }
    }
}

/// Replaces the lower triangular B by L B, from the last row up.
fn multiply_lower<const N: usize>(l: &SMatrix<f64, N, N>, b: &mut SMatrix<f64, N, N>) {
    for from_last in 0..N {
        let i = N - 1 - from_last;
        for k in (0..N).take(i + 1) {
            let mut sum = 0.0;
            for j in (0..N).take(i + 1).skip(k) {
                sum += l[(i, j)] * b[(j, k)];
            }
            b[(i, k)] = sum;
        }
    }
}
