//! [`Atmosphere`]: density, temperature and speed of sound against altitude.

use super::{ModelError, finite, positive};
use crate::math::{Scalar, Table, TableRow, fun};
use crate::model::parameters::{AtmosphereParameters, AtmosphereRow, MAX_ATMOSPHERE_ROWS};

/// The air as the flight software believes it: an exponential law, or a table that is linear in log-density.
///
/// Beyond the table the density follows the exponential of its end segment and the temperature stays that of the end row.
#[derive(Clone, Debug, PartialEq)]
pub struct Atmosphere {
    law: Law,
    /// Columns: ln ρ, temperature; without rows under the exponential law.
    rows: Table<2, MAX_ATMOSPHERE_ROWS>,
    gas_constant_jpkgk: f64,
    /// Heat ratio times gas constant: the square of the speed of sound per kelvin.
    sound_square_per_k: f64,
}

/// Density and temperature against altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    /// ρ = ρ₀ exp((h₀ − h)/H), isothermal.
    Exponential { density_kgpm3: f64, altitude_m: f64, per_scale_height_pm: f64, temperature_k: f64 },
    /// The rows, and how they go on beyond their ends.
    Table { below: Tail, above: Tail },
}

/// Exponential continuation of a table beyond one of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Tail {
    altitude_m: f64,
    log_density: f64,
    slope_pm: f64,
}

impl Tail {
    /// Continues from `end`, away from its neighbour `inner`; a slope that would make the air denser upwards is taken as zero.
    fn new(end: &TableRow<2>, inner: &TableRow<2>) -> Self {
        let ([log_density, _], [inner_log_density, _]) = (end.y, inner.y);
        let slope = (log_density - inner_log_density) / (end.x - inner.x);
        Self { altitude_m: end.x, log_density, slope_pm: if slope < 0.0 { slope } else { 0.0 } }
    }

    fn log_density<S: Scalar>(&self, altitude_m: S) -> S {
        (altitude_m - self.altitude_m) * self.slope_pm + self.log_density
    }
}

impl Atmosphere {
    /// The exponential law when `rows` is empty, else the table.
    ///
    /// # Errors
    /// A density, scale height, temperature, gas constant or heat ratio that is not positive; rows that are not sorted.
    pub fn new(parameters: &AtmosphereParameters, rows: &[AtmosphereRow]) -> Result<Self, ModelError> {
        let mut air = Self::none();
        air.set(parameters, rows)?;
        Ok(air)
    }

    /// Nothing: the state before parameters are known.
    #[must_use]
    pub const fn none() -> Self {
        let law =
            Law::Exponential { density_kgpm3: 0.0, altitude_m: 0.0, per_scale_height_pm: 0.0, temperature_k: 0.0 };
        Self { law, rows: Table::empty(), gas_constant_jpkgk: 0.0, sound_square_per_k: 0.0 }
    }

    /// Becomes [`Self::new`] in place.
    ///
    /// # Errors
    /// As [`Self::new`]; what is left then is not to be used.
    pub fn set(&mut self, parameters: &AtmosphereParameters, rows: &[AtmosphereRow]) -> Result<(), ModelError> {
        self.gas_constant_jpkgk = positive("gas constant (J/(kg K))", parameters.gas_constant_jpkgk)?;
        self.sound_square_per_k = self.gas_constant_jpkgk * positive("ratio of specific heats", parameters.heat_ratio)?;
        self.law = if rows.is_empty() { Law::exponential(parameters)? } else { self.tabulate(rows)? };
        Ok(())
    }

    fn tabulate(&mut self, rows: &[AtmosphereRow]) -> Result<Law, ModelError> {
        for row in rows {
            positive("density of a table row (kg/m3)", row.density_kgpm3)?;
            positive("temperature of a table row (K)", row.temperature_k)?;
        }
        let log_rows =
            rows.iter().map(|row| TableRow { x: row.altitude_m, y: [fun::ln(row.density_kgpm3), row.temperature_k] });
        self.rows.fill(log_rows).map_err(ModelError::AtmosphereTable)?;
        // A table of one row is its own neighbour; the slope there is not a number and becomes zero.
        let (below, above) = match self.rows.rows() {
            [first, second, ..] => match self.rows.rows() {
                [.., before, last] => (Tail::new(first, second), Tail::new(last, before)),
                _ => (Tail::new(first, second), Tail::new(second, first)),
            },
            [only] => (Tail::new(only, only), Tail::new(only, only)),
            [] => return Err(ModelError::AtmosphereTable(crate::math::TableError::Empty)),
        };
        Ok(Law::Table { below, above })
    }

