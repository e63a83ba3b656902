//! [`Aerodynamics`]: drag and lift coefficients at the trim angle of attack.

use super::{ModelError, finite, positive};
use crate::math::{Scalar, Table, TableRow};
use crate::model::parameters::{AeroRow, MAX_AERO_ROWS, VehicleParameters};

/// Drag and lift coefficients, constant or by Mach number (linear between rows, constant beyond).
#[derive(Clone, Debug, PartialEq)]
pub struct Aerodynamics {
    /// Drag and lift coefficient, where they are the same at every Mach number.
    constant: Option<(f64, f64)>,
    /// Else by Mach number; columns: drag, lift coefficient.
    by_mach: Table<2, MAX_AERO_ROWS>,
}

impl Aerodynamics {
    /// Constant coefficients when `rows` is empty, else the table.
    ///
    /// # Errors
    /// A drag coefficient that is not positive, a lift coefficient that is not finite, rows that are not sorted.
    pub fn new(vehicle: &VehicleParameters, rows: &[AeroRow]) -> Result<Self, ModelError> {
        let mut aero = Self::none();
        aero.set(vehicle, rows)?;
        Ok(aero)
    }

    /// Nothing: the state before parameters are known.
    #[must_use]
    pub const fn none() -> Self {
        Self { constant: None, by_mach: Table::empty() }
    }

    /// Becomes [`Self::new`] in place.
    ///
    /// # Errors
    /// As [`Self::new`]; what is left then is not to be used.
    pub fn set(&mut self, vehicle: &VehicleParameters, rows: &[AeroRow]) -> Result<(), ModelError> {
        self.constant = None;
        if rows.is_empty() {
            let drag = positive("drag coefficient", vehicle.drag_coefficient)?;
            self.constant = Some((drag, drag * finite("lift-to-drag ratio", vehicle.lift_to_drag)?));
            return Ok(());
        }
        for row in rows {
            positive("drag coefficient of a table row", row.drag_coefficient)?;
        }
        let rows = rows.iter().map(|row| TableRow { x: row.mach, y: [row.drag_coefficient, row.lift_coefficient] });
        self.by_mach.fill(rows).map_err(ModelError::AeroTable)
    }

    /// Drag and lift coefficient at a Mach number.
    #[must_use]
    pub fn coefficients<S: Scalar>(&self, mach: S) -> (S, S) {
        match self.constant {
            Some((drag, lift)) => (S::from_f64(drag), S::from_f64(lift)),
            None => {
                let [drag, lift] = self.by_mach.at(mach);
                (drag, lift)
            }
        }
    }

    /// Drag and lift coefficient where they are the same at every Mach number.
    #[must_use]
    pub const fn constant(&self) -> Option<(f64, f64)> {
        self.constant
    }

    /// True when the coefficients depend on the Mach number.
    #[must_use]
    pub fn depends_on_mach(&self) -> bool {
        self.constant.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::TableError;

    const CAPSULE: VehicleParameters = VehicleParameters {
        mass_kg: 2804.0,
        reference_area_m2: 15.9,
        nose_radius_m: 1.125,
        drag_coefficient: 1.45,
        lift_to_drag: 0.24,
        trim_angle_of_attack_rad: -0.279,
    };

    fn row(mach: f64, drag_coefficient: f64, lift_coefficient: f64) -> AeroRow {
        AeroRow { mach, drag_coefficient, lift_coefficient }
    }

    #[test]
    fn without_rows_the_coefficients_are_constant() {
        let aero = Aerodynamics::new(&CAPSULE, &[]).unwrap();
        assert!(!aero.depends_on_mach());
        for mach in [0.0, 2.0, 30.0] {
            assert_eq!(aero.coefficients(mach), (1.45, 1.45 * 0.24));
        }
    }

    #[test]
    fn with_rows_they_follow_the_mach_number_and_hold_at_the_ends() {
        let aero = Aerodynamics::new(&CAPSULE, &[row(1.0, 1.2, 0.1), row(5.0, 1.6, 0.3)]).unwrap();
        assert!(aero.depends_on_mach());
        for (mach, drag, lift) in [(0.5, 1.2, 0.1), (3.0, 1.4, 0.2), (25.0, 1.6, 0.3)] {
            let (cd, cl) = aero.coefficients(mach);
            assert!((cd - drag).abs() < 1e-15 && (cl - lift).abs() < 1e-15);
        }
    }

    #[test]
    fn coefficients_that_make_no_sense_are_refused() {
        let negative = VehicleParameters { drag_coefficient: -1.0, ..CAPSULE };
        assert!(matches!(Aerodynamics::new(&negative, &[]), Err(ModelError::NotPositive { .. })));
        let bottomless = VehicleParameters { lift_to_drag: f64::NAN, ..CAPSULE };
        assert!(matches!(Aerodynamics::new(&bottomless, &[]), Err(ModelError::NotFinite { .. })));
        let unsorted = [row(5.0, 1.2, 0.1), row(1.0, 1.6, 0.3)];
        assert_eq!(
            Aerodynamics::new(&CAPSULE, &unsorted),
            Err(ModelError::AeroTable(TableError::NotIncreasing { row: 1 }))
        );
    }
}
