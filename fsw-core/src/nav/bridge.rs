//! Bridging of minor frames without an inertial measurement: the last increments are used again, counted, and their
//! growing uncertainty is stated.

use super::strapdown::Increments;

/// Consecutive bridged frames after which the estimate is no longer valid, until the increments are back: 0.5 s.
pub const MAX_BRIDGED_FRAMES: u16 = 25;
/// Change of the specific force that a bridge must expect, m/s³: an entry's steepest build-up, about 1 g/s.
const JERK_MPS3: f64 = 10.0;
/// Change of the body rate that a bridge must expect, rad/s²: the bank acceleration of 5°/s².
const ANGULAR_ACCELERATION_RADPS2: f64 = 0.0873;

/// Counts frames without an inertial measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Bridge {
    run: u16,
    total: u32,
}

/// Variances that one bridged frame adds, per axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BridgeNoise {
    /// Of the velocity, (m/s)².
    pub velocity: f64,
    /// Of the attitude, rad².
    pub attitude: f64,
}

impl Bridge {
    /// The increments to use this frame, and the noise that they add: what was measured, else the last ones, else none
    /// (free fall without rotation).
    pub fn choose(
        &mut self,
        measured: Option<Increments>,
        last: Option<Increments>,
        dt_s: f64,
    ) -> (Increments, BridgeNoise) {
        if let Some(increments) = measured {
            self.run = 0;
            return (increments, BridgeNoise::default());
        }
        let before = f64::from(self.run) * dt_s;
        self.run = self.run.saturating_add(1);
        self.total = self.total.saturating_add(1);
        let after = f64::from(self.run) * dt_s;
        // The error ½·a·t² grows coherently over the run: each frame adds the difference of the squares.
        let growth = 0.25 * (after * after * after * after - before * before * before * before);
        let noise = BridgeNoise {
            velocity: JERK_MPS3 * JERK_MPS3 * growth,
            attitude: ANGULAR_ACCELERATION_RADPS2 * ANGULAR_ACCELERATION_RADPS2 * growth,
        };
        (last.unwrap_or_default(), noise)
    }

    /// True while the present run of bridged frames is too long to trust.
    pub fn lost(&self) -> bool {
        self.run > MAX_BRIDGED_FRAMES
    }

    /// Bridged frames in the present run.
    pub fn run(&self) -> u16 {
        self.run
    }

    /// Bridged frames since the start.
    pub fn total(&self) -> u32 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Vec3;

    fn some() -> Increments {
        Increments { delta_v_b: Vec3::new(1.0, 2.0, 3.0), delta_theta_b: Vec3::new(0.1, 0.0, 0.0) }
    }

    #[test]
    fn a_missing_frame_repeats_the_last_increments_and_is_counted() {
        let mut bridge = Bridge::default();
        let (used, noise) = bridge.choose(None, Some(some()), 0.02);
        assert_eq!(used, some());
        assert!(noise.velocity > 0.0 && noise.attitude > 0.0);
        bridge.choose(Some(some()), None, 0.02);
        assert_eq!((bridge.run(), bridge.total()), (0, 1));
    }

    #[test]
    fn a_long_gap_is_lost_until_the_measurements_are_back() {
        let mut bridge = Bridge::default();
        for _ in 0..MAX_BRIDGED_FRAMES {
            bridge.choose(None, Some(some()), 0.02);
            assert!(!bridge.lost());
        }
        bridge.choose(None, Some(some()), 0.02);
        assert!(bridge.lost());
        bridge.choose(Some(some()), Some(some()), 0.02);
        assert!(!bridge.lost());
    }

    #[test]
    fn the_variance_of_a_run_is_that_of_its_whole_length() {
        let mut bridge = Bridge::default();
        let sum: f64 = (0..10).map(|_| bridge.choose(None, Some(some()), 0.02).1.velocity).sum();
        let error = 0.5 * JERK_MPS3 * 0.2 * 0.2;
        assert!((sum - error * error).abs() < 1e-12);
    }
}
