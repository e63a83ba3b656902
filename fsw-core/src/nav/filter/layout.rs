//! Order and size of the error states. Nothing else writes a column number by hand.
//!
//! Errors are truth minus estimate. The attitude error φ is a rotation vector in inertial axes: C = (1 + [φ×])Ĉ.

/// Components of a three-dimensional block.
pub const AXES: usize = 3;

/// Position, inertial axes, m.
pub const POSITION: usize = 0;
/// Velocity, inertial axes, m/s.
pub const VELOCITY: usize = 3;
/// Attitude, rotation vector in inertial axes, rad.
pub const ATTITUDE: usize = 6;
/// Logarithm of the density ratio.
pub const LOG_DENSITY: usize = 9;
/// Number of states that a transition changes; those that follow are constants of the sensors.
pub const MOVING: usize = 10;

/// Accelerometer bias, body axes, m/s².
pub const ACCELEROMETER_BIAS: usize = 10;
/// Gyro bias, body axes, rad/s.
pub const GYRO_BIAS: usize = 13;
/// Accelerometer scale factor, body axes.
pub const ACCELEROMETER_SCALE: usize = 16;
/// Accelerometer misalignment, rotation vector in body axes, rad.
pub const ACCELEROMETER_MISALIGNMENT: usize = 19;
/// Gyro scale factor, body axes.
pub const GYRO_SCALE: usize = 22;
/// Scale error of the pressure.
pub const PRESSURE_SCALE: usize = 25;
/// Offset of the pressure, Pa.
pub const PRESSURE_OFFSET: usize = 26;
/// Number of all states.
pub const ALL: usize = 27;

/// A vector of the states that a transition changes.
pub type Moving = [f64; MOVING];
/// A vector of all states.
pub type Full = [f64; ALL];
