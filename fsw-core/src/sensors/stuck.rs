//! A sensor that repeats itself. Noise forbids equal readings again and again; a frozen sensor gives nothing else, with a
//! healthy status and good checksums. A frozen pressure would draw the estimated density along before the filter's gate
//! closes; the radio needs no such watch, its readings change by kilometres a second.

use super::{Batch, ImuIncrement};
use crate::frames::{Body, Vec3};
use crate::link::packet::{DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS, RejectCounters};
use crate::link::parameters::NavigationParameters;
use crate::math::fun::sqrt;
use crate::time::FRAME;

/// Frames in a row with equal counts of the three axes of a triad that a working unit may give: 0.2 s.
pub const MAX_EQUAL_FRAMES: u8 = 10;
/// Pressure readings in a row with the same value that a working port may give.
pub const MAX_EQUAL_PRESSURES: u8 = 2;
/// The watch needs this much white noise in a frame, counts; with less, as in ideal simulations, equal counts are honest.
const MIN_NOISE_COUNTS: f64 = 2.0;

/// The same for the pressure, as a fraction of the reading: a hundred steps of its single precision.
const MIN_PRESSURE_NOISE: f64 = 1e-5;

/// Watches the two triads of the inertial unit and the pressure port for frozen readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StuckMonitor {
    accelerometers: Repeats<Vec3<Body>>,
    gyros: Repeats<Vec3<Body>>,
    pressure: Repeats<f64>,
}

impl StuckMonitor {
    /// A monitor that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { accelerometers: Repeats::NONE, gyros: Repeats::NONE, pressure: Repeats::NONE }
    }

    /// Takes the readings of frozen sensors out of the batch and counts them under status.
    pub fn step(&mut self, batch: &mut Batch, parameters: &NavigationParameters, counters: &mut RejectCounters) {
        if batch.imu.as_ref().is_some_and(|imu| self.is_unit_frozen(imu, parameters)) {
            batch.imu = None;
            counters.status = counters.status.saturating_add(1);
        }
        if batch.pressure.as_ref().is_some_and(|p| self.is_port_frozen(p.stagnation_pa, parameters)) {
            batch.pressure = None;
            counters.status = counters.status.saturating_add(1);
        }
    }

    fn is_unit_frozen(&mut self, imu: &ImuIncrement, parameters: &NavigationParameters) -> bool {
        let noisy = |density: f64, count: f64| density * sqrt(FRAME.as_s()) >= MIN_NOISE_COUNTS * count;
        let honest = !noisy(parameters.accelerometer_noise, DELTA_V_LSB_MPS);
        let accelerometers = self.accelerometers.of(imu.delta_v_b, honest) >= MAX_EQUAL_FRAMES;
        let honest = !noisy(parameters.gyro_noise, DELTA_THETA_LSB_RAD);
        let gyros = self.gyros.of(imu.delta_theta_b, honest) >= MAX_EQUAL_FRAMES;
        accelerometers || gyros
    }

    /// In a vacuum a port repeats its offset; the filter uses no such reading.
    fn is_port_frozen(&mut self, stagnation_pa: f64, parameters: &NavigationParameters) -> bool {
        let honest =
            parameters.pressure_noise < MIN_PRESSURE_NOISE || stagnation_pa < parameters.pressure_min_dynamic_pa;
        self.pressure.of(stagnation_pa, honest) >= MAX_EQUAL_PRESSURES
    }
}

/// Counts how often a reading repeats the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Repeats<T> {
    last: Option<T>,
    equal: u8,
}

impl<T: PartialEq> Repeats<T> {
    const NONE: Self = Self { last: None, equal: 0 };

    /// Repetitions so far; none where equal readings are `honest`.
    fn of(&mut self, reading: T, honest: bool) -> u8 {
        let equal = self.last.as_ref().is_some_and(|last| *last == reading) && !honest;
        self.equal = if equal { self.equal.saturating_add(1) } else { 0 };
        self.last = Some(reading);
        self.equal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::sensors::PressureMeasurement;
    use crate::time::MissionTime;

    /// Accelerometers that give `x`, gyros that work.
    fn batch(frame: u32, x: f64) -> Batch {
        let imu = ImuIncrement {
            time: MissionTime::of_frame(frame),
            delta_v_b: Vec3::new(x, 0.0, 0.0),
            delta_theta_b: Vec3::new(0.0, f64::from(frame), 0.0),
            accelerometer_saturated: false,
            gyro_saturated: false,
        };
        Batch { imu: Some(imu), ..Batch::default() }
    }

    fn accepted(monitor: &mut StuckMonitor, frame: u32, x: f64, parameters: &NavigationParameters) -> bool {
        let mut b = batch(frame, x);
        monitor.step(&mut b, parameters, &mut RejectCounters::default());
        b.imu.is_some()
    }

    #[test]
    fn a_frozen_triad_is_left_out_until_it_moves_again() {
        let (mut monitor, parameters) = (StuckMonitor::new(), Config::DEFAULT.navigation);
        let used = (0..50).filter(|frame| accepted(&mut monitor, *frame, 0.5, &parameters)).count();
        assert_eq!(used, usize::from(MAX_EQUAL_FRAMES));
        assert!(accepted(&mut monitor, 50, 0.6, &parameters));
    }

    #[test]
    fn a_unit_without_noise_may_repeat_itself() {
        let mut monitor = StuckMonitor::new();
        let silent = NavigationParameters { accelerometer_noise: 0.0, ..Config::DEFAULT.navigation };
        assert!((0..50).all(|frame| accepted(&mut monitor, frame, 0.5, &silent)));
    }

    #[test]
    fn a_frozen_port_is_left_out_but_not_in_a_vacuum() {
        let parameters = Config::DEFAULT.navigation;
        for (stagnation_pa, expected) in [(5000.0, usize::from(MAX_EQUAL_PRESSURES)), (15.0, 20)] {
            let (mut monitor, mut counters) = (StuckMonitor::new(), RejectCounters::default());
            let used = (0..20).filter(|frame| {
                let time = MissionTime::of_frame(5 * frame);
                let mut b = Batch { pressure: Some(PressureMeasurement { time, stagnation_pa }), ..Batch::default() };
                monitor.step(&mut b, &parameters, &mut counters);
                b.pressure.is_some()
            });
            assert_eq!(used.count(), expected, "{stagnation_pa}");
            assert_eq!(counters.status as usize, 20 - expected);
        }
    }
}
