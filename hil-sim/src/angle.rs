//! Angles on the circle.

use core::f64::consts::TAU;

/// The angle brought to [−π, π], rad.
#[must_use]
pub fn wrap_rad(angle_rad: f64) -> f64 {
    libm::remainder(angle_rad, TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_come_off() {
        for turns in [-3.0, 0.0, 1.0, 7.0] {
            assert!((wrap_rad(0.5 + turns * TAU) - 0.5).abs() < 1e-14);
        }
    }
}
