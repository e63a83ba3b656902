//! One run of the experiment: true states, what the sensors read and where the filters start, the same for every filter.

use alloc::vec::Vec;

use fsw_core::math::{fun, rk4};
use fsw_core::nav::estimators::models::{Measurement, Noise, Process, Quantity, Reading, Sensor, Spherical};
use hil_noise::Stream;

use super::config::{Config, PARAMETERS, STATES};
use crate::rate::steps_between;

/// Scalars that are measured in every step.
pub const SENSED: usize = 5;

/// What is measured after each step, with its noise: the orbiter moves.
pub struct Suite {
    /// Steps from one reading to the next.
    every: usize,
    steps: Vec<[(Quantity, Noise); SENSED]>,
}

impl Suite {
    /// The sensors of a configuration.
    #[must_use]
    pub fn new(config: &Config) -> Self {
        let sensors = &config.sensors;
        let ([x, y, z], [vx, vy, vz]) = (sensors.orbiter_km.map(|km| km * 1e3), sensors.orbiter_mps);
        let mut orbiter = [x, y, z, vx, vy, vz];
        let force = Noise::of(sensors.accelerometer_mps2);
        let pressure = Noise { sigma: sensors.pressure_pa, relative: sensors.pressure_relative };
        let after_a_step = |_| {
            orbiter = rk4(&orbiter, config.experiment.step_s, |_, state| two_body(state));
            let [x, y, z, ..] = orbiter;
            [
                (Quantity::SpecificForce { axis: 0 }, force),
                (Quantity::SpecificForce { axis: 1 }, force),
                (Quantity::SpecificForce { axis: 2 }, force),
                (Quantity::DYNAMIC_PRESSURE, pressure),
                (Quantity::Range { source_m: [x, y, z] }, Noise::of(sensors.range_m)),
            ]
        };
        let every = steps_between(sensors.rate_hz, config.experiment.step_s);
        Self { every, steps: (0..config.steps()).map(after_a_step).collect() }
    }

    /// How many of the readings after a step, counted from 0, are there: all, or none between two readings.
    #[must_use]
    pub fn count(&self, step: usize) -> usize {
        if (step + 1).is_multiple_of(self.every) { SENSED } else { 0 }
    }

    /// The sensors after each step, with what they read, or would; a filter may believe another noise, `factor` times it for
    /// accelerations and pressure.
    pub fn read<'a>(
        &'a self,
        vehicle: &'a Spherical,
        draw: &'a Draw,
        factor: f64,
    ) -> impl Iterator<Item = [Reading<Sensor<'a, Spherical>>; SENSED]> {
        self.steps.iter().zip(&draw.readings).map(move |(sensors, values)| {
            let mut values = values.iter();
            sensors.map(|(quantity, noise)| {
                let factor = if matches!(quantity, Quantity::Range { .. }) { 1.0 } else { factor };
                let noise = Noise { sigma: noise.sigma * factor, relative: noise.relative * factor };
                let value = values.next().copied().unwrap_or(f64::NAN);
                Reading { sensor: Sensor { vehicle, quantity, noise }, value }
            })
        })
    }
}

fn two_body(&[x, y, z, vx, vy, vz]: &[f64; 6]) -> [f64; 6] {
    let square = x * x + y * y + z * z;
    let pull = -Spherical::MARS.mu_m3ps2 / (square * fun::sqrt(square));
    [vx, vy, vz, pull * x, pull * y, pull * z]
}

/// A run.
pub struct Draw {
    /// Where the filters start.
    pub initial: [f64; STATES],
    /// True states, the first after one step.
    pub truth: Vec<[f64; STATES]>,
    /// Readings after each step.
    pub readings: Vec<[f64; SENSED]>,
}

impl Draw {
    /// Run `run` of a seed.
    #[must_use]
    pub fn new(config: &Config, suite: &Suite, seed: u64, run: u64) -> Self {
        let [mut start, mut process, mut noise] =
            ["ddf start", "ddf process", "ddf sensors"].map(|purpose| Stream::new(seed, run, purpose));
        let model = config.model();
        let alpha: [f64; PARAMETERS] = [config.truth.density_error, config.truth.lift_error];
        let mut state = config.start();
        let mut draw = Self { initial: state, truth: Vec::new(), readings: Vec::new() };
        draw.initial.iter_mut().zip(config.initial_sigmas()).for_each(|(x, sigma)| *x += sigma * start.normal());
        for sensors in &suite.steps {
            state = model.step(&state, &alpha, config.experiment.step_s);
            state.iter_mut().zip(config.step_noise()).for_each(|(x, sigma)| *x += sigma * process.normal());
            draw.truth.push(state);
            draw.readings.push(sensors.map(|(quantity, spread)| {
                let sensor = Sensor { vehicle: &model, quantity, noise: spread };
                let expected = sensor.expected(&state, &alpha);
                let bias = match quantity {
                    Quantity::SpecificForce { .. } => config.sensors.accelerometer_bias_mps2,
                    _ => 0.0,
                };
                let variance = Measurement::<STATES, PARAMETERS>::variance(&sensor, expected);
                expected + bias + fun::sqrt(variance) * noise.normal()
            }));
        }
        draw
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_come_after_a_whole_number_of_steps() {
        let counts = |rate_hz| {
            let mut config = Config::default();
            config.sensors.rate_hz = rate_hz;
            let suite = Suite::new(&config);
            (0..10).map(|step| suite.count(step)).collect::<Vec<_>>()
        };
        assert_eq!(counts(None), [SENSED; 10]);
        assert_eq!(counts(Some(5.0)), [SENSED; 10]);
        assert_eq!(counts(Some(1.0)), [0, 0, 0, 0, SENSED, 0, 0, 0, 0, SENSED]);
    }

    #[test]
    fn a_run_is_the_same_whenever_it_is_drawn_and_no_other() {
        let config = Config::default();
        let suite = Suite::new(&config);
        let (a, b, c) =
            (Draw::new(&config, &suite, 3, 7), Draw::new(&config, &suite, 3, 7), Draw::new(&config, &suite, 3, 8));
        assert_eq!((&a.truth, &a.readings, a.initial), (&b.truth, &b.readings, b.initial));
        assert!(a.truth != c.truth && a.readings != c.readings && a.initial != c.initial);
    }

    #[test]
    fn the_flight_is_an_entry_that_slows_down_above_the_ground() {
        let config = Config::default();
        let draw = Draw::new(&config, &Suite::new(&config), 1, 0);
        let last = draw.truth.last().unwrap();
        let altitude_km = (last[0] - super::super::config::SURFACE_M) * 1e-3;
        assert_eq!((draw.truth.len(), draw.readings.len()), (2_000, 2_000));
        assert!((3.0..40.0).contains(&altitude_km) && last[1] < 1_500.0, "{altitude_km} {}", last[1]);
    }

    #[test]
    fn a_filter_may_believe_another_noise_of_all_but_the_range() {
        let config = Config::default();
        let suite = Suite::new(&config);
        let draw = Draw::new(&config, &suite, 1, 0);
        let model = config.model();
        let believed = suite.read(&model, &draw, 10.0).next().unwrap();
        assert!((believed[0].sensor.noise.sigma - 0.5).abs() < 1e-12);
        assert!((believed[3].sensor.noise.relative - 0.1).abs() < 1e-12);
        assert!((believed[4].sensor.noise.sigma - 50.0).abs() < 1e-12);
        assert!((believed[4].value - draw.readings[0][4]).abs() < 1e-12);
    }
}
