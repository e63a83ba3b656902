//! [`Near`]: the onboard model about one short step of the vehicle, to first order: all that the linearised filters in flight
//! ask of it, from one evaluation of the equations of motion with derivatives, at the middle of the step.
//!
//! With J the Jacobian of the rates there, the step's is I + hJ + (hJ)²/2, wrong by (hJ)³/6: some 1e-9 in a tenth of a
//! second. Differentiating all four stages of the Runge–Kutta step instead would cost four times as much.
#![allow(clippy::indexing_slicing, reason = "indices are below the const dimensions of the arrays they index")]
#![allow(clippy::needless_range_loop, reason = "row and column indices are used together")]

use super::onboard::Onboard;
use super::{AXES, Process, Quantity};
use crate::math::Dual;
use crate::math::fun::{exp, ln, sqrt};
use crate::model::gravity;

/// Position and velocity.
const STATES: usize = 6;
/// State, log-density and relative lift error.
pub const WIDTH: usize = STATES + 2;
/// Derivatives found in one pass through the model; see [`Joint`](crate::nav::estimators::joint::Joint).
const LANES: usize = 4;

/// A number near a place, and its derivatives by state and parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// The value.
    pub value: f64,
    /// Derivatives.
    pub row: [f64; WIDTH],
}

impl Line {
    const ZERO: Self = Self { value: 0.0, row: [0.0; WIDTH] };
}

/// The vehicle about a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Near {
    next: [f64; STATES],
    rows: [[f64; WIDTH]; STATES],
    /// Middle of the step: state and parameters.
    middle: [f64; WIDTH],
    /// Inertial acceleration there.
    acceleration_mps2: [f64; AXES],
    /// Specific force along the body axes.
    force: [Line; AXES],
    /// Logarithm of the density, kg/m³.
    log_density: Line,
    spin_radps: f64,
}

impl Near {
    /// Nowhere; all zero bytes.
    pub const NONE: Self = Self {
        next: [0.0; STATES],
        rows: [[0.0; WIDTH]; STATES],
        middle: [0.0; WIDTH],
        acceleration_mps2: [0.0; AXES],
        force: [Line::ZERO; AXES],
        log_density: Line::ZERO,
        spin_radps: 0.0,
    };

    /// Becomes the vehicle about the step of `step_s` that begins at `state`.
    #[inline(never)]
    pub fn move_to(&mut self, vehicle: &Onboard<'_>, state: &[f64; STATES], parameters: &[f64; 2], step_s: f64) {
        self.next = vehicle.step(state, parameters, step_s);
        self.spin_radps = vehicle.spin_radps();
        let [log_density, lift] = *parameters;
        self.middle = [0.0; WIDTH];
        for k in 0..AXES {
            let (v0, v1) = (state[AXES + k], self.next[AXES + k]);
            // Exact for a constant acceleration.
            self.middle[k] = 0.5 * (state[k] + self.next[k]) - 0.125 * step_s * (v1 - v0);
            self.middle[AXES + k] = 0.5 * (v0 + v1);
        }
        [self.middle[STATES], self.middle[STATES + 1]] = [log_density, lift];
        let by = self.differentiate(vehicle);
        self.integrate(&by, step_s);
    }

    /// Forces, density and acceleration at the middle; gives the derivatives of the acceleration.
    fn differentiate(&mut self, vehicle: &Onboard<'_>) -> [[f64; WIDTH]; AXES] {
        let mut felt = [Line::ZERO; AXES];
        for first in (0..WIDTH).step_by(LANES) {
            let all: [Dual<LANES>; WIDTH] = core::array::from_fn(|i| match i.checked_sub(first) {
                Some(lane) => Dual::variable(self.middle[i], lane),
                None => Dual::constant(self.middle[i]),
            });
            let [x, y, z, vx, vy, vz, log_density, lift] = all;
            let (force, air) = vehicle.force_and_air(&[x, y, z, vx, vy, vz], &[log_density, lift]);
            for (felt, force) in felt.iter_mut().zip(&force) {
                felt.value = force.value;
                felt.row[first..first + LANES].copy_from_slice(&force.partials);
            }
            let inverse = 1.0 / air.density_kgpm3.value;
            self.log_density.value = ln(air.density_kgpm3.value);
            for (lane, partial) in air.density_kgpm3.partials.iter().enumerate() {
                self.log_density.row[first + lane] = partial * inverse;
            }
        }
        for (line, axis) in self.force.iter_mut().zip(vehicle.body_axes()) {
            let along = |of: &dyn Fn(&Line) -> f64| (0..AXES).map(|k| axis[k] * of(&felt[k])).sum();
            *line =
                Line { value: along(&|felt| felt.value), row: core::array::from_fn(|j| along(&|felt| felt.row[j])) };
        }
        self.add_gravity(vehicle, &felt)
    }

