//! How a quantity is distributed over the runs: percentiles with bounds, ranges, shares within a distance.

use serde::{Deserialize, Serialize};

use crate::campaign::statistics::{Share, ascending, mean, percentile, wilson};

/// Distances within which runs are counted, km.
const RINGS_KM: [(f64, &str); RINGS] =
    [(0.05, "50 m"), (1.0, "1 km"), (2.0, "2 km"), (2.5, "2.5 km"), (5.0, "5 km"), (10.0, "10 km")];
/// Their number.
const RINGS: usize = 6;

/// Percentiles of a quantity, each with its bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Median.
    pub p50: f64,
    /// 90 %.
    pub p90: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
    /// 99.9 %.
    pub p999: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// 95 % bounds of the percentiles above.
    pub bounds: Bounds,
}

/// 95 % bounds of percentiles by order statistics: [lower, upper], none where the sample is too small for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Median.
    pub p50: [Option<f64>; 2],
    /// 90 %.
    pub p90: [Option<f64>; 2],
    /// 95 %.
    pub p95: [Option<f64>; 2],
    /// 99 %.
    pub p99: [Option<f64>; 2],
    /// 99.9 %.
    pub p999: [Option<f64>; 2],
}

/// Smallest, largest, mean and the middle 98 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// 1 %.
    pub p01: f64,
    /// Median.
    pub p50: f64,
    /// 99 %.
    pub p99: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// 95 % bounds of the percentiles above.
    pub bounds: SpreadBounds,
}

/// 95 % bounds of the percentiles of a [`Spread`], as in [`Bounds`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SpreadBounds {
    /// 1 %.
    pub p01: [Option<f64>; 2],
    /// Median.
    pub p50: [Option<f64>; 2],
    /// 99 %.
    pub p99: [Option<f64>; 2],
}

/// Shares of all runs, and of those that the flight software did not call unreachable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// Fifty metres.
    #[serde(rename = "50m")]
    pub m50: Option<Share>,
    /// One kilometre.
    #[serde(rename = "1km")]
    pub km1: Option<Share>,
    /// Two kilometres.
    #[serde(rename = "2km")]
    pub km2: Option<Share>,
    /// Two and a half kilometres.
    #[serde(rename = "2.5km")]
    pub km2_5: Option<Share>,
    /// Five kilometres.
    #[serde(rename = "5km")]
    pub km5: Option<Share>,
    /// Ten kilometres.
    #[serde(rename = "10km")]
    pub km10: Option<Share>,
}

impl Distribution {
    /// Of values in any order, gaps left out.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = ascending(values);
        let of = |q| percentile(&sorted, q);
        let (p50, p90, p95, p99, p999) = (of(0.5)?, of(0.9)?, of(0.95)?, of(0.99)?, of(0.999)?);
        Some(Self {
            p50: p50.value,
            p90: p90.value,
            p95: p95.value,
            p99: p99.value,
            p999: p999.value,
            max: sorted.last().copied()?,
            mean: mean(&sorted)?,
            bounds: Bounds {
                p50: p50.bounds(),
                p90: p90.bounds(),
                p95: p95.bounds(),
                p99: p99.bounds(),
                p999: p999.bounds(),
            },
        })
    }
}

impl Spread {
    /// Of values in any order, gaps left out.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = ascending(values);
        let of = |q| percentile(&sorted, q);
        let (p01, p50, p99) = (of(0.01)?, of(0.5)?, of(0.99)?);
        Some(Self {
            min: sorted.first().copied()?,
            p01: p01.value,
            p50: p50.value,
            p99: p99.value,
            max: sorted.last().copied()?,
            mean: mean(&sorted)?,
            bounds: SpreadBounds { p01: p01.bounds(), p50: p50.bounds(), p99: p99.bounds() },
        })
    }
}

impl Within {
    /// Shares of `misses` (NaN for a run that did not deploy) among all of them.
    #[must_use]
    pub fn of(misses: &[f64]) -> Self {
        let share = |km: f64| {
            let hits = misses.iter().filter(|m| **m <= km * 1e3).count() as u64;
            wilson(hits, misses.len() as u64)
        };
        let [m50, km1, km2, km2_5, km5, km10] = RINGS_KM.map(|(km, _)| share(km));
        Self { m50, km1, km2, km2_5, km5, km10 }
    }

    /// The rings with their names, in order.
    #[must_use]
    pub fn rings(&self) -> [(&'static str, Option<Share>); RINGS] {
        let shares = [self.m50, self.km1, self.km2, self.km2_5, self.km5, self.km10];
        std::array::from_fn(|k| (RINGS_KM[k].1, shares[k]))
    }
}
