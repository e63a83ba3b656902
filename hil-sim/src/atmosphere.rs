//! The air: density and temperature over altitude, with the dispersions of one flight.

use libm::{exp, log, sin};

use crate::noise::Stream;

/// One row of a tabulated atmosphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Altitude, m.
    pub altitude_m: f64,
    /// Density, kg/m³.
    pub density_kgpm3: f64,
    /// Temperature, K.
    pub temperature_k: f64,
}

/// Density and temperature law before dispersion.
#[derive(Clone, Debug, PartialEq)]
pub enum Profile {
    /// ρ = ρ₀ exp(−(h − h₀)/H), one temperature.
    Exponential {
        /// Density at the reference altitude, kg/m³.
        reference_density_kgpm3: f64,
        /// Reference altitude, m.
        reference_altitude_m: f64,
        /// Scale height, m.
        scale_height_m: f64,
        /// Temperature, K.
        temperature_k: f64,
    },
    /// Rows by altitude; see [`Table`].
    Table(Table),
}

/// Rows in ascending altitude: ln ρ and temperature linear between rows. Outside the rows the density continues with
/// the scale height of the nearest interval and the temperature keeps its end value.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    altitude_m: Vec<f64>,
    log_density: Vec<f64>,
    temperature_k: Vec<f64>,
}

/// Why rows do not make a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TableError {
    /// Fewer than two rows.
    TooFewRows(usize),
    /// Altitude does not ascend at this row, counted from 0.
    NotAscending(usize),
    /// A density or temperature that is not positive and finite, at this row.
    NotPositive(usize),
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooFewRows(n) => write!(f, "an atmosphere table needs at least 2 rows, this one has {n}"),
            Self::NotAscending(row) => write!(f, "altitudes must ascend: row {} does not", row + 1),
            Self::NotPositive(row) => write!(f, "density and temperature must be positive: row {} is not", row + 1),
        }
    }
}

impl std::error::Error for TableError {}

impl Table {
    /// A table from its rows.
    pub fn new(rows: &[Row]) -> Result<Self, TableError> {
        if rows.len() < 2 {
            return Err(TableError::TooFewRows(rows.len()));
        }
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if let Some(bad) = rows.iter().position(|r| !positive(r.density_kgpm3) || !positive(r.temperature_k)) {
            return Err(TableError::NotPositive(bad));
        }
        let ascends = |w: &[Row]| w[1].altitude_m > w[0].altitude_m && w[1].altitude_m.is_finite();
        if let Some(bad) = rows.windows(2).position(|w| !ascends(w)) {
            return Err(TableError::NotAscending(bad + 1));
        }
        Ok(Self {
            altitude_m: rows.iter().map(|r| r.altitude_m).collect(),
            log_density: rows.iter().map(|r| log(r.density_kgpm3)).collect(),
            temperature_k: rows.iter().map(|r| r.temperature_k).collect(),
        })
    }

    fn log_density(&self, altitude_m: f64) -> f64 {
        let (row, fraction) = locate(&self.altitude_m, altitude_m);
        let (low, high) = (self.log_density[row], self.log_density[row + 1]);
        low + fraction * (high - low)
    }

    fn temperature_k(&self, altitude_m: f64) -> f64 {
        let (row, fraction) = locate(&self.altitude_m, altitude_m);
        let (low, high) = (self.temperature_k[row], self.temperature_k[row + 1]);
        low + fraction.clamp(0.0, 1.0) * (high - low)
    }
}

/// The interval of an ascending grid of at least two nodes that holds `x`, and where in it (beyond [0, 1] outside).
pub(crate) fn locate(grid: &[f64], x: f64) -> (usize, f64) {
    let row = grid.partition_point(|&g| g <= x).clamp(1, grid.len() - 1) - 1;
    (row, (x - grid[row]) / (grid[row + 1] - grid[row]))
}

/// Temperature of air in hydrostatic balance with a scale height: g·H/R_gas, K.
#[must_use]
pub fn hydrostatic_temperature_k(gravity_mps2: f64, scale_height_m: f64, gas_constant_jpkgk: f64) -> f64 {
    gravity_mps2 * scale_height_m / gas_constant_jpkgk
}

/// What makes the air of one flight differ from the profile (guidance.md §5 of the specification):
/// ρ = ρ_nom (1+b) exp(s·z + a sin(2πh/λ + p) + x(h)), z = clamp((h − 20 km)/40 km, −0.5, 1.5).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DensityDispersion {
    /// b, fraction.
    pub bias: f64,
    /// s, change of ln ρ per 40 km.
    pub slope: f64,
    /// a, amplitude of the wave in ln ρ.
    pub wave_amplitude: f64,
    /// λ, m; 0 means no wave.
    pub wave_length_m: f64,
    /// p, rad.
    pub wave_phase_rad: f64,
    /// x(h).
    pub perturbation: Option<Perturbation>,
}