    fn add_gravity(&mut self, vehicle: &Onboard<'_>, felt: &[Line; AXES]) -> [[f64; WIDTH]; AXES] {
        let [x, y, z, ..] = self.middle;
        let planet = vehicle.planet();
        let pull = gravity::acceleration(planet, &[x, y, z]);
        let gradient = gravity::gradient(planet, &[x, y, z]);
        let mut by = [[0.0; WIDTH]; AXES];
        for k in 0..AXES {
            self.acceleration_mps2[k] = felt[k].value + pull[k];
            by[k] = felt[k].row;
            for j in 0..AXES {
                by[k][j] += gradient[(k, j)];
            }
        }
        by
    }

    /// The derivatives of the step.
    fn integrate(&mut self, by: &[[f64; WIDTH]; AXES], h: f64) {
        let half_square = 0.5 * h * h;
        for k in 0..AXES {
            for j in 0..WIDTH {
                // Second row of J²: (∂a/∂v)·(∂a/∂·), and ∂a/∂r carried by the velocity.
                let mut twice: f64 = (0..AXES).map(|m| by[k][AXES + m] * by[m][j]).sum();
                if (AXES..STATES).contains(&j) {
                    twice += by[k][j - AXES];
                }
                self.rows[k][j] = half_square * by[k][j];
                self.rows[AXES + k][j] = h * by[k][j] + half_square * twice;
            }
            self.rows[k][k] += 1.0;
            self.rows[k][AXES + k] += h;
            self.rows[AXES + k][AXES + k] += 1.0;
        }
    }

    /// The state after the step.
    #[must_use]
    pub const fn next(&self) -> &[f64; STATES] {
        &self.next
    }

    /// Its derivatives by state and parameters before the step.
    #[must_use]
    pub const fn rows(&self) -> &[[f64; WIDTH]; STATES] {
        &self.rows
    }

    /// What a sensor should have read `age_s` before the vehicle came to `state`, the end of the step or near it, with
    /// derivatives by that state and the parameters. Not a number for an axis or a quantity that there is not.
    #[inline(never)]
    #[must_use]
    pub fn see(&self, quantity: &Quantity, age_s: f64, state: &[f64; STATES], parameters: &[f64; 2]) -> Line {
        let mut then = [0.0; WIDTH];
        for k in 0..AXES {
            let a = self.acceleration_mps2[k];
            then[k] = state[k] - age_s * state[AXES + k] + 0.5 * age_s * age_s * a;
            then[AXES + k] = state[AXES + k] - age_s * a;
        }
        [then[STATES], then[STATES + 1]] = *parameters;
        let mut line = match *quantity {
            Quantity::SpecificForce { axis } => match self.force.get(axis) {
                Some(force) => self.along(force, &then),
                None => Line { value: f64::NAN, ..Line::ZERO },
            },
            Quantity::Pressure { static_square, coefficient } => {
                let log = self.log_pressure(&then, static_square, coefficient);
                let value = exp(log.value);
                Line { value, row: log.row.map(|partial| value * partial) }
            }
            Quantity::LogPressure { static_square, coefficient } => {
                self.log_pressure(&then, static_square, coefficient)
            }
            Quantity::Range { source_m } => range(&then, &source_m),
            Quantity::RangeRate { source_m, source_mps } => range_rate(&then, &source_m, &source_mps),
            Quantity::Angle { .. } => Line { value: f64::NAN, ..Line::ZERO },
        };
        // What the velocity changes, it changes of the position then, too.
        for k in 0..AXES {
            line.row[AXES + k] -= age_s * line.row[k];
        }
        line
    }

