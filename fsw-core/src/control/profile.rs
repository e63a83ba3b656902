//! The bank rate that brings an error to rest in the shortest time, rounded off near zero so that it does not chatter.

use crate::math::fun::sqrt;
use crate::math::num::{abs, sign};

/// Share of the acceleration limit the profile brakes with; the rest covers the lag of the actuator.
const BRAKING_SHARE: f64 = 0.9;
/// The linear zone decays this many times slower than the rate loop answers, which keeps the two apart.
const ZONE_OVER_RESPONSE: f64 = 2.5;
/// Response time of the rate loop without a lag, s: four minor frames.
const RESPONSE_BASE_S: f64 = 0.08;
/// Response time of the rate loop per second of lag; below about 1.5 the rate overshoots its limit.
const RESPONSE_PER_LAG: f64 = 2.0;

/// A wanted rate and how it changes with the error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WantedRate {
    /// Rate, rad/s, with the sign of the error.
    pub rate_radps: f64,
    /// Derivative of the rate with respect to the error, 1/s, not negative.
    pub slope_ps: f64,
}

/// Time in which the rate loop closes a rate error, s, for an actuator lag, s.
#[must_use]
pub fn response_s(lag_s: f64) -> f64 {
    RESPONSE_BASE_S + RESPONSE_PER_LAG * lag_s
}

/// Rate at which an error of `error_rad` should shrink.
///
/// Far away √(2 a (|e| − e₀/2)), the parabola of constant braking a; within e₀ = a/k² a straight line of slope k, which
/// meets the parabola with equal value and slope; never above `rate_max`.
#[must_use]
pub fn rate_to_rest(error_rad: f64, response_s: f64, accel_max: f64, rate_max: f64) -> WantedRate {
    let (braking, gain) = (BRAKING_SHARE * accel_max, 1.0 / (ZONE_OVER_RESPONSE * response_s));
    let (distance, zone) = (abs(error_rad), braking / (gain * gain));
    let (rate, slope_ps) = if distance <= zone {
        (gain * distance, gain)
    } else {
        let rate = sqrt(2.0 * braking * (distance - 0.5 * zone));
        (rate, braking / rate)
    };
    if rate > rate_max {
        WantedRate { rate_radps: sign(error_rad) * rate_max, slope_ps: 0.0 }
    } else {
        WantedRate { rate_radps: sign(error_rad) * rate, slope_ps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_and_parabola_meet_smoothly() {
        let (accel, response) = (0.0873, 0.28);
        let gain = 1.0 / (ZONE_OVER_RESPONSE * response);
        let zone = BRAKING_SHARE * accel / (gain * gain);
        let (inside, outside) = (
            rate_to_rest(zone * (1.0 - 1e-9), response, accel, 1e3),
            rate_to_rest(zone * (1.0 + 1e-9), response, accel, 1e3),
        );
        assert!((inside.rate_radps - outside.rate_radps).abs() < 1e-8 * inside.rate_radps);
        assert!((inside.slope_ps - outside.slope_ps).abs() < 1e-7 * inside.slope_ps);
    }

    #[test]
    fn the_rate_is_odd_and_never_above_its_limit() {
        for error in [0.0, 1e-6, 0.01, 0.3, 3.0, 6.0] {
            let (a, b) = (rate_to_rest(error, 0.2, 0.09, 0.35), rate_to_rest(-error, 0.2, 0.09, 0.35));
            assert_eq!(a.rate_radps, -b.rate_radps);
            assert!(a.rate_radps <= 0.35);
        }
    }
}
