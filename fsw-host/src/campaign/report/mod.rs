//! The report of a campaign: one self-contained HTML page made from the table of all runs and nothing else.

mod causes;
mod conditions;
mod history;
pub mod misses;
mod page;
mod split;
mod tables;

pub use page::document;

use std::io;

use super::identity::Identity;
use super::summary::{Runs, Summary};
use crate::record::ScenarioFacts;
use crate::report::{Figure, PlotError, Point};
use hil_sim::scenario::Scenario;

/// Points of one cloud that are drawn at most; of more, the outermost and an even sample of the rest.
const DRAWN: usize = 3_000;
/// How many are the outermost: so few that where they begin does not look like a ring.
const OUTERMOST: usize = 30;

/// What a report is made from.
pub struct Material<'a> {
    /// The table.
    pub runs: &'a Runs,
    /// Its figures.
    pub summary: &'a Summary,
    /// What was flown.
    pub scenario: &'a Scenario,
    /// Its facts.
    pub facts: &'a ScenarioFacts,
    /// What the campaign is about.
    pub identity: &'a Identity,
}

/// A report could not be made.
#[derive(Debug, thiserror::Error)]
pub enum CampaignReportError {
    /// The table cannot be read.
    #[error(transparent)]
    Table(#[from] io::Error),
    /// A plot cannot be drawn.
    #[error(transparent)]
    Plot(#[from] PlotError),
}

/// The page.
///
/// # Errors
/// The table cannot be read or a plot not be drawn.
pub fn html(material: &Material<'_>) -> Result<String, CampaignReportError> {
    let sections = vec![
        ("miss", "Miss", misses::figures(material)?),
        ("split", "Where the miss comes from", split::figures(material)?),
        ("deploy", "Deployment, loads and heat", conditions::figures(material)?),
        ("guidance", "Guidance and navigation", history::figures(material)?),
    ];
    page::html(material, &sections)
}

/// Sections of figures: anchor, name, figures.
type Sections = Vec<(&'static str, &'static str, Vec<Figure>)>;

/// The points of a cloud that are drawn: all of a small one; of a large one the outermost, as `size` says, and every
/// so many of the rest.
fn thinned(points: &[Point], size: impl Fn(&Point) -> f64) -> Vec<Point> {
    if points.len() <= DRAWN {
        return points.to_vec();
    }
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|a, b| size(&points[*b]).total_cmp(&size(&points[*a])).then(a.cmp(b)));
    let (outer, inner) = order.split_at(OUTERMOST);
    let every = inner.len().div_ceil(DRAWN - OUTERMOST);
    let mut inner = inner.to_vec();
    inner.sort_unstable();
    outer.iter().copied().chain(inner.into_iter().step_by(every)).map(|k| points[k]).collect()
}

/// A histogram as the outlines of its bars: (left, right, share in percent).
fn histogram(values: &[f64], bars: usize) -> Vec<(f64, f64, f64)> {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let (low, high) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
    if finite.is_empty() {
        return Vec::new();
    }
    let width = ((high - low) / bars as f64).max(1e-9 * high.abs()).max(1e-9);
    let mut counts = vec![0u32; bars];
    for value in &finite {
        let bar = (((value - low) / width) as usize).min(bars - 1);
        counts[bar] += 1;
    }
    let share = |count: u32| 100.0 * f64::from(count) / finite.len() as f64;
    let bar = |(k, count): (usize, &u32)| (low + k as f64 * width, low + (k + 1) as f64 * width, share(*count));
    counts.iter().enumerate().map(bar).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_cloud_keeps_its_outermost_points() {
        let points: Vec<Point> = (0..50_000).map(|k| (f64::from(k), 0.0)).collect();
        let drawn = thinned(&points, |p| p.0);
        assert!(drawn.len() <= DRAWN && drawn.len() > DRAWN * 9 / 10);
        assert!(drawn.contains(&(49_999.0, 0.0)) && drawn.contains(&(49_971.0, 0.0)) && drawn.contains(&(0.0, 0.0)));
        let lower_half = drawn.iter().filter(|p| p.0 < 25_000.0).count();
        assert!(lower_half.abs_diff(drawn.len() / 2) <= OUTERMOST, "an even sample shows the density as it is");
    }

    #[test]
    fn the_bars_of_a_histogram_hold_everything() {
        let bars = histogram(&[1.0, 2.0, 2.0, 3.0, f64::NAN], 4);
        assert_eq!(bars.len(), 4);
        assert!((bars.iter().map(|b| b.2).sum::<f64>() - 100.0).abs() < 1e-9);
        assert_eq!(histogram(&[2.0, 2.0], 3).iter().map(|b| b.2).sum::<f64>(), 100.0);
        assert!(histogram(&[], 3).is_empty());
    }
}
