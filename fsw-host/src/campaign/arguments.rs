//! Numbers on the command line: what is none, or out of range, is refused with the range.

use std::num::NonZeroUsize;

/// Most runs of a campaign: their numbers and the sums of their figures stay exact.
pub const MOST_RUNS: u64 = 1_000_000_000;
/// Most threads of a campaign.
const MOST_THREADS: u64 = 1_024;

/// A parser of whole numbers from `low` to `high`.
pub fn whole(low: u64, high: u64) -> impl Fn(&str) -> Result<u64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.parse().ok().filter(|number| (low..=high).contains(number));
        number.ok_or_else(|| format!("expected a whole number from {low} to {high}"))
    }
}

/// A number of threads.
///
/// # Errors
/// It is none, or out of range.
pub fn threads(text: &str) -> Result<NonZeroUsize, String> {
    let number = whole(1, MOST_THREADS)(text)?;
    usize::try_from(number).ok().and_then(NonZeroUsize::new).ok_or_else(|| "too many threads".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_in_range_is_refused_with_the_range() {
        let runs = whole(1, 1000);
        assert_eq!(runs("1"), Ok(1));
        assert_eq!(runs("1000"), Ok(1000));
        for bad in ["0", "-5", "1001", "many", "1e3", "2.5", "", "99999999999999999999"] {
            assert_eq!(runs(bad), Err("expected a whole number from 1 to 1000".to_owned()), "{bad}");
        }
        assert_eq!(threads("2").map(NonZeroUsize::get), Ok(2));
        assert!(threads("0").is_err() && threads("100000").is_err());
    }
}
