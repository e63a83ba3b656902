//! A covariance kept as its lower triangular factor, P = L·Lᵀ, and changed by one vector at a time: noise added, a scalar
//! measurement taken in. What is kept cannot become indefinite, whatever is rounded: L·Lᵀ never is.
//!
//! Each function once for a size, never inlined: what a call costs is little beside its N² operations, and a flight computer
//! has many callers and little memory. All in place, N²-ish operations each; zeros on the diagonal (a state that is known exactly) are welcome.
#![allow(
    clippy::indexing_slicing,
    reason = "loop indices are below the const dimension N of the matrices and vectors they index"
)]
#![allow(clippy::needless_range_loop, reason = "row and column indices are used together")]

use nalgebra::SMatrix;

use super::fun::sqrt;

/// Replaces L by the factor of L·Lᵀ + v·vᵀ: one Givens rotation a column.
#[inline(never)]
pub fn add_column<const N: usize>(l: &mut SMatrix<f64, N, N>, v: &[f64; N]) {
    let mut v = *v;
    for j in 0..N {
        if v[j] == 0.0 {
            continue;
        }
        let radius = sqrt(l[(j, j)] * l[(j, j)] + v[j] * v[j]);
        if radius <= 0.0 {
            // Both squares vanish: what is lost is below the smallest number.
            continue;
        }
        let (cosine, sine) = (l[(j, j)] / radius, v[j] / radius);
        l[(j, j)] = radius;
        for i in (0..N).skip(j + 1) {
            let turned = cosine * l[(i, j)] + sine * v[i];
            v[i] = cosine * v[i] - sine * l[(i, j)];
            l[(i, j)] = turned;
        }
    }
}

/// Lᵀ·h: a row of derivatives in the coordinates in which the covariance is the identity.
#[must_use]
#[inline(never)]
pub fn whitened<const N: usize>(l: &SMatrix<f64, N, N>, h: &[f64; N]) -> [f64; N] {
    let mut f = [0.0; N];
    for j in 0..N {
        for i in (0..N).skip(j) {
            f[j] += l[(i, j)] * h[i];
        }
    }
    f
}

/// Takes in a scalar measurement with the optimal gain: replaces L by the factor of P − u·uᵀ/s, where f = [`whitened`] row,
/// u = L·f = P·h and s = fᵀf + `variance`; gives u, so that the gain is u/s.
///
/// Carlson's triangular form of Potter's update (Carlson 1973; Bierman 1977, §V.5), from the last column to the first
/// because the factor is lower triangular. `variance` must be positive; the factor then stays one, without cancellation.
#[must_use]
#[inline(never)]
pub fn reduce<const N: usize>(l: &mut SMatrix<f64, N, N>, f: &[f64; N], variance: f64) -> [f64; N] {
    let mut u = [0.0; N];
    let mut sum = variance;
    let mut root_before = sqrt(variance);
    for from_last in 0..N {
        let j = N - 1 - from_last;
        sum += f[j] * f[j];
        // Roots apart: their product and quotient stay in range where those of the squares would not.
        let root_after = sqrt(sum);
        let keep = root_before / root_after;
        let part = f[j] / root_after;
        for i in (0..N).skip(j) {
            let old = l[(i, j)];
            l[(i, j)] = keep * old - part * (u[i] / root_before);
            u[i] += old * f[j];
        }
        root_before = root_after;
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sqrt_tools::cholesky;
    use proptest::prelude::*;

    type Square = SMatrix<f64, 5, 5>;
    type Row = nalgebra::SVector<f64, 5>;

    fn factor() -> impl Strategy<Value = Square> {
        prop::collection::vec(-2.0..2.0f64, 25).prop_map(|numbers| {
            let a = Square::from_column_slice(&numbers);
            let mut l = a * a.transpose() + Square::identity();
            cholesky(&mut l).unwrap();
            l
        })
    }

    fn largest(m: &Square) -> f64 {
        m.iter().fold(0.0, |largest, x| if x.abs() > largest { x.abs() } else { largest })
    }

    fn is_factor(l: &Square) -> bool {
        (0..5).all(|i| l[(i, i)] >= 0.0 && (i + 1..5).all(|j| l[(i, j)] == 0.0)) && l.iter().all(|x| x.is_finite())
    }

    proptest! {
        // Elements reach 25 and some ten operations touch each: 1e-12 leaves two digits.
        #[test]
        fn an_added_column_adds_its_square(l in factor(), v in prop::array::uniform5(-3.0..3.0f64)) {
            let mut found = l;
            add_column(&mut found, &v);
            prop_assert!(is_factor(&found));
            let v = Row::from(v);
            prop_assert!(largest(&(found * found.transpose() - l * l.transpose() - v * v.transpose())) < 1e-12);
        }

        #[test]
        fn a_measurement_reduces_as_the_kalman_gain_does(
            l in factor(), h in prop::array::uniform5(-3.0..3.0f64), variance in 1e-3..10.0f64
        ) {
            let p = l * l.transpose();
            let mut found = l;
            let u = reduce(&mut found, &whitened(&l, &h), variance);
            prop_assert!(is_factor(&found));
            let h = Row::from(h);
            let expected_u = p * h;
            let s = (h.transpose() * expected_u)[0] + variance;
            for i in 0..5 {
                prop_assert!((u[i] - expected_u[i]).abs() < 1e-12);
            }
            let expected = p - expected_u * expected_u.transpose() / s;
            prop_assert!(largest(&(found * found.transpose() - expected)) < 1e-12);
        }

        #[test]
        fn a_known_state_stays_known(l in factor(), h in prop::array::uniform5(-3.0..3.0f64)) {
            let mut found = l;
            for j in 0..5 {
                found[(2, j)] = 0.0;
            }
            let f = whitened(&found, &h);
            let _ = reduce(&mut found, &f, 0.1);
            prop_assert!((0..5).all(|j| found[(2, j)] == 0.0));
            add_column(&mut found, &[1.0, 2.0, 0.0, 3.0, 4.0]);
            prop_assert!((0..3).all(|j| found[(2, j)].abs() < 1e-15));
        }
    }

    #[test]
    fn a_measurement_a_billion_times_better_than_the_knowledge_leaves_a_factor() {
        let mut l = Square::identity() * 1e9;
        for k in 0..50 {
            let h = [1.0, 0.5, f64::from(k), -0.25, 1e-9];
            let f = whitened(&l, &h);
            let _ = reduce(&mut l, &f, 1e-18);
        }
        assert!(is_factor(&l));
    }
}
