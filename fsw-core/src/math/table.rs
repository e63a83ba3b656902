//! [`Table`]: linear interpolation in sorted rows, held constant beyond both ends.

use heapless::Vec;

use super::Scalar;

/// One row of a table: `COLUMNS` values at the abscissa `x`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableRow<const COLUMNS: usize> {
    /// Abscissa.
    pub x: f64,
    /// Values there.
    pub y: [f64; COLUMNS],
}

/// Why rows do not make a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TableError {
    /// There is no row.
    Empty,
    /// There are more rows than the capacity.
    TooManyRows {
        /// Rows the table can hold.
        capacity: usize,
    },
    /// A number of this row is not finite.
    NotFinite {
        /// Index of the row.
        row: usize,
    },
    /// The abscissa of this row is not above that of the row before.
    NotIncreasing {
        /// Index of the row.
        row: usize,
    },
}

impl core::fmt::Display for TableError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Empty => f.write_str("the table has no rows"),
            Self::TooManyRows { capacity } => write!(f, "the table has more than {capacity} rows"),
            Self::NotFinite { row } => write!(f, "row {row} has a number that is not finite"),
            Self::NotIncreasing { row } => write!(f, "row {row} is not above the row before it"),
        }
    }
}

impl core::error::Error for TableError {}

/// Sorted rows with linear interpolation between them; at most `CAPACITY` rows. Without rows it is zero everywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<const COLUMNS: usize, const CAPACITY: usize> {
    rows: Vec<TableRow<COLUMNS>, CAPACITY>,
}

impl<const COLUMNS: usize, const CAPACITY: usize> Table<COLUMNS, CAPACITY> {
    /// A table from its rows, in increasing order of the abscissa.
    ///
    /// # Errors
    /// No rows, too many rows, a number that is not finite, or an abscissa that does not increase.
    pub fn new(rows: impl IntoIterator<Item = TableRow<COLUMNS>>) -> Result<Self, TableError> {
        let mut table = Self::empty();
        table.fill(rows)?;
        Ok(table)
    }

    /// A table without rows.
    #[must_use]
    pub const fn empty() -> Self {
        Self { rows: Vec::new() }
    }

    /// Replaces the rows, in place.
    ///
    /// # Errors
    /// As [`Self::new`]; the table then holds the rows before the one at fault.
    pub fn fill(&mut self, rows: impl IntoIterator<Item = TableRow<COLUMNS>>) -> Result<(), TableError> {
        self.rows.clear();
        for (index, row) in rows.into_iter().enumerate() {
            if !(row.x.is_finite() && row.y.iter().all(|y| y.is_finite())) {
                return Err(TableError::NotFinite { row: index });
            }
            if self.rows.last().is_some_and(|last| row.x <= last.x) {
                return Err(TableError::NotIncreasing { row: index });
            }
            self.rows.push(row).map_err(|_| TableError::TooManyRows { capacity: CAPACITY })?;
        }
        if self.rows.is_empty() { Err(TableError::Empty) } else { Ok(()) }
    }

    /// The values at `x`; those of the nearest end beyond the table, with derivative zero there. NaN gives the first row.
    #[must_use]
    pub fn at<S: Scalar>(&self, x: S) -> [S; COLUMNS] {
        match self.bracket(x.value()) {
            Bracket::Beyond(row) => row.y.map(S::from_f64),
            Bracket::Between(low, high) => {
                let weight = (x - low.x) * (1.0 / (high.x - low.x));
                let mut values = low.y.map(S::from_f64);
                for ((value, y0), y1) in values.iter_mut().zip(&low.y).zip(&high.y) {
                    *value = weight * (y1 - y0) + *y0;
                }
                values
            }
        }
    }

    /// Slopes per unit of the abscissa at `x`; zero beyond the ends.
    #[must_use]
    pub fn slope_at(&self, x: f64) -> [f64; COLUMNS] {
        let mut slopes = [0.0; COLUMNS];
        if let Bracket::Between(low, high) = self.bracket(x) {
            let inverse = 1.0 / (high.x - low.x);
            for ((slope, y0), y1) in slopes.iter_mut().zip(&low.y).zip(&high.y) {
                *slope = (y1 - y0) * inverse;
            }
        }
        slopes
    }

    /// The rows, in increasing order of the abscissa.
    #[must_use]
    pub fn rows(&self) -> &[TableRow<COLUMNS>] {
        &self.rows
    }