    /// Density, kg/m³.
    #[inline(always)]
    #[must_use]
    pub fn density<S: Scalar>(&self, altitude_m: S) -> S {
        match &self.law {
            Law::Exponential { density_kgpm3, altitude_m: reference_m, per_scale_height_pm, .. } => {
                ((altitude_m - *reference_m) * -*per_scale_height_pm).exp() * *density_kgpm3
            }
            Law::Table { .. } => self.log_density(altitude_m).exp(),
        }
    }

    /// Natural logarithm of the density in kg/m³.
    #[must_use]
    pub fn log_density<S: Scalar>(&self, altitude_m: S) -> S {
        match &self.law {
            Law::Exponential { density_kgpm3, altitude_m: reference_m, per_scale_height_pm, .. } => {
                (altitude_m - *reference_m) * -*per_scale_height_pm + fun::ln(*density_kgpm3)
            }
            Law::Table { below, above } => {
                let h = altitude_m.value();
                if h > above.altitude_m {
                    above.log_density(altitude_m)
                } else if h < below.altitude_m {
                    below.log_density(altitude_m)
                } else {
                    let [log_density, _] = self.rows.at(altitude_m);
                    log_density
                }
            }
        }
    }

    /// Derivative of log-density with altitude, 1/m: minus the inverse of the local scale height.
    #[must_use]
    pub fn log_density_slope_pm(&self, altitude_m: f64) -> f64 {
        match &self.law {
            Law::Exponential { per_scale_height_pm, .. } => -per_scale_height_pm,
            Law::Table { above, .. } if altitude_m >= above.altitude_m => above.slope_pm,
            Law::Table { below, .. } if altitude_m <= below.altitude_m => below.slope_pm,
            Law::Table { .. } => {
                let [slope_pm, _] = self.rows.slope_at(altitude_m);
                slope_pm
            }
        }
    }

    /// Temperature, K.
    #[must_use]
    pub fn temperature<S: Scalar>(&self, altitude_m: S) -> S {
        match &self.law {
            Law::Exponential { temperature_k, .. } => S::from_f64(*temperature_k),
            Law::Table { .. } => {
                let [_, temperature_k] = self.rows.at(altitude_m);
                temperature_k
            }
        }
    }

    /// Speed of sound, m/s: √(κ R T).
    #[must_use]
    pub fn speed_of_sound<S: Scalar>(&self, altitude_m: S) -> S {
        (self.temperature(altitude_m) * self.sound_square_per_k).sqrt()
    }

    /// Temperature, K; [`Self::temperature`] for plain numbers.
    #[must_use]
    pub fn temperature_k(&self, altitude_m: f64) -> f64 {
        self.temperature(altitude_m)
    }

    /// Speed of sound, m/s; [`Self::speed_of_sound`] for plain numbers.
    #[must_use]
    pub fn speed_of_sound_mps(&self, altitude_m: f64) -> f64 {
        self.speed_of_sound(altitude_m)
    }

    /// Specific gas constant, J/(kg·K).
    #[must_use]
    pub fn gas_constant_jpkgk(&self) -> f64 {
        self.gas_constant_jpkgk
    }

    /// Static pressure, Pa: ρ R T.
    #[must_use]
    pub fn pressure_pa(&self, altitude_m: f64) -> f64 {
        self.density(altitude_m) * self.gas_constant_jpkgk * self.temperature_k(altitude_m)
    }
}

