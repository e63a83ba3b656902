//! [`Sensor`]: every measurement of the papers, once, over any [`Vehicle`].

use super::{AXES, Measurement, Vehicle};
use crate::math::Scalar;
use crate::math::num::wrap_angle;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// Specific force along an axis (0, 1, 2) of the vehicle's triad, m/s².
    SpecificForce {
        /// The axis.
        axis: usize,
    },
    /// Pressure ρ (a + ½ c v²), Pa: dynamic with a = 0 and c = 1; stagnation with a = R T and the pressure coefficient c.
    Pressure {
        /// a, m²/s².
        static_square: f64,
        /// c.
        coefficient: f64,
    },
    /// Natural logarithm of such a pressure in Pa: linear in altitude, and noise in proportion to the reading is additive.
    LogPressure {
        /// a, m²/s².
        static_square: f64,
        /// c.
        coefficient: f64,
    },
    /// Distance from a source, m.
    Range {
        /// Where the source is, in the vehicle's position axes, m.
        source_m: [f64; AXES],
    },
    /// Rate of that distance, m/s.
    RangeRate {
        /// Where the source is, m.
        source_m: [f64; AXES],
        /// How it moves, m/s.
        source_mps: [f64; AXES],
    },
    /// A component of the state itself that is an angle, rad (P1: flight-path angle and heading, in studies only).
    Angle {
        /// Which component.
        state: usize,
    },
}

impl Quantity {
    /// Dynamic pressure ½ ρ v², Pa.
    pub const DYNAMIC_PRESSURE: Self = Self::Pressure { static_square: 0.0, coefficient: 1.0 };
    /// Its logarithm.
    pub const LOG_DYNAMIC_PRESSURE: Self = Self::LogPressure { static_square: 0.0, coefficient: 1.0 };

    /// The axis of the triad whose bias adds to it.
    #[must_use]
    pub const fn bias_axis(&self) -> Option<usize> {
        match self {
            Self::SpecificForce { axis } => Some(*axis),
            _ => None,
        }
    }
}

/// White noise of a sensor: variance = `sigma`² + (`relative` · expected)².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the unit of the quantity.
    pub sigma: f64,
    /// Standard deviation over what is measured.
    pub relative: f64,
}

impl Noise {
    /// The same everywhere.
    #[must_use]
    pub const fn of(sigma: f64) -> Self {
        Self { sigma, relative: 0.0 }
    }

    /// Variance where `expected` should be read.
    #[must_use]
    pub const fn variance(&self, expected: f64) -> f64 {
        let relative = self.relative * expected;
        self.sigma * self.sigma + relative * relative
    }
}

/// A sensor on a vehicle.
#[derive(Clone, Copy, Debug)]
pub struct Sensor<'a, M> {
    /// The vehicle.
    pub vehicle: &'a M,
    /// What is measured.
    pub quantity: Quantity,
    /// How well.
    pub noise: Noise,
}

/// What a sensor read.
#[derive(Clone, Copy, Debug)]
pub struct Reading<Z> {
    /// The sensor.
    pub sensor: Z,
    /// Its value.
    pub value: f64,
}

impl<M> Sensor<'_, M> {
    fn pressure<S: Scalar, const N: usize, const P: usize>(
        &self,
        state: &[S; N],
        parameters: &[S; P],
        static_square: f64,
        coefficient: f64,
    ) -> S
    where
        M: Vehicle<N, P>,
    {
        let air = self.vehicle.air(state, parameters);
        air.density_kgpm3 * (air.speed_square * (0.5 * coefficient) + static_square)
    }
}

fn dot<S: Scalar>(a: &[S; AXES], b: &[S; AXES]) -> S {
    let ([ax, ay, az], [bx, by, bz]) = (*a, *b);
    ax * bx + ay * by + az * bz
}

fn less<S: Scalar>(a: &[S; AXES], b: &[f64; AXES]) -> [S; AXES] {
    let ([ax, ay, az], [bx, by, bz]) = (*a, *b);
    [ax - bx, ay - by, az - bz]
}

