//! [`Aerodynamics`]: drag and lift coefficients at the trim angle of attack.

use super::{ModelError, finite, positive};
use crate::link::parameters::{AeroRow, MAX_AERO_ROWS, VehicleParameters};
use crate::math::{Scalar, Table, TableRow};

/// Drag and lift coefficients, constant or by Mach number (linear between rows, constant beyond).
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "without an allocator the table lives in place")]
pub enum Aerodynamics {
    /// The same at every Mach number.
    Constant {
        /// Drag coefficient.
        drag: f64,
        /// Lift coefficient.
        lift: f64,
    },
    /// By Mach number; columns: drag, lift coefficient.
    ByMach(Table<2, MAX_AERO_ROWS>),
}

impl Aerodynamics {
    /// Constant coefficients when `rows` is empty, else the table.
    ///
    /// # Errors
    /// A drag coefficient that is not positive, a lift coefficient that is not finite, rows that are not sorted.
    pub fn new(vehicle: &VehicleParameters, rows: &[AeroRow]) -> Result<Self, ModelError> {
        if rows.is_empty() {
            let drag = positive("drag coefficient", vehicle.drag_coefficient)?;
            return Ok(Self::Constant { drag, lift: drag * finite("lift-to-drag ratio", vehicle.lift_to_drag)? });
        }
        for row in rows {
            positive("drag coefficient of a table row", row.drag_coefficient)?;
        }
        let rows = rows.iter().map(|row| TableRow { x: row.mach, y: [row.drag_coefficient, row.lift_coefficient] });
        Table::new(rows).map(Self::ByMach).map_err(ModelError::AeroTable)
    }

    /// Drag and lift coefficient at a Mach number.
    #[must_use]
    pub fn coefficients<S: Scalar>(&self, mach: S) -> (S, S) {
        match self {
            Self::Constant { drag, lift } => (S::from_f64(*drag), S::from_f64(*lift)),
            Self::ByMach(rows) => {
                let [drag, lift] = rows.at(mach);
                (drag, lift)
            }
        }
    }

    /// True when the coefficients depend on the Mach number.
    #[must_use]
    pub fn depends_on_mach(&self) -> bool {
        matches!(self, Self::ByMach(_))
    }
}