impl DensityDispersion {
    /// Natural logarithm of the ratio of density to the profile.
    #[must_use]
    pub fn log_ratio(&self, altitude_m: f64) -> f64 {
        libm::log1p(self.bias) + self.exponent(altitude_m)
    }

    /// The same without the bias, which is cheaper as a factor.
    fn exponent(&self, altitude_m: f64) -> f64 {
        let z = ((altitude_m - 20e3) / 40e3).clamp(-0.5, 1.5);
        let wave = if self.wave_amplitude != 0.0 && self.wave_length_m > 0.0 {
            let phase = 2.0 * core::f64::consts::PI * altitude_m / self.wave_length_m + self.wave_phase_rad;
            self.wave_amplitude * sin(phase)
        } else {
            0.0
        };
        let random = self.perturbation.as_ref().map_or(0.0, |p| p.at(altitude_m));
        self.slope * z + wave + random
    }
}

/// A stationary Gauss–Markov process in altitude, drawn on a grid and joined by cubics with continuous slope, so that
/// the integrator meets no kink. Constant beyond the grid (−10 to 150 km).
#[derive(Clone, Debug, PartialEq)]
pub struct Perturbation {
    spacing_m: f64,
    nodes: Vec<f64>,
}

impl Perturbation {
    const BOTTOM_M: f64 = -10e3;
    const TOP_M: f64 = 150e3;
    /// Grid nodes in one correlation length.
    const NODES_PER_LENGTH: f64 = 8.0;
    /// Finest grid, m: bounds the number of nodes.
    const MIN_SPACING_M: f64 = 20.0;

    /// Draws the process: standard deviation of ln ρ and correlation length (e-folding of its autocorrelation).
    #[must_use]
    pub fn draw(sigma: f64, correlation_m: f64, stream: &mut Stream) -> Self {
        let spacing_m = (correlation_m / Self::NODES_PER_LENGTH).clamp(Self::MIN_SPACING_M, 20e3);
        let count = ((Self::TOP_M - Self::BOTTOM_M) / spacing_m).ceil() as usize + 2;
        let memory = exp(-spacing_m / correlation_m.max(1.0));
        let innovation = sigma * (1.0 - memory * memory).sqrt();
        let mut x = sigma * stream.normal();
        let nodes = (0..count)
            .map(|_| {
                let here = x;
                x = memory * x + innovation * stream.normal();
                here
            })
            .collect();
        Self { spacing_m, nodes }
    }

    /// ln of the density ratio at an altitude.
    #[must_use]
    pub fn at(&self, altitude_m: f64) -> f64 {
        let last = self.nodes.len() - 1;
        let position = ((altitude_m - Self::BOTTOM_M) / self.spacing_m).clamp(0.0, last as f64);
        let k = (position as usize).min(last - 1);
        let f = position - k as f64;
        // Catmull–Rom: slopes at the nodes by central differences.
        let (p0, p1, p2, p3) =
            (self.nodes[k.saturating_sub(1)], self.nodes[k], self.nodes[k + 1], self.nodes[(k + 2).min(last)]);
        let (m1, m2) = (0.5 * (p2 - p0), 0.5 * (p3 - p1));
        let (f2, f3) = (f * f, f * f * f);
        (2.0 * f3 - 3.0 * f2 + 1.0) * p1 + (f3 - 2.0 * f2 + f) * m1 + (3.0 * f2 - 2.0 * f3) * p2 + (f3 - f2) * m2
    }
}

/// The air of one flight.
#[derive(Clone, Debug, PartialEq)]
pub struct Atmosphere {
    /// Law before dispersion.
    pub profile: Profile,
    /// Constant factor on the profile's density (`density_scale` of a scenario).
    pub density_scale: f64,
    /// What this flight draws.
    pub dispersion: DensityDispersion,
    /// Specific gas constant, J/(kg·K).
    pub gas_constant_jpkgk: f64,
    /// Ratio of specific heats.
    pub heat_ratio: f64,
}

impl Atmosphere {
    /// Density, kg/m³.
    #[must_use]
    pub fn density_kgpm3(&self, altitude_m: f64) -> f64 {
        let factor = self.density_scale * (1.0 + self.dispersion.bias);
        let exponent = self.dispersion.exponent(altitude_m);
        match &self.profile {
            Profile::Exponential { reference_density_kgpm3, reference_altitude_m, scale_height_m, .. } => {
                let depth = (altitude_m - reference_altitude_m) / scale_height_m;
                factor * reference_density_kgpm3 * exp(exponent - depth)
            }
            Profile::Table(table) => factor * exp(table.log_density(altitude_m) + exponent),
        }
    }

    /// Temperature, K; not dispersed.
    #[must_use]
    pub fn temperature_k(&self, altitude_m: f64) -> f64 {
        match &self.profile {
            Profile::Exponential { temperature_k, .. } => *temperature_k,
            Profile::Table(table) => table.temperature_k(altitude_m),
        }
    }