impl Law {
    fn exponential(parameters: &AtmosphereParameters) -> Result<Self, ModelError> {
        Ok(Self::Exponential {
            density_kgpm3: positive("reference density (kg/m3)", parameters.reference_density_kgpm3)?,
            altitude_m: finite("reference altitude (m)", parameters.reference_altitude_m)?,
            per_scale_height_pm: 1.0 / positive("scale height (m)", parameters.scale_height_m)?,
            temperature_k: positive("temperature (K)", parameters.temperature_k)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Dual, TableError};

    const MODEL_C: AtmosphereParameters = AtmosphereParameters {
        reference_density_kgpm3: 0.0158,
        reference_altitude_m: 0.0,
        scale_height_m: 9354.0,
        temperature_k: 180.0,
        gas_constant_jpkgk: 188.92,
        heat_ratio: 1.3,
    };

    fn rows() -> [AtmosphereRow; 3] {
        [(0.0, 1e-2, 220.0), (20e3, 1e-3, 180.0), (60e3, 1e-5, 140.0)].map(
            |(altitude_m, density_kgpm3, temperature_k)| AtmosphereRow { altitude_m, density_kgpm3, temperature_k },
        )
    }

    fn tabulated() -> Atmosphere {
        Atmosphere::new(&MODEL_C, &rows()).unwrap()
    }

    fn near(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-13 // rounding of an exponential of an argument below 20
    }

    #[test]
    fn the_exponential_law_falls_by_e_over_a_scale_height() {
        let air = Atmosphere::new(&MODEL_C, &[]).unwrap();
        assert!(near(air.density(0.0), 0.0158));
        assert!(near(air.density(9354.0), 0.0158 / core::f64::consts::E));
        assert!(near(air.log_density_slope_pm(5e3), -1.0 / 9354.0));
        assert!(near(air.speed_of_sound_mps(5e3), (1.3 * 188.92 * 180.0_f64).sqrt()));
        assert!(near(air.pressure_pa(0.0), 0.0158 * 188.92 * 180.0));
    }

    #[test]
    fn the_table_meets_its_rows_and_the_geometric_mean_between() {
        let air = tabulated();
        for row in rows() {
            assert!(near(air.density(row.altitude_m), row.density_kgpm3));
            assert_eq!(air.temperature_k(row.altitude_m), row.temperature_k);
        }
        assert!(near(air.density(40e3), 1e-4));
        assert_eq!(air.temperature_k(40e3), 160.0);
    }

    #[test]
    fn beyond_the_table_the_density_goes_on_and_the_temperature_stays() {
        let air = tabulated();
        // A decade per 20 km both below and above the middle row.
        assert!(near(air.density(80e3), 1e-6));
        assert!(near(air.density(-2e3), 1e-2 * 10.0_f64.powf(0.1)));
        assert_eq!((air.temperature_k(80e3), air.temperature_k(-2e3)), (140.0, 220.0));
    }

    #[test]
    fn a_table_that_ends_with_denser_air_is_held_constant() {
        let inverted = [(0.0, 1e-3), (1e3, 2e-3)].map(|(altitude_m, density_kgpm3)| AtmosphereRow {
            altitude_m,
            density_kgpm3,
            temperature_k: 200.0,
        });
        let air = Atmosphere::new(&MODEL_C, &inverted).unwrap();
        assert!(near(air.density(100e3), 2e-3) && near(air.density(-100e3), 1e-3));
        let air = Atmosphere::new(&MODEL_C, &inverted[..1]).unwrap();
        assert!(near(air.density(100e3), 1e-3) && near(air.density(-100e3), 1e-3));
    }

    #[test]
    fn the_slope_of_log_density_is_its_derivative() {
        for air in [tabulated(), Atmosphere::new(&MODEL_C, &[]).unwrap()] {
            for altitude_m in [-1e3, 5e3, 33e3, 59e3, 90e3, 125e3] {
                let [partial] = air.log_density(Dual::<1>::variable(altitude_m, 0)).partials;
                assert!(near(partial, air.log_density_slope_pm(altitude_m)), "{altitude_m}");
                let density = air.density(Dual::<1>::variable(altitude_m, 0));
                assert!(near(density.partials[0], density.value * partial));
            }
        }
    }

    #[test]
    fn what_is_not_air_is_refused() {
        let refused =
            |parameters: AtmosphereParameters, rows: &[AtmosphereRow]| Atmosphere::new(&parameters, rows).unwrap_err();
        assert!(matches!(
            refused(AtmosphereParameters { scale_height_m: 0.0, ..MODEL_C }, &[]),
            ModelError::NotPositive { quantity: "scale height (m)", value: 0.0 }
        ));
        assert!(matches!(
            refused(AtmosphereParameters { reference_density_kgpm3: f64::NAN, ..MODEL_C }, &[]),
            ModelError::NotPositive { .. }
        ));
        let [first, second, third] = rows();
        assert_eq!(
            refused(MODEL_C, &[first, third, second]),
            ModelError::AtmosphereTable(TableError::NotIncreasing { row: 2 })
        );
        assert!(matches!(
            refused(MODEL_C, &[AtmosphereRow { density_kgpm3: -1.0, ..first }]),
            ModelError::NotPositive { .. }
        ));
    }
}
