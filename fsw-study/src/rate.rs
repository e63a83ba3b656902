//! Readings that come less often than steps.

use fsw_core::math::fun;

/// Steps from one reading to the next.
#[must_use]
pub fn steps_between(rate_hz: Option<f64>, step_s: f64) -> usize {
    let between = rate_hz.map_or(1.0, |rate_hz| 1.0 / (rate_hz * step_s));
    fun::round(between).max(1.0) as usize
}