    /// Speed of sound, m/s.
    #[must_use]
    pub fn speed_of_sound_mps(&self, altitude_m: f64) -> f64 {
        (self.heat_ratio * self.gas_constant_jpkgk * self.temperature_k(altitude_m)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exponential() -> Atmosphere {
        Atmosphere {
            profile: Profile::Exponential {
                reference_density_kgpm3: 0.0158,
                reference_altitude_m: 0.0,
                scale_height_m: 9354.0,
                temperature_k: 184.0,
            },
            density_scale: 1.0,
            dispersion: DensityDispersion::default(),
            gas_constant_jpkgk: 188.92,
            heat_ratio: 1.3,
        }
    }

    fn tabulated(spacing_m: f64) -> Atmosphere {
        let source = exponential();
        let rows: Vec<Row> = (0..=(100e3 / spacing_m) as usize)
            .map(|k| k as f64 * spacing_m)
            .map(|h| Row { altitude_m: h, density_kgpm3: source.density_kgpm3(h), temperature_k: 150.0 + h / 1e3 })
            .collect();
        Atmosphere { profile: Profile::Table(Table::new(&rows).unwrap()), ..source }
    }

    #[test]
    fn a_table_of_an_exponential_is_that_exponential_inside_and_outside_its_rows() {
        let (law, table) = (exponential(), tabulated(1000.0));
        for h in [-3e3, 0.0, 17.3e3, 54_321.0, 100e3, 125e3] {
            let ratio = table.density_kgpm3(h) / law.density_kgpm3(h);
            assert!((ratio - 1.0).abs() < 1e-12, "{h}: {ratio}");
        }
    }

    #[test]
    fn temperature_keeps_its_end_values_outside_the_table() {
        let table = tabulated(1000.0);
        assert_eq!(table.temperature_k(-5e3), 150.0);
        assert_eq!(table.temperature_k(500e3), 250.0);
        assert!((table.temperature_k(12_500.0) - 162.5).abs() < 1e-9);
    }

    #[test]
    fn bad_tables_are_refused_with_the_row() {
        let row = |altitude_m, density_kgpm3| Row { altitude_m, density_kgpm3, temperature_k: 180.0 };
        assert_eq!(Table::new(&[row(0.0, 1.0)]), Err(TableError::TooFewRows(1)));
        assert_eq!(Table::new(&[row(0.0, 1.0), row(0.0, 0.5)]), Err(TableError::NotAscending(1)));
        assert_eq!(Table::new(&[row(0.0, 1.0), row(1.0, f64::NAN)]), Err(TableError::NotPositive(1)));
        assert_eq!(Table::new(&[row(0.0, 1.0), row(f64::NAN, 0.5)]), Err(TableError::NotAscending(1)));
    }

    #[test]
    fn dispersed_density_is_the_formula_of_the_specification() {
        let dispersion = DensityDispersion {
            bias: 0.1,
            slope: 0.05,
            wave_amplitude: 0.03,
            wave_length_m: 12e3,
            wave_phase_rad: 0.7,
            perturbation: None,
        };
        let air = Atmosphere { dispersion, ..exponential() };
        for (h, z) in [(-30e3, -0.5), (0.0, -0.5), (30e3, 0.25), (110e3, 1.5)] {
            let wave = 0.03 * (2.0 * core::f64::consts::PI * h / 12e3 + 0.7f64).sin();
            let expected = 0.0158 * (-h / 9354.0f64).exp() * 1.1 * (0.05 * z + wave).exp();
            assert!((air.density_kgpm3(h) / expected - 1.0).abs() < 1e-12, "{h}");
        }
    }

    #[test]
    fn the_perturbation_has_its_deviation_and_its_correlation_length() {
        let (sigma, length) = (0.05, 2e3);
        let (mut square, mut product, mut n) = (0.0, 0.0, 0.0);
        for run in 0..60 {
            let p = Perturbation::draw(sigma, length, &mut Stream::new(5, run, "perturbation"));
            for k in 0..70 {
                let h = k as f64 * 2e3;
                square += p.at(h) * p.at(h);
                product += p.at(h) * p.at(h + length);
                n += 1.0;
            }
        }
        // 4200 samples, neighbours correlated 1/e: about 3000 independent ones, 1σ of the deviation 1.3 %, of the correlation 0.02.
        assert!(((square / n).sqrt() / sigma - 1.0).abs() < 0.06);
        assert!((product / square - (-1.0f64).exp()).abs() < 0.08);
    }

    #[test]
    fn the_perturbation_is_smooth_across_its_nodes() {
        let p = Perturbation::draw(0.05, 2e3, &mut Stream::new(1, 1, "perturbation"));
        // One-sided slopes over 10 cm: the curvature of the cubics leaves a few 1e-7 /m, a kink would leave about 1e-4 /m.
        for k in 0..100 {
            let node = k as f64 * 250.0;
            let below = (p.at(node) - p.at(node - 0.1)) / 0.1;
            let above = (p.at(node + 0.1) - p.at(node)) / 0.1;
            assert!((below - above).abs() < 1e-6, "kink at {node}: {below} {above}");
        }
    }
}
