//! Conversions between SI and the units of the edges. Nothing else in the core converts units.

/// Degrees per radian.
pub const DEG_PER_RAD: f64 = 180.0 / core::f64::consts::PI;
/// Radians per degree.
pub const RAD_PER_DEG: f64 = core::f64::consts::PI / 180.0;

/// Degrees to radians.
#[must_use]
pub const fn rad(degrees: f64) -> f64 {
    degrees * RAD_PER_DEG
}

/// Radians to degrees.
#[must_use]
pub const fn deg(radians: f64) -> f64 {
    radians * DEG_PER_RAD
}