    /// A line followed from the middle of the step.
    fn along(&self, line: &Line, then: &[f64; WIDTH]) -> Line {
        let moved = line.row.iter().zip(then.iter().zip(&self.middle));
        Line { value: line.value + moved.map(|(slope, (x, x0))| slope * (x - x0)).sum::<f64>(), row: line.row }
    }

    /// ln ρ + ln(a + ½ c v²).
    fn log_pressure(&self, then: &[f64; WIDTH], static_square: f64, coefficient: f64) -> Line {
        let [x, y, _, vx, vy, vz, ..] = *then;
        let spin = self.spin_radps;
        let (ux, uy) = (vx + spin * y, vy - spin * x);
        let square = static_square + 0.5 * coefficient * (ux * ux + uy * uy + vz * vz);
        let mut line = self.along(&self.log_density, then);
        line.value += ln(square);
        let along = coefficient / square;
        let by_velocity = [along * ux, along * uy, along * vz];
        for k in 0..AXES {
            line.row[AXES + k] += by_velocity[k];
        }
        line.row[0] -= spin * by_velocity[1];
        line.row[1] += spin * by_velocity[0];
        line
    }
}

/// Distance from a source.
fn range(then: &[f64; WIDTH], source_m: &[f64; AXES]) -> Line {
    let from: [f64; AXES] = core::array::from_fn(|k| then[k] - source_m[k]);
    let value = sqrt(from.iter().map(|d| d * d).sum());
    let mut line = Line { value, ..Line::ZERO };
    for k in 0..AXES {
        line.row[k] = from[k] / value;
    }
    line
}

