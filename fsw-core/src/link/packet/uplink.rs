//! Measurements on their way to the flight computer.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Velocity increment of one accelerometer count, m/s.
pub const DELTA_V_LSB_MPS: f64 = 1e-6;

/// Angle increment of one gyro count, rad.
pub const DELTA_THETA_LSB_RAD: f64 = 1e-8;

/// Inertial measurement, body axes, as integer counts accumulated over one minor frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Imu {
    /// Velocity increments, counts of [`DELTA_V_LSB_MPS`].
    pub delta_v_counts: [i32; 3],
    /// Angle increments, counts of [`DELTA_THETA_LSB_RAD`].
    pub delta_theta_counts: [i32; 3],
    /// Status bits, [`Imu::ACCELEROMETER_SATURATED`] and following; 0 is healthy.
    pub status: u8,
}

impl Imu {
    /// An accelerometer axis reached its limit within the frame.
    pub const ACCELEROMETER_SATURATED: u8 = 1;
    /// A gyro axis reached its limit within the frame.
    pub const GYRO_SATURATED: u8 = 2;
    /// The unit's self test failed: data not to be used.
    pub const FAILED: u8 = 4;
}

/// Stagnation pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pressure {
    /// Stagnation pressure, Pa.
    pub stagnation_pa: f32,
    /// Status; 0 is healthy.
    pub status: u8,
}

/// One radio measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Radio {
    /// Slot of the source in the loaded parameters, 0 to [`MAX_SOURCES`](super::MAX_SOURCES) − 1.
    pub source: u8,
    /// Geometric range, m.
    pub range_m: f64,
    /// Rate of change of the range, m/s.
    pub range_rate_mps: f64,
    /// Signal quality, 0 (unusable) to 255.
    pub quality: u8,
}

/// True state of the vehicle at the frame's time stamp. Simulation only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Truth {
    /// Inertial position, m.
    pub position_m: [f64; 3],
    /// Inertial velocity, m/s.
    pub velocity_mps: [f64; 3],
    /// Attitude body → inertial, quaternion (w, x, y, z).
    pub attitude: [f64; 4],
    /// Bank angle about the air-relative velocity, rad.
    pub bank_rad: f64,
    /// Bank rate, rad/s.
    pub bank_rate_radps: f64,
    /// Atmospheric density, kg/m³.
    pub density_kgpm3: f64,
    /// Air-relative Mach number.
    pub mach: f64,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
}
