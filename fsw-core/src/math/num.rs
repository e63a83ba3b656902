//! Comparisons with one defined result on every target.
//!
//! `f64::max` and `f64::min` leave the sign of zero and the treatment of NaN to the compiler, and were seen to
//! differ between targets and even optimisation levels. These do not.

/// The larger of two numbers; `a` when either is NaN or both are equal.
#[must_use]
pub fn max(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// The smaller of two numbers; `a` when either is NaN or both are equal.
#[must_use]
pub fn min(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// `x` limited to `[low, high]`; NaN becomes `low`, so that a limit always holds.
#[must_use]
pub fn clamp(x: f64, low: f64, high: f64) -> f64 {
    if x > high {
        high
    } else if x >= low {
        x
    } else {
        low
    }
}

/// Absolute value.
#[must_use]
pub fn abs(x: f64) -> f64 {
    libm::fabs(x)
}

/// −1, 0 or +1 with the sign of `x`; 0 for NaN.
#[must_use]
pub fn sign(x: f64) -> f64 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Angle brought to (−π, π]; angles beyond ±1e6 rad or not finite become 0.
#[must_use]
pub fn wrap_angle(angle_rad: f64) -> f64 {
    use core::f64::consts::PI;
    #[allow(clippy::neg_cmp_op_on_partial_ord)] // NaN takes this branch too
    if !(abs(angle_rad) <= 1e6) {
        return 0.0;
    }
    let turns = libm::ceil((angle_rad - PI) / (2.0 * PI));
    angle_rad - turns * 2.0 * PI
}

/// True when every number of the slice is finite.
#[must_use]
pub fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|v| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::PI;

    #[test]
    fn a_limit_holds_even_for_nan() {
        assert_eq!(clamp(f64::NAN, -1.0, 2.0), -1.0);
        assert_eq!(clamp(5.0, -1.0, 2.0), 2.0);
        assert_eq!(clamp(0.5, -1.0, 2.0), 0.5);
    }

    #[test]
    fn the_first_argument_wins_a_tie_so_signed_zeros_are_defined() {
        assert!(max(-0.0, 0.0).is_sign_negative());
        assert!(min(0.0, -0.0).is_sign_positive());
    }

    #[test]
    fn wrapped_angles_stay_in_the_half_open_turn() {
        for (angle, wrapped) in [(0.0, 0.0), (PI, PI), (-PI, PI), (3.0 * PI, PI), (-0.5, -0.5), (2.0 * PI, 0.0)] {
            assert!((wrap_angle(angle) - wrapped).abs() < 1e-12, "{angle}");
        }
        assert_eq!(wrap_angle(f64::NAN), 0.0);
    }
}