    /// The rows around `x`. The search halves the rows: at most log₂ `CAPACITY` comparisons.
    fn bracket(&self, x: f64) -> Bracket<'_, COLUMNS> {
        let above = self.rows.partition_point(|row| row.x <= x);
        // Below the first row, and for NaN, nothing lies at or below `x`.
        let Some(index_below) = above.checked_sub(1) else {
            return Bracket::Beyond(self.rows.first().unwrap_or(&TableRow { x: 0.0, y: [0.0; COLUMNS] }));
        };
        match (self.rows.get(index_below), self.rows.get(above)) {
            (Some(low), Some(high)) => Bracket::Between(low, high),
            (Some(last), None) => Bracket::Beyond(last),
            // Not reached: an index below the length always has its row.
            (None, _) => Bracket::Beyond(&TableRow { x: 0.0, y: [0.0; COLUMNS] }),
        }
    }
}

/// Where an abscissa lies in the table.
enum Bracket<'a, const COLUMNS: usize> {
    /// Beyond this end.
    Beyond(&'a TableRow<COLUMNS>),
    /// Between these neighbours.
    Between(&'a TableRow<COLUMNS>, &'a TableRow<COLUMNS>),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Dual;
    use proptest::prelude::*;
    use std::vec::Vec as StdVec;

    fn row(x: f64, y: f64) -> TableRow<2> {
        TableRow { x, y: [y, -y] }
    }

    fn table() -> Table<2, 4> {
        Table::new([row(0.0, 1.0), row(1.0, 3.0), row(4.0, 0.0)]).unwrap()
    }

    #[test]
    fn rows_are_met_exactly_and_points_between_lie_on_the_chord() {
        for (x, y) in [(0.0, 1.0), (0.5, 2.0), (1.0, 3.0), (2.5, 1.5), (4.0, 0.0)] {
            assert_eq!(table().at(x), [y, -y], "{x}");
        }
    }

    #[test]
    fn the_ends_are_held() {
        for (x, y) in [(-9.0, 1.0), (f64::NEG_INFINITY, 1.0), (9.0, 0.0), (f64::INFINITY, 0.0), (f64::NAN, 1.0)] {
            assert_eq!(table().at(x), [y, -y], "{x}");
            assert_eq!(table().slope_at(x), [0.0, 0.0], "{x}");
        }
    }

    #[test]
    fn the_derivative_is_the_slope_of_the_segment_and_zero_beyond() {
        for (x, slope) in [(0.5, 2.0), (2.0, -1.0), (-1.0, 0.0), (5.0, 0.0)] {
            let [first, second] = table().at(Dual::<1>::variable(x, 0));
            assert_eq!((first.partials, second.partials), ([slope], [-slope]));
            assert_eq!(table().slope_at(x), [slope, -slope]);
        }
    }

    #[test]
    fn bad_rows_are_refused_with_the_row_that_is_bad() {
        let refused = |rows: &[TableRow<2>]| Table::<2, 4>::new(rows.iter().copied()).unwrap_err();
        assert_eq!(refused(&[]), TableError::Empty);
        assert_eq!(refused(&[row(0.0, 1.0); 2]), TableError::NotIncreasing { row: 1 });
        assert_eq!(refused(&[row(0.0, 1.0), row(f64::NAN, 1.0)]), TableError::NotFinite { row: 1 });
        assert_eq!(refused(&[row(0.0, f64::INFINITY)]), TableError::NotFinite { row: 0 });
        let five: StdVec<_> = (0..5).map(|i| row(f64::from(i), 0.0)).collect();
        assert_eq!(refused(&five), TableError::TooManyRows { capacity: 4 });
    }

    proptest! {
        #[test]
        fn the_search_finds_what_a_scan_finds(steps in prop::collection::vec(0.01..5.0f64, 1..40), at in -0.2..1.2f64) {
            let mut x = 0.0;
            let rows: StdVec<_> = steps.iter().map(|step| { x += step; TableRow { x, y: [x * x] } }).collect();
            let point = at * x;
            let scanned = match rows.iter().position(|r| r.x > point) {
                Some(0) => rows[0].y[0],
                None => rows[rows.len() - 1].y[0],
                Some(i) => rows[i - 1].y[0] + (point - rows[i - 1].x) * (rows[i].y[0] - rows[i - 1].y[0]) / (rows[i].x - rows[i - 1].x),
            };
            let [found] = Table::<1, 40>::new(rows).unwrap().at(point);
            // Same chord, other order of operations: rounding of numbers up to 4e4.
            prop_assert!((found - scanned).abs() < 1e-9, "{} {}", found, scanned);
        }
    }
}
