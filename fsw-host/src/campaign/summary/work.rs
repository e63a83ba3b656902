//! Work of guidance over all cycles of all runs.

use std::io;

use serde::{Deserialize, Serialize};

use crate::campaign::runs::Runs;
use crate::campaign::statistics::ascending;

/// Work of guidance over the cycles that predicted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Guidance {
    /// Mean predictor calls a cycle.
    pub predictions_per_cycle: Option<f64>,
    /// Most in any cycle.
    pub max_predictions: i64,
    /// Mean evaluations of the equations of motion a cycle.
    pub evaluations_per_cycle: Option<f64>,
    /// Most in any cycle.
    pub max_evaluations: i64,
}

impl Guidance {
    /// Means over all cycles of all runs: each run counts with its number of cycles.
    pub(super) fn of(runs: &Runs) -> io::Result<Self> {
        let cycles = runs.numbers("cycles")?;
        let weighted = |name: &str| {
            let values = runs.numbers(name)?;
            let known = || values.iter().zip(&cycles).filter(|(value, _)| value.is_finite());
            let (sum, weight) = known().fold((0.0, 0.0), |(sum, weight), (v, n)| (sum + v * n, weight + n));
            io::Result::Ok((weight > 0.0).then_some(sum / weight))
        };
        let most = |name: &str| runs.numbers(name).map(|values| ascending(&values).last().map_or(0, |v| *v as i64));
        Ok(Self {
            predictions_per_cycle: weighted("predictions_mean")?,
            max_predictions: most("predictions_max")?,
            evaluations_per_cycle: weighted("evaluations_mean")?,
            max_evaluations: most("evaluations_max")?,
        })
    }
}
