//! A measured figure against its limit and against what was recorded last.

use super::file::{Budget, written};

/// Growth and shrinking within this share of the recorded value pass without a word.
const TOLERANCE: f64 = 0.01;

/// What is to be said of a figure.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    Within,
    /// Smaller than recorded: worth recording.
    Shrunk(String),
    /// A sentence for the developer.
    Failed(String),
}

/// Holds a figure against its budget.
pub fn judge(budget: &Budget, measured: Option<f64>) -> Verdict {
    let Budget { metric, target, unit, .. } = budget;
    let Some(measured) = measured else { return Verdict::Failed(format!("{target}: {metric} was not measured")) };
    let figure = format!("{target}: {metric} is {} {unit}", written(measured));
    if let Some(limit) = budget.limit
        && measured > limit
    {
        return Verdict::Failed(format!("{figure}, the limit is {}", written(limit)));
    }
    let Some(recorded) = budget.recorded else {
        return Verdict::Failed(format!("{figure} and nothing is recorded: cargo xtask budgets --bless"));
    };
    let change = measured - recorded;
    if change > recorded.abs() * TOLERANCE {
        let hint = "record it in the commit that makes it grow: cargo xtask budgets --bless";
        return Verdict::Failed(format!("{figure}, more than 1 % above the recorded {}; {hint}", written(recorded)));
    }
    if -change > recorded.abs() * TOLERANCE {
        return Verdict::Shrunk(format!("{figure}, recorded {}: cargo xtask budgets --bless", written(recorded)));
    }
    Verdict::Within
}

#[cfg(test)]
mod tests {
    use super::super::file::Source;
    use super::*;

    fn verdict(limit: Option<f64>, recorded: Option<f64>, measured: Option<f64>) -> Verdict {
        let (metric, target, unit) = ("flash_bytes".into(), "m7".into(), "B".into());
        judge(&Budget { metric, target, unit, source: Source::Image, limit, recorded }, measured)
    }

    #[test]
    fn more_than_the_limit_fails_even_when_it_was_recorded() {
        let failed = verdict(Some(1000.0), Some(1001.0), Some(1001.0));
        assert_eq!(failed, Verdict::Failed("m7: flash_bytes is 1_001 B, the limit is 1_000".into()));
        assert_eq!(verdict(Some(1000.0), Some(1000.0), Some(1000.0)), Verdict::Within);
    }

    #[test]
    fn growth_above_one_per_cent_fails_and_less_passes() {
        assert!(matches!(verdict(None, Some(1000.0), Some(1010.1)), Verdict::Failed(_)));
        assert_eq!(verdict(None, Some(1000.0), Some(1010.0)), Verdict::Within);
        assert!(matches!(verdict(None, Some(0.0), Some(1.0)), Verdict::Failed(_)));
    }

    #[test]
    fn shrinking_gives_a_hint() {
        assert!(matches!(verdict(None, Some(1000.0), Some(989.0)), Verdict::Shrunk(_)));
    }

    #[test]
    fn what_is_not_measured_or_not_recorded_fails() {
        assert!(matches!(verdict(Some(1.0), Some(1.0), None), Verdict::Failed(_)));
        assert!(matches!(verdict(Some(1.0), None, Some(1.0)), Verdict::Failed(_)));
    }
}
