//! [`Uncertainty`]: how well navigation knows what it says.

use crate::link::packet::COVARIANCE_ELEMENTS;

/// Uncertainty as of the last finished epoch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uncertainty {
    /// Lower triangle, row by row, of the covariance of position and velocity.
    pub covariance: [f64; COVARIANCE_ELEMENTS],
    /// Attitude, rad.
    pub attitude_sigma_rad: [f64; 3],
    /// Log-density.
    pub log_density_sigma: f64,
    /// Largest standard deviation of position along an axis, m.
    pub position_sigma_m: f64,
    /// Largest standard deviation of velocity along an axis, m/s.
    pub velocity_sigma_mps: f64,
    /// False while a variance is not finite, until the next prediction restores it.
    pub sound: bool,
}

impl Uncertainty {
    /// None known, and not sound.
    pub const NONE: Self = Self {
        covariance: [0.0; COVARIANCE_ELEMENTS],
        attitude_sigma_rad: [0.0; 3],
        log_density_sigma: 0.0,
        position_sigma_m: 0.0,
        velocity_sigma_mps: 0.0,
        sound: false,
    };
}
