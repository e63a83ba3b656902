//! Radio sources in orbit and on the surface.

use fsw_core::planet::Planet as PlanetSi;
use fsw_core::units::rad;
use serde::{Deserialize, Serialize};

/// A radio source in orbit, by osculating elements at t = 0 in inertial axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orbiter {
    /// Name in reports.
    pub name: String,
    /// Semi-major axis.
    pub semi_major_axis_km: f64,
    /// Eccentricity.
    pub eccentricity: f64,
    /// Inclination.
    pub inclination_deg: f64,
    /// Right ascension of the ascending node; from the inertial x axis, the planet's prime meridian at t = 0.
    pub raan_deg: f64,
    /// Argument of periapsis.
    pub arg_periapsis_deg: f64,
    /// True anomaly at t = 0.
    pub true_anomaly_deg: f64,
}

impl Orbiter {
    /// Inertial position (m) and velocity (m/s) at t = 0.
    ///
    /// Perifocal state turned by R3(−Ω) R1(−i) R3(−ω); any textbook, e.g. Vallado, Algorithm COE2RV.
    #[must_use]
    pub fn inertial_state(&self, planet: &PlanetSi) -> ([f64; 3], [f64; 3]) {
        let (sin_i, cos_i) = libm::sincos(rad(self.inclination_deg));
        let (sin_node, cos_node) = libm::sincos(rad(self.raan_deg));
        let (sin_peri, cos_peri) = libm::sincos(rad(self.arg_periapsis_deg));
        let (sin_nu, cos_nu) = libm::sincos(rad(self.true_anomaly_deg));
        let e = self.eccentricity;
        let parameter_m = self.semi_major_axis_km * 1e3 * (1.0 - e * e);
        let radius_m = parameter_m / (1.0 + e * cos_nu);
        let speed = libm::sqrt(planet.mu_m3ps2 / parameter_m);
        let to_periapsis = [
            cos_node * cos_peri - sin_node * sin_peri * cos_i,
            sin_node * cos_peri + cos_node * sin_peri * cos_i,
            sin_peri * sin_i,
        ];
        let across = [
            -cos_node * sin_peri - sin_node * cos_peri * cos_i,
            -sin_node * sin_peri + cos_node * cos_peri * cos_i,
            cos_peri * sin_i,
        ];
        let combine = |p: f64, q: f64| [0, 1, 2].map(|k: usize| p * to_periapsis[k] + q * across[k]);
        (combine(radius_m * cos_nu, radius_m * sin_nu), combine(-speed * sin_nu, speed * (e + cos_nu)))
    }
}

/// A radio source fixed to the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beacon {
    /// Name in reports.
    pub name: String,
    /// Longitude, positive east.
    pub longitude_deg: f64,
    /// Planetocentric latitude, positive north.
    pub latitude_deg: f64,
    /// Altitude over the reference sphere.
    pub altitude_km: f64,
}
