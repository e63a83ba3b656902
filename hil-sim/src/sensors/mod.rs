//! Sensors: what the truth looks like through biases, scale errors, noise, counts and limits.
//!
//! Errors that stay the same over a flight are plain fields, drawn by [`crate::dispersion`] or set to zero; white noise
//! comes from one stream per sensor.

mod faults;
mod imu;
mod pressure;
mod radio;

pub use faults::SensorFaults;
pub use imu::{ImuErrors, ImuSensor};
pub use pressure::{PressureErrors, PressureSensor, stagnation_pressure_pa};
pub use radio::{Blackout, RadioErrors, RadioSensor};

/// Period of a sensor in minor frames; a rate of zero or less means never.
#[must_use]
pub fn period_frames(rate_hz: f64) -> Option<u32> {
    if rate_hz > 0.0 && rate_hz.is_finite() {
        Some((f64::from(fsw_core::time::FRAMES_PER_SECOND) / rate_hz).round().clamp(1.0, 1e9) as u32)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn rates_become_whole_frames() {
        assert_eq!(super::period_frames(10.0), Some(5));
        assert_eq!(super::period_frames(1.0), Some(50));
        assert_eq!(super::period_frames(500.0), Some(1));
        assert_eq!(super::period_frames(0.0), None);
        assert_eq!(super::period_frames(f64::NAN), None);
    }
}
