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

/// Sorted rows with linear interpolation between them; at most `CAPACITY` rows, at least one.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<const COLUMNS: usize, const CAPACITY: usize> {
    rows: Vec<TableRow<COLUMNS>, CAPACITY>,
}

/// Halvings of the search; enough for any table of up to 2³² rows.
const MAX_HALVINGS: usize = 32;

impl<const COLUMNS: usize, const CAPACITY: usize> Table<COLUMNS, CAPACITY> {
    /// A table from its rows, in increasing order of the abscissa.
    ///
    /// # Errors
    /// No rows, too many rows, a number that is not finite, or an abscissa that does not increase.
    pub fn new(rows: impl IntoIterator<Item = TableRow<COLUMNS>>) -> Result<Self, TableError> {
        let mut sorted: Vec<TableRow<COLUMNS>, CAPACITY> = Vec::new();
        for (index, row) in rows.into_iter().enumerate() {
            if !(row.x.is_finite() && row.y.iter().all(|y| y.is_finite())) {
                return Err(TableError::NotFinite { row: index });
            }
            if sorted.last().is_some_and(|last| row.x <= last.x) {
                return Err(TableError::NotIncreasing { row: index });
            }
            sorted.push(row).map_err(|_| TableError::TooManyRows { capacity: CAPACITY })?;
        }
        if sorted.is_empty() { Err(TableError::Empty) } else { Ok(Self { rows: sorted }) }
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

    /// The rows around `x`.
    fn bracket(&self, x: f64) -> Bracket<'_, COLUMNS> {
        const { assert!(CAPACITY > 0, "a table holds at least one row") };
        let (Some(first), Some(last)) = (self.rows.first(), self.rows.last()) else {
            return Bracket::Beyond(&TableRow { x: 0.0, y: [0.0; COLUMNS] });
        };
        if x.is_nan() || x <= first.x {
            return Bracket::Beyond(first);
        }
        if x >= last.x {
            return Bracket::Beyond(last);
        }
        let (mut below, mut above) = (first, last);
        let (mut low, mut high) = (0, self.rows.len() - 1);
        for _ in 0..MAX_HALVINGS {
            let middle = low + (high - low) / 2;
            let Some(row) = self.rows.get(middle) else { break };
            if middle == low {
                break;
            }
            if row.x <= x {
                (low, below) = (middle, row);
            } else {
                (high, above) = (middle, row);
            }
        }
        Bracket::Between(below, above)
    }
}

/// Where an abscissa lies in the table.
enum Bracket<'a, const COLUMNS: usize> {
    /// Beyond this end.
    Beyond(&'a TableRow<COLUMNS>),
    /// Between these neighbours.
    Between(&'a TableRow<COLUMNS>, &'a TableRow<COLUMNS>),
}
