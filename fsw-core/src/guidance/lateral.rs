//! Lateral logic: on which side to bank.
//!
//! The heading offset χ is kept within a threshold by turning the lift to the other side. The threshold shrinks with speed,
//! by a polynomial (P4 §3.3), or, in mode `aeroshell`, with what can still be put right: a share of the crossrange that
//! the lift, turned to the other side at once and left there, would gain on the way to the trigger. So a flight with little
//! bank, which turns slowly, reverses early, and a share of a quarter needs two or three reversals from any entry.
//! `doc/guidance.md` compares the two, and a planned single reversal.
//!
//! Outside the threshold the side is that of the target; inside, the side is kept. ("Flip when outside" would
//! flip back and forth every cycle until the vehicle has turned.)

use crate::link::parameters::GuidanceParameters;
use crate::math::fun::ln;
use crate::math::num::{abs, max, sign};

/// Threshold of the heading offset, m, at a planet-relative speed: constant, linear and quadratic part.
#[must_use]
pub fn threshold_m(speed_mps: f64, guidance: &GuidanceParameters) -> f64 {
    let slope = guidance.threshold_linear_s + guidance.threshold_quadratic_s2pm * speed_mps;
    guidance.threshold_constant_m + slope * speed_mps
}

/// Crossrange that a bank to one side gains on the way to the trigger, m, from speed, range to go and the sine of the bank.
///
/// The track turns by ψ' = L sin σ / V while V' = −D, in all by (L/D) sin σ ln (V/V₁) at the trigger speed V₁; this turn
/// times the range to go bounds the crossrange gained.
#[must_use]
pub fn recoverable_m(lift_to_drag: f64, sin_bank: f64, speed_ratio: f64, range_m: f64) -> f64 {
    abs(lift_to_drag * sin_bank) * ln(max(speed_ratio, 1.0)) * range_m
}

/// The side to bank to, +1 right or −1 left, from the side so far, the heading offset (positive: target to the right) and
/// its threshold. A threshold or an offset that is not a number keeps the side.
#[must_use]
pub fn side(side_so_far: f64, heading_offset_m: f64, threshold_m: f64) -> f64 {
    if abs(heading_offset_m) > threshold_m { sign(heading_offset_m) } else { side_so_far }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inside_the_threshold_the_side_is_kept_and_outside_it_is_the_targets() {
        for (so_far, offset, expected) in [
            (1.0, 900.0, 1.0),
            (1.0, -900.0, 1.0),
            (-1.0, 900.0, -1.0),
            (1.0, -1100.0, -1.0),
            (-1.0, 1100.0, 1.0),
            (1.0, 1100.0, 1.0),
        ] {
            assert_eq!(side(so_far, offset, 1000.0), expected);
        }
    }

    #[test]
    fn what_can_be_recovered_shrinks_with_speed_range_and_bank_and_is_nothing_at_the_trigger() {
        let at = |bank_deg: f64, ratio, range_m| recoverable_m(0.24, bank_deg.to_radians().sin(), ratio, range_m);
        assert!((at(90.0, core::f64::consts::E, 1e5) - 24e3).abs() < 1e-6);
        assert_eq!(at(-60.0, 3.0, 1e5), at(60.0, 3.0, 1e5));
        assert!(at(60.0, 3.0, 1e5) > at(30.0, 3.0, 1e5) && at(60.0, 3.0, 1e5) > at(60.0, 2.0, 5e4));
        assert_eq!((at(60.0, 1.0, 1e4), at(60.0, 0.5, 1e4)), (0.0, 0.0));
    }

    #[test]
    fn the_side_does_not_chatter_while_the_vehicle_is_still_outside() {
        // The offset stays outside for ten cycles while the vehicle turns: one reversal, not ten.
        let (mut so_far, mut reversals) = (1.0, 0);
        for cycle in 0..20 {
            let offset = -1500.0 + 100.0 * f64::from(cycle);
            let next = side(so_far, offset, 1000.0);
            reversals += i32::from(next != so_far);
            so_far = next;
        }
        assert_eq!(reversals, 1);
    }

    #[test]
    fn an_offset_that_is_not_a_number_keeps_the_side() {
        assert_eq!(side(-1.0, f64::NAN, 1000.0), -1.0);
        assert_eq!(side(1.0, -5e3, f64::NAN), 1.0);
    }
}
