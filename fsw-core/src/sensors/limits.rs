//! What a measurement can be. Outside of it the sensor, the link or the sender is wrong. `doc/icd.md` states the same.

use crate::link::packet::{DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS};
use crate::planet::STANDARD_GRAVITY_MPS2;
use crate::time::{FRAME, FRAMES_PER_SECOND, Micros};
use crate::units::rad;

/// Saturation of the accelerometers, m/s² (35 g).
pub const ACCELEROMETER_LIMIT_MPS2: f64 = 35.0 * STANDARD_GRAVITY_MPS2;
/// Saturation of the gyros, rad/s (300°/s).
pub const GYRO_LIMIT_RADPS: f64 = rad(300.0);
/// Largest velocity increment of one axis and frame, counts: the saturation, rounded up.
pub const MAX_DELTA_V_COUNTS: u32 =
    (ACCELEROMETER_LIMIT_MPS2 / (FRAMES_PER_SECOND as f64 * DELTA_V_LSB_MPS)) as u32 + 1;
/// Largest angle increment of one axis and frame, counts: the saturation, rounded up.
pub const MAX_DELTA_THETA_COUNTS: u32 =
    (GYRO_LIMIT_RADPS / (FRAMES_PER_SECOND as f64 * DELTA_THETA_LSB_RAD)) as u32 + 1;

/// Lowest stagnation pressure, Pa: below zero by what offset and noise of the transducer can give.
pub const MIN_STAGNATION_PA: f64 = -1_000.0;
/// Highest stagnation pressure, Pa: the range of the transducer, twenty times the peak of a nominal entry.
pub const MAX_STAGNATION_PA: f64 = 400_000.0;

/// Shortest and longest range, m: one kilometre inside the noise of a beacon, and beyond any orbiter in sight.
pub const MIN_RANGE_M: f64 = 0.0;
/// Longest range, m.
pub const MAX_RANGE_M: f64 = 50_000_000.0;
/// Largest range-rate, m/s, either sign: entry and orbit speed against each other, with margin.
pub const MAX_RANGE_RATE_MPS: f64 = 15_000.0;
/// Lowest signal quality that is used; 0 is unusable.
pub const MIN_QUALITY: u8 = 1;

/// A measurement belongs to the minor frame that ends now: it is younger than this. Successive frames thus accept
/// disjoint spans of time, and a time stamp that does not advance is rejected as late without any memory.
pub const MAX_AGE: Micros = FRAME;
/// A time stamp may lie this far ahead, for clocks that are not the caller's: half a minor frame.
pub const MAX_LEAD: Micros = Micros(FRAME.0 / 2);

/// Largest component of a true position or velocity, SI, and deviation of its quaternion's norm from one.
pub const MAX_TRUTH_COMPONENT: f64 = 1e9;
/// Largest true bank (rad), bank rate (rad/s), density (kg/m³), Mach number and dynamic pressure (Pa), either sign.
pub const MAX_TRUTH_SCALARS: [f64; 5] = [core::f64::consts::TAU, 100.0, 1e6, 1e6, 1e12];
/// Largest deviation of the norm of the true attitude quaternion from one.
pub const TRUTH_QUATERNION_TOLERANCE: f64 = 1e-6;