/// Its rate.
fn range_rate(then: &[f64; WIDTH], source_m: &[f64; AXES], source_mps: &[f64; AXES]) -> Line {
    let distance = range(then, source_m);
    let relative: [f64; AXES] = core::array::from_fn(|k| then[AXES + k] - source_mps[k]);
    let value = (0..AXES).map(|k| distance.row[k] * relative[k]).sum();
    let mut line = Line { value, ..Line::ZERO };
    for k in 0..AXES {
        line.row[k] = (relative[k] - value * distance.row[k]) / distance.value;
        line.row[AXES + k] = distance.row[k];
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::model::OnboardModel;
    use crate::nav::estimators::models::{Earlier, Measurement, Noise, Sensor};
    use proptest::prelude::*;

    const AXES_TURNED: [[f64; 3]; 3] = [[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]];
    const SOURCE_M: [f64; 3] = [3.9e6, 4.0e5, -2.0e5];
    const SOURCE_MPS: [f64; 3] = [100.0, 2_900.0, 900.0];
    const H: f64 = 0.1;

    fn onboard() -> OnboardModel {
        let c = Config::DEFAULT;
        OnboardModel::new(c.planet, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    /// From 12 km on, at any speed that an entry has there: a drag of some hundreds of m/s² at most.
    fn flight() -> impl Strategy<Value = ([f64; 6], f64, [f64; 2])> {
        let position = (3.41e6..3.5e6f64, -1.2..1.2f64, -3.0..3.0f64)
            .prop_map(|(r, lat, lon)| [r * lat.cos() * lon.cos(), r * lat.cos() * lon.sin(), r * lat.sin()]);
        let direction = (-1.0..1.0f64, -3.0..3.0f64, 0.1..1.0f64);
        (position, direction, -3.0..3.0f64, prop::array::uniform2(-0.3..0.3f64)).prop_map(
            |([x, y, z], (sine, turn, share), bank, alpha)| {
                let altitude = (x * x + y * y + z * z).sqrt() - 3_397_200.0;
                let speed = share * (5_800.0f64).min(600.0 * (altitude / 2.0 / 11_000.0).exp());
                let cosine = (1.0 - sine * sine).sqrt();
                ([x, y, z, speed * cosine * turn.cos(), speed * cosine * turn.sin(), speed * sine], bank, alpha)
            },
        )
    }

    fn seeds(values: &[f64]) -> Vec<Dual<WIDTH>> {
        values.iter().enumerate().map(|(i, v)| Dual::variable(*v, i)).collect()
    }
    use std::vec::Vec;

    fn seeded(x: &[f64; 6], alpha: &[f64; 2]) -> ([Dual<WIDTH>; 6], [Dual<WIDTH>; 2]) {
        let all = seeds(&[&x[..], &alpha[..]].concat());
        (core::array::from_fn(|i| all[i]), [all[6], all[7]])
    }

    proptest! {
        #[test]
        fn the_step_is_that_of_the_model_and_so_are_its_derivatives((x, bank, alpha) in flight()) {
            let model = onboard();
            let vehicle = Onboard::new(&model, (bank.cos(), bank.sin()), AXES_TURNED);
            let mut near = Near::NONE;
            near.move_to(&vehicle, &x, &alpha, H);
            prop_assert_eq!(near.next(), &vehicle.step(&x, &alpha, H));
            let (state, parameters) = seeded(&x, &alpha);
            let exact = vehicle.step(&state, &parameters, H);
            let a = vehicle.total_acceleration(&x, &alpha);
            let size = a.iter().map(|a| a * a).sum::<f64>().sqrt();
            // An entry's drag changes by a hundredth in a step: the derivatives are as good as 1e-4 of what they say.
            for i in 0..6 {
                for j in 0..WIDTH {
                    let of = if i < 3 { 0.5 * H * H } else { H };
                    let scale = of * size * if j < 3 { 1e-4 } else if j < 6 { 4e-3 } else { 1.0 } + 1e-9;
                    let (found, exact) = (near.rows()[i][j], exact[i].partials[j]);
                    prop_assert!((found - exact).abs() < 2e-2 * scale, "{i} {j}: {found} {exact}");
                }
            }
        }

        #[test]
        fn sensors_read_what_they_read_of_the_model((x, bank, alpha) in flight(), age_s in 0.0..0.1f64) {
            let model = onboard();
            let vehicle = Onboard::new(&model, (bank.cos(), bank.sin()), AXES_TURNED);
            let mut near = Near::NONE;
            near.move_to(&vehicle, &x, &alpha, H);
            let acceleration_mps2 = near.acceleration_mps2;
            let earlier = Earlier { vehicle: &vehicle, age_s, acceleration_mps2 };
            let (state, parameters) = seeded(near.next(), &alpha);
            let size = 1.0 + acceleration_mps2.iter().map(|a| a.abs()).sum::<f64>();
            let force = |axis| (Quantity::SpecificForce { axis }, size);
            for (quantity, size) in [
                force(0),
                force(1),
                force(2),
                (Quantity::LogPressure { static_square: 3.4e4, coefficient: 1.85 }, 1.0),
                (Quantity::Range { source_m: SOURCE_M }, 1e-3),
                (Quantity::RangeRate { source_m: SOURCE_M, source_mps: SOURCE_MPS }, 1e-3),
            ] {
                let sensor = Sensor { vehicle: &earlier, quantity, noise: Noise::of(1.0) };
                let exact: Dual<WIDTH> = sensor.expected(&state, &parameters);
                let found = near.see(&quantity, age_s, near.next(), &alpha);
                // Followed over at most half a step, in which the density changes by a hundredth and more.
                prop_assert!((found.value - exact.value).abs() < 1e-3 * size, "{quantity:?}: {} {}", found.value, exact.value);
                for j in 0..WIDTH {
                    let scale = size * if j < 3 { 1e-4 } else if j < 6 { 4e-3 } else { 1.0 } + 1e-9;
                    let (found, exact) = (found.row[j], exact.partials[j]);
                    prop_assert!((found - exact).abs() < 3e-2 * scale, "{quantity:?} {j}: {found} {exact}");
                }
            }
        }
    }

    #[test]
    fn what_there_is_not_reads_no_number() {
        let model = onboard();
        let vehicle = Onboard::new(&model, (1.0, 0.0), AXES_TURNED);
        let mut near = Near::NONE;
        near.move_to(&vehicle, &[3.45e6, 0.0, 0.0, -500.0, 4e3, 0.0], &[0.0; 2], H);
        for quantity in [Quantity::SpecificForce { axis: 3 }, Quantity::Angle { state: 0 }] {
            assert!(near.see(&quantity, 0.0, near.next(), &[0.0; 2]).value.is_nan());
        }
    }
}
