//! Lateral logic: on which side to bank.
//!
//! The heading offset χ is kept within a threshold that shrinks with speed by turning the lift to the other side. Source:
//! P4 §3.3. Outside the threshold the side is that of the target; inside, the side is kept. ("Flip when outside" would
//! flip back and forth every cycle until the vehicle has turned.)

use crate::link::parameters::GuidanceParameters;
use crate::math::num::{abs, sign};

/// Threshold of the heading offset, m, at a planet-relative speed: constant, linear and quadratic part.
#[must_use]
pub fn threshold_m(speed_mps: f64, guidance: &GuidanceParameters) -> f64 {
    let slope = guidance.threshold_linear_s + guidance.threshold_quadratic_s2pm * speed_mps;
    guidance.threshold_constant_m + slope * speed_mps
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
