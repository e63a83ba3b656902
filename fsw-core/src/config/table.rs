//! A table that arrives in blocks of a few rows.

use core::ops::Deref;

use heapless::Vec;

use crate::link::parameters::ROWS_PER_BLOCK;

/// Rows that do not fit, or that would leave a gap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadRows;

/// Up to `N` rows and how many are announced; reads as a slice of the rows present.
#[derive(Clone, Debug, PartialEq)]
pub struct RowTable<R, const N: usize> {
    rows: Vec<R, N>,
    announced: u8,
}

impl<R, const N: usize> Deref for RowTable<R, N> {
    type Target = [R];

    fn deref(&self) -> &[R] {
        &self.rows
    }
}

impl<R: Copy + Default, const N: usize> RowTable<R, N> {
    /// A table without rows.
    #[must_use]
    pub const fn new() -> Self {
        Self { rows: Vec::new(), announced: 0 }
    }

    /// Whether all announced rows are present.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.rows.len() == usize::from(self.announced)
    }

    /// Takes rows `start` and following of a table of `total` rows. Row 0 starts a new table unless it repeats the
    /// one under way; later rows must follow those present or repeat them. `start` 0 and `total` 0 empties the table.
    ///
    /// # Errors
    /// [`BadRows`], and the table is as before.
    pub fn load(&mut self, start: u8, total: u8, rows: &[R; ROWS_PER_BLOCK]) -> Result<(), BadRows> {
        let first = usize::from(start);
        let end = usize::from(total);
        let aligned = first.is_multiple_of(ROWS_PER_BLOCK);
        let continues = total == self.announced && first <= self.rows.len();
        let fits = end <= N && (first < end || end == 0 && first == 0);
        if !aligned || !fits || !(first == 0 || continues) {
            return Err(BadRows);
        }
        if !continues || end == 0 {
            self.rows.clear();
        }
        self.announced = total;
        for (index, row) in (first..end).zip(rows) {
            match self.rows.get_mut(index) {
                Some(present) => *present = *row,
                None => self.rows.push(*row).map_err(|_| BadRows)?,
            }
        }
        Ok(())
    }

    /// Announced length and the rows from `start`, padded with defaults; `None` where no block starts.
    #[must_use]
    pub fn block(&self, start: u8) -> Option<(u8, [R; ROWS_PER_BLOCK])> {
        let first = usize::from(start);
        let exists = first < self.rows.len() || first == 0;
        if !exists || !first.is_multiple_of(ROWS_PER_BLOCK) {
            return None;
        }
        let mut rows = [R::default(); ROWS_PER_BLOCK];
        for (slot, row) in rows.iter_mut().zip(self.rows.iter().skip(first)) {
            *slot = *row;
        }
        Some((self.announced, rows))
    }
}

impl<R: Copy + Default, const N: usize> Default for RowTable<R, N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn six_rows() -> RowTable<u16, 8> {
        let mut table = RowTable::new();
        table.load(0, 6, &[1, 2, 3, 4]).unwrap();
        assert!(!table.is_complete());
        table.load(4, 6, &[5, 6, 99, 99]).unwrap();
        table
    }

    #[test]
    fn blocks_join_to_the_table_and_rows_beyond_the_total_are_ignored() {
        let table = six_rows();
        assert_eq!(*table, [1, 2, 3, 4, 5, 6]);
        assert!(table.is_complete());
        assert_eq!(table.block(4), Some((6, [5, 6, 0, 0])));
    }

    #[test]
    fn a_repeated_block_changes_nothing() {
        let mut table = six_rows();
        table.load(4, 6, &[5, 6, 0, 0]).unwrap();
        table.load(0, 6, &[1, 2, 3, 4]).unwrap();
        assert_eq!(table, six_rows());
    }

    #[test]
    fn a_table_of_another_length_replaces_the_old_one() {
        let mut table = six_rows();
        table.load(0, 2, &[7, 8, 0, 0]).unwrap();
        assert_eq!(*table, [7, 8]);
        table.load(0, 0, &[0; 4]).unwrap();
        assert!(table.is_empty() && table.is_complete());
    }

    #[test]
    fn gaps_misalignment_and_excess_are_refused_and_change_nothing() {
        for (start, total) in [(4, 9), (2, 6), (8, 9), (4, 5), (4, 4), (12, 16), (255, 255), (0, 9)] {
            let mut table = six_rows();
            assert_eq!(table.load(start, total, &[0; 4]), Err(BadRows), "{start} of {total}");
            assert_eq!(table, six_rows());
        }
        assert_eq!(RowTable::<u16, 8>::new().load(4, 8, &[0; 4]), Err(BadRows));
    }

    #[test]
    fn there_is_no_block_beyond_the_rows() {
        assert_eq!(six_rows().block(8), None);
        assert_eq!(six_rows().block(2), None);
        assert_eq!(RowTable::<u16, 8>::new().block(0), Some((0, [0; 4])));
    }
}
