//! One run of the experiment: true states and what the sensors read, the same for every filter.

use alloc::vec::Vec;

use fsw_core::math::{fun, rk4};
use fsw_core::nav::estimators::models::{
    HEADING, Measurement, Noise, PATH_ANGLE, Process, Quantity, Sensor, Spherical,
};
use fsw_core::units::rad;
use hil_noise::Stream;

use super::STATES;
use super::config::Config;

/// Axes of the accelerometer.
const AXES: usize = 3;

/// What is measured in every step, in this order, with the standard deviations of the noise.
pub struct Suite {
    /// One list for each step from 1 on: the orbiter moves.
    steps: Vec<Vec<(Quantity, f64)>>,
}

impl Suite {
    /// The sensors of a configuration, with their noise times `noise_factor`.
    #[must_use]
    pub fn new(config: &Config, noise_factor: f64) -> Self {
        let sensors = &config.sensors;
        let step_s = config.experiment.step_s;
        let mut orbiter = [0.0; STATES];
        for (at, value) in
            orbiter.iter_mut().zip(sensors.orbiter_km.iter().map(|km| km * 1e3).chain(sensors.orbiter_mps))
        {
            *at = value;
        }
        let steps = (0..config.steps()).map(|index| {
            orbiter = rk4(&orbiter, step_s, |_, state| two_body(state));
            if (index + 1) % config.steps_per_reading() != 0 {
                return Vec::new();
            }
            let [x, y, z, ..] = orbiter;
            let beacons = sensors.beacons_km.iter().map(|km| km.map(|x| x * 1e3));
            let ranges = core::iter::once([x, y, z]).chain(beacons);
            let forces = (0..AXES).map(|axis| (Quantity::SpecificForce { axis }, sensors.accelerometer_mps2));
            let ranges = ranges.map(|source_m| (Quantity::Range { source_m }, sensors.range_m));
            let angle = rad(sensors.angle_deg);
            let angles = [PATH_ANGLE, HEADING].map(|state| (Quantity::Angle { state }, angle));
            forces.chain(ranges).chain(angles).map(|(what, sigma)| (what, sigma * noise_factor)).collect()
        });
        Self { steps: steps.collect() }
    }

    /// What is measured at the end of step `index` (from 0); nothing between two readings.
    #[must_use]
    pub fn at(&self, index: usize) -> &[(Quantity, f64)] {
        self.steps.get(index).map_or(&[], Vec::as_slice)
    }
}

fn two_body(&[x, y, z, vx, vy, vz]: &[f64; STATES]) -> [f64; STATES] {
    let square = x * x + y * y + z * z;
    let pull = -Spherical::MARS.mu_m3ps2 / (square * fun::sqrt(square));
    [vx, vy, vz, pull * x, pull * y, pull * z]
}

/// True states and readings after each step.
pub struct Draw {
    /// States, the first after one step.
    pub truth: Vec<[f64; STATES]>,
    /// Readings in the order of the suite.
    pub readings: Vec<Vec<f64>>,
}

impl Draw {
    /// Run `run` of a seed.
    #[must_use]
    pub fn new(config: &Config, suite: &Suite, seed: u64, run: u64) -> Self {
        let model = config.truth.model(config.experiment.bank_deg);
        let (mut process, mut sensors) =
            (Stream::new(seed, run, "sekf process"), Stream::new(seed, run, "sekf sensors"));
        let step_s = config.experiment.step_s;
        let mut state = config.truth.state();
        let mut draw = Self { truth: Vec::new(), readings: Vec::new() };
        for index in 0..config.steps() {
            let alpha = config.input.alpha(index as f64 * step_s);
            state = model.step(&state, &[0.0; 2], step_s);
            let pushes = config.input.amplitude.iter().zip(&config.experiment.process_noise);
            for (x, (amplitude, sigma)) in state.iter_mut().zip(pushes) {
                *x += amplitude * alpha * step_s + sigma * fun::sqrt(step_s) * process.normal();
            }
            draw.truth.push(state);
            draw.readings.push(
                suite
                    .at(index)
                    .iter()
                    .map(|(what, sigma)| {
                        let sensor = Sensor { vehicle: &model, quantity: *what, noise: Noise::of(*sigma) };
                        let bias = match what {
                            Quantity::SpecificForce { .. } => config.sensors.accelerometer_bias_mps2,
                            _ => 0.0,
                        };
                        sensor.expected(&state, &[0.0; 2]) + bias + sigma * sensors.normal()
                    })
                    .collect(),
            );
        }
        draw
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_the_same_whenever_it_is_drawn_and_noise_scales_without_moving_the_truth() {
        let config = Config::default();
        let (loud, quiet) = (Suite::new(&config, 1.0), Suite::new(&config, 0.1));
        let (a, b, c) =
            (Draw::new(&config, &loud, 3, 7), Draw::new(&config, &loud, 3, 7), Draw::new(&config, &quiet, 3, 7));
        assert_eq!((&a.truth, &a.readings), (&b.truth, &b.readings));
        assert_eq!(a.truth, c.truth);
        assert_ne!(a.readings, c.readings);
        assert_ne!(a.truth, Draw::new(&config, &loud, 3, 8).truth);
    }

    #[test]
    fn between_two_readings_nothing_is_measured() {
        let mut config = Config::default();
        config.sensors.rate_hz = Some(0.25);
        let draw = Draw::new(&config, &Suite::new(&config, 1.0), 1, 0);
        let counts: Vec<usize> = draw.readings.iter().take(8).map(Vec::len).collect();
        assert_eq!(counts, [0, 0, 0, 8, 0, 0, 0, 8]);
    }

    #[test]
    fn the_flight_ends_where_the_paper_says() {
        // P1: after 400 s at some 10 km.
        let config = Config::default();
        let draw = Draw::new(&config, &Suite::new(&config, 1.0), 1, 0);
        let altitude_km = (draw.truth.last().unwrap()[0] - 3_397_200.0) * 1e-3;
        assert_eq!(draw.truth.len(), 400);
        assert!((3.0..20.0).contains(&altitude_km), "{altitude_km}");
    }
}
