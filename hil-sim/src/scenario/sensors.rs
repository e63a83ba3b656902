//! Sensors: rates, errors (1σ, drawn once per run unless called noise) and where they work.

use serde::{Deserialize, Serialize};

/// All sensors: true ones under `[sensors]`, the flight software's belief under `[onboard.sensors]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensors {
    /// Inertial measurement unit; one sample per minor frame.
    pub imu: Imu,
    /// Stagnation pressure.
    pub pressure: Pressure,
    /// Radio range and range-rate to orbiters and beacons.
    pub radio: Radio,
}

/// Inertial measurement unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imu {
    /// Accelerometer bias per axis, 1σ, millionths of standard gravity.
    pub accelerometer_bias_ug: f64,
    /// Accelerometer scale factor per axis, 1σ.
    pub accelerometer_scale_ppm: f64,
    /// Accelerometer misalignment: rotation vector of the triad against the body axes, per axis, 1σ.
    pub accelerometer_misalignment_mrad: f64,
    /// Accelerometer white noise, millionths of standard gravity per √Hz.
    pub accelerometer_noise_ugprthz: f64,
    /// Accelerometer saturation per axis.
    pub accelerometer_range_g: f64,
    /// Gyro bias per axis, 1σ, degrees per hour.
    pub gyro_bias_degph: f64,
    /// Gyro scale factor per axis, 1σ.
    pub gyro_scale_ppm: f64,
    /// Angle random walk, degrees per √hour.
    pub gyro_noise_degprth: f64,
    /// Gyro saturation per axis.
    pub gyro_range_degps: f64,
}

/// Stagnation pressure sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pressure {
    /// False: no sensor on board.
    pub enabled: bool,
    /// Samples per second; must divide 50.
    pub rate_hz: f64,
    /// Scale error, 1σ, fraction.
    pub scale_sigma: f64,
    /// Offset, 1σ.
    pub offset_sigma_pa: f64,
    /// White noise, 1σ, fraction of the reading.
    pub noise_sigma: f64,
    /// Valid above this dynamic pressure.
    pub min_dynamic_pressure_pa: f64,
}

/// Radio ranging.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Radio {
    /// Samples per second; must divide 50.
    pub rate_hz: f64,
    /// Range, white noise, 1σ.
    pub range_noise_m: f64,
    /// Range-rate, white noise, 1σ.
    pub range_rate_noise_mps: f64,
    /// No measurement below this elevation (of the orbiter over the vehicle's horizon, of the vehicle over a beacon's).
    pub min_elevation_deg: f64,
    /// Plasma blackout.
    pub blackout: Blackout,
}

/// No radio while faster than one limit and lower than the other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Blackout {
    /// Speed above which the plasma blocks, planet-relative.
    pub above_speed_mps: f64,
    /// Altitude below which it does.
    pub below_altitude_km: f64,
}
