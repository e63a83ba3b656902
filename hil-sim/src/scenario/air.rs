//! The true air.

use fsw_core::link::parameters::AtmosphereParameters;
use fsw_core::planet::Planet as PlanetSi;
use serde::{Deserialize, Serialize};

/// Law of the density.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum AtmosphereKind {
    /// One exponential.
    Exponential,
    /// A table by altitude.
    Table,
}

/// The true air, before dispersions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Atmosphere {
    /// Exponential or table.
    pub kind: AtmosphereKind,
    /// Density at the reference altitude (exponential).
    pub reference_density_kgpm3: f64,
    /// Reference altitude (exponential).
    pub reference_altitude_km: f64,
    /// Scale height (exponential; also gives the default temperature).
    pub scale_height_km: f64,
    /// Rows of the table, by altitude, rising. In a file: `file = "….csv"` instead.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rows: Option<Vec<AtmosphereRow>>,
    /// Temperature; where missing the hydrostatic g·H/R of [`Atmosphere::temperature_k`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// Specific gas constant.
    pub gas_constant_jpkgk: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
    /// Factor on the true density that the flight software is not told of.
    pub density_scale: f64,
    /// Random density perturbation, correlated in altitude.
    pub perturbation: Perturbation,
}

impl Atmosphere {
    /// Temperature where the table gives none: as stated, else that of hydrostatic balance at the surface, g·H/R.
    #[must_use]
    pub fn temperature_k(&self, planet: &PlanetSi) -> f64 {
        self.temperature_k
            .unwrap_or_else(|| hydrostatic_temperature_k(planet, self.scale_height_km * 1e3, self.gas_constant_jpkgk))
    }

    /// The exponential law in SI units.
    #[must_use]
    pub fn parameters(&self, planet: &PlanetSi) -> AtmosphereParameters {
        AtmosphereParameters {
            reference_density_kgpm3: self.reference_density_kgpm3,
            reference_altitude_m: self.reference_altitude_km * 1e3,
            scale_height_m: self.scale_height_km * 1e3,
            temperature_k: self.temperature_k(planet),
            gas_constant_jpkgk: self.gas_constant_jpkgk,
            heat_ratio: self.heat_ratio,
        }
    }
}

/// Temperature of an isothermal atmosphere in hydrostatic balance with the gravity at the reference radius, K.
pub(super) fn hydrostatic_temperature_k(planet: &PlanetSi, scale_height_m: f64, gas_constant_jpkgk: f64) -> f64 {
    planet.mu_m3ps2 / (planet.radius_m * planet.radius_m) * scale_height_m / gas_constant_jpkgk
}

/// One row of an atmosphere table: `[altitude_km, density_kgpm3, temperature_k, wind_east_mps, wind_north_mps]`; the
/// last three may be missing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
pub struct AtmosphereRow {
    /// Altitude.
    pub altitude_km: f64,
    /// Density.
    pub density_kgpm3: f64,
    /// Temperature.
    pub temperature_k: Option<f64>,
    /// Wind towards east.
    pub wind_east_mps: f64,
    /// Wind towards north.
    pub wind_north_mps: f64,
}

impl TryFrom<Vec<f64>> for AtmosphereRow {
    type Error = String;

    fn try_from(v: Vec<f64>) -> Result<Self, String> {
        let row = |temperature_k, wind_east_mps, wind_north_mps| Self {
            altitude_km: v[0],
            density_kgpm3: v[1],
            temperature_k,
            wind_east_mps,
            wind_north_mps,
        };
        match v.len() {
            2 => Ok(row(None, 0.0, 0.0)),
            3 => Ok(row(Some(v[2]), 0.0, 0.0)),
            5 => Ok(row(Some(v[2]), v[3], v[4])),
            n => Err(format!(
                "a row has {n} values where 2 (altitude_km, density_kgpm3), 3 (and temperature_k) or 5 (and wind_east_mps, wind_north_mps) are expected"
            )),
        }
    }
}

impl From<AtmosphereRow> for Vec<f64> {
    fn from(row: AtmosphereRow) -> Self {
        let mut values = vec![row.altitude_km, row.density_kgpm3];
        if let Some(temperature_k) = row.temperature_k {
            values.push(temperature_k);
            if row.wind_east_mps != 0.0 || row.wind_north_mps != 0.0 {
                values.extend([row.wind_east_mps, row.wind_north_mps]);
            }
        }
        values
    }
}

/// Random density perturbation, a first-order Gauss–Markov process in altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Perturbation {
    /// Standard deviation of the logarithm of the density; 0 turns it off.
    pub sigma: f64,
    /// Correlation length in altitude.
    pub correlation_km: f64,
}
