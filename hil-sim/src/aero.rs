//! The vehicle: mass, reference area and aerodynamic coefficients.

use crate::atmosphere::locate;

/// Coefficients at one Mach number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Mach number.
    pub mach: f64,
    /// Drag coefficient.
    pub drag: f64,
    /// Lift coefficient.
    pub lift: f64,
}

/// Drag and lift coefficient at trim.
#[derive(Clone, Debug, PartialEq)]
pub enum Coefficients {
    /// The same at every speed.
    Constant {
        /// Drag coefficient.
        drag: f64,
        /// Lift coefficient.
        lift: f64,
    },
    /// By Mach number, linear between rows in ascending Mach, constant beyond them.
    ByMach(MachTable),
}

/// Coefficients in ascending Mach number.
#[derive(Clone, Debug, PartialEq)]
pub struct MachTable {
    mach: Vec<f64>,
    drag: Vec<f64>,
    lift: Vec<f64>,
}

impl MachTable {
    /// A table from its rows; `None` for fewer than two, or Mach numbers that do not ascend, or anything not finite.
    #[must_use]
    pub fn new(rows: &[Row]) -> Option<Self> {
        let ascending = rows.windows(2).all(|w| w[1].mach > w[0].mach);
        let finite = rows.iter().all(|r| r.mach.is_finite() && r.drag.is_finite() && r.lift.is_finite());
        (rows.len() >= 2 && ascending && finite).then(|| Self {
            mach: rows.iter().map(|r| r.mach).collect(),
            drag: rows.iter().map(|r| r.drag).collect(),
            lift: rows.iter().map(|r| r.lift).collect(),
        })
    }
}

/// The vehicle as it really is.
#[derive(Clone, Debug, PartialEq)]
pub struct Vehicle {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Reference area, m².
    pub reference_area_m2: f64,
    /// Nose radius, m.
    pub nose_radius_m: f64,
    /// Trim angle of attack, rad; negative is nose below the velocity, lift up at zero bank.
    pub trim_angle_of_attack_rad: f64,
    /// Coefficients before the factors below.
    pub coefficients: Coefficients,
    /// Factor on drag.
    pub drag_factor: f64,
    /// Factor on lift.
    pub lift_factor: f64,
}

impl Vehicle {
    /// Drag and lift acceleration per unit of dynamic pressure, m/s² per Pa. `mach` is asked for only when needed.
    pub(crate) fn acceleration_per_pressure(&self, mach: impl FnOnce() -> f64) -> (f64, f64) {
        let (drag, lift) = match &self.coefficients {
            Coefficients::Constant { drag, lift } => (*drag, *lift),
            Coefficients::ByMach(table) => {
                let (row, fraction) = locate(&table.mach, mach());
                let f = fraction.clamp(0.0, 1.0);
                let between = |c: &[f64]| c[row] + f * (c[row + 1] - c[row]);
                (between(&table.drag), between(&table.lift))
            }
        };
        let area_per_mass = self.reference_area_m2 / self.mass_kg;
        (drag * self.drag_factor * area_per_mass, lift * self.lift_factor * area_per_mass)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coefficients_are_linear_in_mach_and_scaled() {
        let rows = [Row { mach: 1.0, drag: 1.2, lift: 0.1 }, Row { mach: 3.0, drag: 1.6, lift: 0.3 }];
        let vehicle = Vehicle {
            mass_kg: 2.0,
            reference_area_m2: 4.0,
            nose_radius_m: 1.0,
            trim_angle_of_attack_rad: -0.28,
            coefficients: Coefficients::ByMach(MachTable::new(&rows).unwrap()),
            drag_factor: 1.1,
            lift_factor: 0.5,
        };
        for (mach, drag, lift) in [(0.2, 1.2, 0.1), (2.0, 1.4, 0.2), (25.0, 1.6, 0.3)] {
            let (d, l) = vehicle.acceleration_per_pressure(|| mach);
            assert!((d - 2.0 * 1.1 * drag).abs() < 1e-12 && (l - 2.0 * 0.5 * lift).abs() < 1e-12, "{mach}");
        }
        assert_eq!(MachTable::new(&[rows[1], rows[0]]), None);
        assert_eq!(MachTable::new(&rows[..1]), None);
    }
}
