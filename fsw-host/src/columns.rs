//! [`aligned`]: rows of cells in columns as narrow as they can be, for a terminal.

use console::{Alignment, measure_text_width, pad_str};

/// Before each line.
const INDENT: &str = "  ";
/// Between two columns.
const GAP: &str = "  ";

/// Lines of a table: its head, in two lines where a name of several words is wider than what stands under it, then its rows.
/// The first column is flush left, as are those of `left`; the others are flush right.
#[must_use]
pub fn aligned<R: AsRef<[String]>>(head: &[String], rows: &[R], left: &[usize]) -> String {
    let widest = |at: usize| {
        let cells = rows.iter().filter_map(|row| row.as_ref().get(at));
        cells.map(|cell| measure_text_width(cell)).max().unwrap_or(0)
    };
    let heads: Vec<[String; 2]> = head.iter().enumerate().map(|(at, name)| folded(name, widest(at))).collect();
    let widths: Vec<usize> = heads
        .iter()
        .enumerate()
        .map(|(at, lines)| lines.iter().map(|line| measure_text_width(line)).fold(widest(at), usize::max))
        .collect();
    let line = |cells: &[String]| {
        let padded = cells.iter().zip(&widths).enumerate().map(|(at, (cell, width))| {
            let side = if at == 0 || left.contains(&at) { Alignment::Left } else { Alignment::Right };
            pad_str(cell, *width, side, None).into_owned()
        });
        format!("{INDENT}{}", padded.collect::<Vec<_>>().join(GAP)).trim_end().to_owned() + "\n"
    };
    let upper: Vec<String> = heads.iter().map(|[upper, _]| upper.clone()).collect();
    let lower: Vec<String> = heads.into_iter().map(|[_, lower]| lower).collect();
    let folded = (!upper.iter().all(String::is_empty)).then(|| line(&upper));
    folded.into_iter().chain([line(&lower)]).chain(rows.iter().map(|row| line(row.as_ref()))).collect()
}

/// A name in two lines, the upper one empty when it fits or is one word: broken where the longer line is shortest.
fn folded(name: &str, width: usize) -> [String; 2] {
    let whole = [String::new(), name.to_owned()];
    if measure_text_width(name) <= width {
        return whole;
    }
    let halves = name.match_indices(' ').map(|(at, _)| [name[..at].to_owned(), name[at + 1..].to_owned()]);
    let longer = |lines: &[String; 2]| lines.iter().map(|line| measure_text_width(line)).max().unwrap_or(0);
    halves.min_by_key(longer).unwrap_or(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell_and_long_heads_take_two_lines() {
        let row = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
        let rows = [row(["ekf", "1", "2.50", "σ of it"]), row(["longer", "10", "–", "x"])];
        let table = aligned(&row(["filter", "m", "mean cost", "why"]), &rows, &[3]);
        assert_eq!(
            table,
            "              mean\n  filter   m  cost  why\n  ekf      1  2.50  σ of it\n  longer  10     –  x\n"
        );
    }

    #[test]
    fn a_table_without_long_heads_has_one_line_of_them() {
        let names = ["a b".to_owned(), "c".to_owned()];
        assert_eq!(aligned(&names, &[["wide".to_owned(), "1".to_owned()]], &[]), "  a b   c\n  wide  1\n");
        assert_eq!(aligned::<[String; 2]>(&names, &[], &[]), "  a\n  b  c\n");
    }
}
