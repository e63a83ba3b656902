//! Stagnation pressure port.

use fsw_core::link::packet::Pressure;
use fsw_core::planet::{PITOT_COEFFICIENT, PITOT_MACH_STEP};

use crate::noise::Stream;

/// Errors of the sensor in one flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressureErrors {
    /// Scale error, fraction.
    pub scale: f64,
    /// Offset, Pa.
    pub offset_pa: f64,
    /// White noise, 1σ, fraction of the reading.
    pub noise: f64,
}

impl PressureErrors {
    /// A perfect sensor.
    pub const PERFECT: Self = Self { scale: 0.0, offset_pa: 0.0, noise: 0.0 };
}

/// The sensor.
#[derive(Clone, Debug)]
pub struct PressureSensor {
    errors: PressureErrors,
    noise: Stream,
}

impl PressureSensor {
    /// A sensor with the errors of one flight.
    #[must_use]
    pub fn new(errors: PressureErrors, noise: Stream) -> Self {
        Self { errors, noise }
    }

    /// The packet for a true stagnation pressure. The port reads no less than zero.
    pub fn measure(&mut self, stagnation_pa: f64) -> Pressure {
        let e = &self.errors;
        let white = 1.0 + e.noise * self.noise.normal();
        let reading = (stagnation_pa * (1.0 + e.scale) * white + e.offset_pa).max(0.0);
        Pressure { stagnation_pa: reading as f32, status: 0 }
    }
}

/// What a port at the stagnation point feels, Pa: p_t = p∞ + C_p,max(M)·q with p∞ = ρ R T.
///
/// C_p,max comes from the shared table [`PITOT_COEFFICIENT`]: linear between its nodes, constant above the last.
#[must_use]
pub fn stagnation_pressure_pa(static_pa: f64, dynamic_pa: f64, mach: f64) -> f64 {
    let last = PITOT_COEFFICIENT.len() - 1;
    let position = (mach / PITOT_MACH_STEP).clamp(0.0, last as f64);
    let node = (position as usize).min(last - 1);
    let (low, high) = (PITOT_COEFFICIENT[node], PITOT_COEFFICIENT[node + 1]);
    static_pa + (low + (position - node as f64) * (high - low)) * dynamic_pa
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rayleigh's pitot formula (isentropic below Mach 1), normalised to a coefficient of 1.85 at Mach 5.
    fn rayleigh_coefficient(mach: f64) -> f64 {
        let (g, m2) = (1.3f64, mach * mach);
        let ratio = if mach <= 1.0 {
            (1.0 + 0.5 * (g - 1.0) * m2).powf(g / (g - 1.0))
        } else {
            let compression = (0.5 * (g + 1.0) * m2).powf(g / (g - 1.0));
            compression * ((g + 1.0) / (2.0 * g * m2 - (g - 1.0))).powf(1.0 / (g - 1.0))
        };
        (ratio - 1.0) * 2.0 / (g * m2)
    }

    #[test]
    fn the_coefficient_follows_the_pitot_formula() {
        let factor = 1.85 / rayleigh_coefficient(5.0);
        for mach in [0.5, 0.9, 1.3, 1.6, 2.2, 3.1, 4.6, 5.0] {
            let exact = 100.0 + rayleigh_coefficient(mach) * factor * 700.0;
            let ratio = stagnation_pressure_pa(100.0, 700.0, mach) / exact;
            // The table is linear over 0.25 in Mach: worst about Mach 1.
            assert!((ratio - 1.0).abs() < 6e-3, "Mach {mach}: {ratio}");
        }
        assert_eq!(stagnation_pressure_pa(1.0, 1000.0, 28.0), 1851.0);
    }

    #[test]
    fn a_reading_carries_scale_and_offset_and_never_falls_below_zero() {
        let errors = PressureErrors { scale: 0.02, offset_pa: -15.0, noise: 0.0 };
        let mut port = PressureSensor::new(errors, Stream::new(1, 1, "pressure noise"));
        assert_eq!(port.measure(1000.0).stagnation_pa, 1005.0);
        assert_eq!(port.measure(3.0).stagnation_pa, 0.0);
    }
}