impl<M: Vehicle<N, P>, const N: usize, const P: usize> Measurement<N, P> for Sensor<'_, M> {
    fn expected<S: Scalar>(&self, state: &[S; N], parameters: &[S; P]) -> S {
        match self.quantity {
            Quantity::SpecificForce { axis } => self.vehicle.specific_force(state, parameters, axis),
            Quantity::Pressure { static_square, coefficient } => {
                self.pressure(state, parameters, static_square, coefficient)
            }
            Quantity::LogPressure { static_square, coefficient } => {
                self.pressure(state, parameters, static_square, coefficient).ln()
            }
            Quantity::Range { source_m } => {
                let from = less(&self.vehicle.position(state), &source_m);
                dot(&from, &from).sqrt()
            }
            Quantity::RangeRate { source_m, source_mps } => {
                let from = less(&self.vehicle.position(state), &source_m);
                dot(&from, &less(&self.vehicle.velocity(state), &source_mps)) / dot(&from, &from).sqrt()
            }
            Quantity::Angle { state: index } => state.get(index).copied().unwrap_or(S::from_f64(f64::NAN)),
        }
    }

    fn variance(&self, expected: f64) -> f64 {
        self.noise.variance(expected)
    }

    fn innovation(&self, read: f64, expected: f64) -> f64 {
        let difference = read - expected;
        match self.quantity {
            // Wrapping would turn what is not finite into a zero.
            Quantity::Angle { .. } if difference.is_finite() => wrap_angle(difference),
            _ => difference,
        }
    }

    fn bias_axis(&self) -> Option<usize> {
        self.quantity.bias_axis()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{HEADING, PATH_ANGLE, Process, Spherical};
    use super::*;
    use crate::math::Dual;

    const STATE: [f64; 6] = [3_450_000.0, 5_500.0, -0.15, 0.05, 0.03, 1.4];
    const ORBITER_M: [f64; 3] = [7_855_700.0, -461_800.0, 749_820.0];
    const ORBITER_MPS: [f64; 3] = [66.2, 2_206.4, -413.0];

    fn all() -> [Quantity; 10] {
        [
            Quantity::SpecificForce { axis: 0 },
            Quantity::SpecificForce { axis: 1 },
            Quantity::SpecificForce { axis: 2 },
            Quantity::DYNAMIC_PRESSURE,
            Quantity::LOG_DYNAMIC_PRESSURE,
            Quantity::Pressure { static_square: 34e3, coefficient: 1.85 },
            Quantity::Range { source_m: ORBITER_M },
            Quantity::RangeRate { source_m: ORBITER_M, source_mps: ORBITER_MPS },
            Quantity::Angle { state: PATH_ANGLE },
            Quantity::Angle { state: HEADING },
        ]
    }

    #[test]
    fn derivatives_of_every_measurement_agree_with_differences() {
        let vehicle = Spherical::MARS.banked(0.9);
        let steps = [1.0, 0.1, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5];
        for quantity in all() {
            let sensor = Sensor { vehicle: &vehicle, quantity, noise: Noise::of(1.0) };
            let seeded: [Dual<8>; 6] = core::array::from_fn(|i| Dual::variable(STATE[i], i));
            let exact = sensor.expected(&seeded, &[Dual::variable(0.1, 6), Dual::variable(0.2, 7)]);
            for j in 0..8 {
                let at = |by: f64| {
                    let (mut x, mut alpha) = (STATE, [0.1, 0.2]);
                    if j < 6 {
                        x[j] += by
                    } else {
                        alpha[j - 6] += by
                    }
                    sensor.expected(&x, &alpha)
                };
                let difference = (at(steps[j]) - at(-steps[j])) / (2.0 * steps[j]);
                // Rounding of the value over the step, and truncation by the third derivative.
                let tolerance = 1e-7 * exact.partials[j].abs() + 1e-14 * exact.value.abs() / steps[j];
                assert!((exact.partials[j] - difference).abs() <= tolerance, "{quantity:?} {j}: {difference}");
            }
        }
    }

    #[test]
    fn range_rate_is_the_rate_of_the_range() {
        let vehicle = Spherical::MARS;
        let range = |t: f64| {
            let state = vehicle.step(&STATE, &[0.0; 2], t);
            let source_m = core::array::from_fn(|i| ORBITER_M[i] + t * ORBITER_MPS[i]);
            let sensor = Sensor { vehicle: &vehicle, quantity: Quantity::Range { source_m }, noise: Noise::of(1.0) };
            Measurement::<6, 2>::expected(&sensor, &state, &[0.0; 2])
        };
        let quantity = Quantity::RangeRate { source_m: ORBITER_M, source_mps: ORBITER_MPS };
        let rate: f64 = Sensor { vehicle: &vehicle, quantity, noise: Noise::of(1.0) }.expected(&STATE, &[0.0; 2]);
        // Third derivatives of some 0.1 m/s³ over 1e-4 s, rounding of 5e6 m over it.
        assert!((rate - (range(0.01) - range(-0.01)) / 0.02).abs() < 1e-4, "{rate}");
    }

    #[test]
    fn the_accelerometer_feels_lift_to_the_right_as_negative_left() {
        let vehicle = Spherical::MARS.banked(0.9);
        let [x, y, z] = [0, 1, 2].map(|axis| vehicle.specific_force(&STATE, &[0.0; 2], axis));
        assert!(x < 0.0 && y < 0.0 && z > 0.0);
        assert!((y / z + 0.9_f64.tan()).abs() < 1e-12 && (f64::hypot(y, z) / x + 0.156).abs() < 1e-12);
    }

    #[test]
    fn an_angle_across_the_turn_is_a_small_innovation() {
        let vehicle = Spherical::MARS;
        let of = |quantity| Sensor { vehicle: &vehicle, quantity, noise: Noise::of(1.0) };
        let innovation = Measurement::<6, 2>::innovation(&of(Quantity::Angle { state: HEADING }), 3.1, -3.1);
        assert!((innovation - (6.2 - 2.0 * core::f64::consts::PI)).abs() < 1e-12);
        assert!(
            Measurement::<6, 2>::innovation(&of(Quantity::Angle { state: HEADING }), f64::INFINITY, 0.0).is_infinite()
        );
        assert!((Measurement::<6, 2>::innovation(&of(Quantity::DYNAMIC_PRESSURE), 9.0, 1.0) - 8.0).abs() < 1e-15);
    }

    #[test]
    fn noise_in_proportion_grows_with_the_reading() {
        let vehicle = Spherical::MARS;
        let noise = Noise { sigma: 10.0, relative: 0.01 };
        let sensor = Sensor { vehicle: &vehicle, quantity: Quantity::DYNAMIC_PRESSURE, noise };
        let variance = Measurement::<6, 2>::variance(&sensor, 2_000.0);
        assert!((variance - 500.0).abs() < 1e-9);
    }
}
