//! Where the runs deployed about the target, and how the miss is distributed.

use super::super::statistics::{pearson, quantile, wilson};
use super::super::summary::ascending;
use super::{CampaignReportError, Material, thinned};
use crate::report::{Anchor, Axis, Figure, Ink, Layer, Mark, Panel, Point};

/// Rings about the target, km.
const RINGS_KM: [f64; 7] = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0];
/// Points of a drawn closed curve.
const CORNERS: u32 = 120;
/// Smaller misses are drawn as this one on logarithmic axes, km.
const LEAST_KM: f64 = 1e-3;
/// Share of the runs inside the ellipse.
const ELLIPSE: f64 = 0.99;

/// Scatter and distribution of the miss.
pub fn figures(material: &Material<'_>) -> Result<Vec<Figure>, CampaignReportError> {
    let km = |name: &str| material.runs.numbers(name).map(|v| v.iter().map(|m| m * 1e-3).collect::<Vec<f64>>());
    let (down, cross, misses) = (km("downrange_error_m")?, km("crossrange_error_m")?, km("miss_m")?);
    let points: Vec<Point> = down.iter().copied().zip(cross.iter().copied()).filter(|p| p.0.is_finite()).collect();
    Ok(vec![scatter(&points, &misses), distribution(&misses)])
}

fn scatter(points: &[Point], misses: &[f64]) -> Figure {
    let sorted = ascending(misses);
    let max = sorted.last().copied().unwrap_or(1.0).max(0.02);
    let near = quantile(&sorted, 0.95).unwrap_or(max).max(0.01);
    let mut panels = vec![cloud(points, 1.08 * max, 420)];
    // Where a few outliers make the rest a speck, the rest is shown again.
    if max > 2.5 * near {
        panels.push(cloud(points, 1.08 * near, 420).named("the inner 95 %"));
    }
    let count = points.len();
    let sample = if count > super::DRAWN {
        " Of so many, the thirty outermost and an even sample of the rest are drawn."
    } else {
        ""
    };
    Figure {
        title: "Deploy points about the target",
        caption: format!(
            "{count} runs, downrange positive beyond the target, crossrange positive to the right. The ellipse has the \
             shape of the covariance and holds 99 % of the runs.{sample}"
        ),
        legend: vec![
            (Mark::Dot, Ink::Blue, "a run".into()),
            (Mark::Cross, Ink::Green, "target".into()),
            (Mark::Line, Ink::Orange, "99 % ellipse".into()),
        ],
        panels,
        missing: "No run deployed.",
    }
}

fn cloud(points: &[Point], reach: f64, height: u32) -> Panel {
    let x = Axis::fixed("downrange from the target, km", -reach, reach);
    let mut panel = Panel::new(x, Axis::fixed("crossrange, km", -reach, reach), height).equal_scale();
    // The three largest rings that fit; more would be a target disc, and smaller ones hide under the points.
    let fitting: Vec<f64> =
        RINGS_KM.iter().copied().filter(|radius| (0.15 * reach..0.98 * reach).contains(radius)).collect();
    for radius in fitting.iter().rev().take(3) {
        let ring = curve(|c, s| (radius * c, radius * s));
        let label = (0.72 * radius, 0.72 * radius);
        let name = if *radius < 1.0 { format!(" {} m", radius * 1e3) } else { format!(" {radius} km") };
        panel = panel.with(Layer::Line { points: ring, ink: Ink::Green, width: 1.1, opacity: 0.8 }).note(
            label,
            name,
            Ink::Green,
            Anchor::Start,
        );
    }
    let radius = if points.len() > 400 { 1.6 } else { 2.4 };
    panel = panel.dots(thinned(points, |p| p.0.hypot(p.1)), Ink::Blue, radius);
    if let Some(ellipse) = ellipse(points) {
        panel = panel.with(Layer::Line { points: ellipse, ink: Ink::Orange, width: 1.8, opacity: 1.0 });
    }
    panel.crosses(vec![(0.0, 0.0)], Ink::Green)
}

/// A closed curve, from the cosine and sine of the angle along it.
pub(crate) fn curve(at: impl Fn(f64, f64) -> Point) -> Vec<Point> {
    let angle = |k: u32| f64::from(k) * std::f64::consts::TAU / f64::from(CORNERS);
    (0..=CORNERS).map(|k| at(angle(k).cos(), angle(k).sin())).collect()
}

/// The ellipse of the covariance about the mean, scaled so that it holds the wanted share of the points.
fn ellipse(points: &[Point]) -> Option<Vec<Point>> {
    use super::super::statistics::{deviation, mean};
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
    let (mx, my, sx, sy) = (mean(&x)?, mean(&y)?, deviation(&x)?, deviation(&y)?);
    let rho = pearson(&x, &y)?;
    let rest = (1.0 - rho * rho).max(1e-12).sqrt();
    // Whitened by the Cholesky factor of the covariance.
    let whitened = |p: &Point| {
        let u = (p.0 - mx) / sx;
        (u, ((p.1 - my) / sy - rho * u) / rest)
    };
    let mut sizes: Vec<f64> = points.iter().map(whitened).map(|(u, v)| u.hypot(v)).collect();
    sizes.sort_by(f64::total_cmp);
    let size = quantile(&sizes, ELLIPSE)?;
    Some(curve(|c, s| (mx + sx * size * c, my + sy * size * (rho * c + rest * s))))
}

/// Shares of runs that miss by at most, and by more than, a distance; with pointwise 95 % bounds.
fn distribution(misses: &[f64]) -> Figure {
    let (sorted, all) = (ascending(misses), misses.len() as u64);
    let log = |km: f64| km.max(LEAST_KM).log10();
    let steps = steps(&sorted);
    let share = |hits: usize| wilson(hits as u64, all).unwrap_or_default();
    let line: Vec<Point> = steps.iter().map(|k| (log(sorted[*k]), share(k + 1).value)).collect();
    let band = steps.iter().map(|k| (log(sorted[*k]), share(k + 1).low, share(k + 1).high)).collect();
    let missed = |k: usize| share(misses.len() - k - 1);
    let floor = least_percent(misses.len());
    let decades = |percent: f64| percent.max(floor).log10();
    let tail: Vec<Point> = steps.iter().map(|k| (log(sorted[*k]), decades(missed(*k).value))).collect();
    let tail_band =
        steps.iter().map(|k| (log(sorted[*k]), decades(missed(*k).low), decades(missed(*k).high))).collect();
    let x = |label: &str| Axis::fit(label).decades();
    let first = Panel::new(x("").silent(), Axis::fixed("within, % of the runs", 0.0, 100.0), 230)
        .band(band, Ink::Blue)
        .line(line, Ink::Blue);
    let second = Panel::new(x("miss, km"), Axis::fit("farther, % of the runs").decades(), 230)
        .band(tail_band, Ink::Blue)
        .line(tail, Ink::Blue);
    Figure {
        title: "Distribution of the miss",
        caption: "Above the share of runs within a distance of the target, below the share beyond it on a logarithmic \
                  scale; bands are 95 % bounds (Wilson) at every distance."
            .into(),
        legend: vec![(Mark::Line, Ink::Blue, "runs".into()), (Mark::Band, Ink::Blue, "95 % bounds".into())],
        panels: vec![first, second],
        missing: "No run deployed.",
    }
}

/// Indices of an ascending sample that a curve needs: at most a few hundred, and all of the tail.
fn steps(sorted: &[f64]) -> Vec<usize> {
    let n = sorted.len();
    let every = n.div_ceil(300).max(1);
    let tail = n.saturating_sub(40);
    (0..n).filter(|k| *k >= tail || k.is_multiple_of(every)).collect()
}

/// The curve of a sample: (decimal logarithm of the distance in km, share in percent).
#[must_use]
pub fn curve_of(sorted_km: &[f64], all: usize) -> Vec<Point> {
    let share = |k: usize| 100.0 * (k + 1) as f64 / all.max(1) as f64;
    steps(sorted_km).into_iter().map(|k| (sorted_km[k].max(LEAST_KM).log10(), share(k))).collect()
}

/// The other way round: (decimal logarithm of the distance in km, that of the percentage that lies farther).
#[must_use]
pub fn tail_of(sorted_km: &[f64], all: usize) -> Vec<Point> {
    let share = |k: usize| (100.0 * (all.max(1) - k - 1) as f64 / all.max(1) as f64).max(least_percent(all)).log10();
    steps(sorted_km).into_iter().map(|k| (sorted_km[k].max(LEAST_KM).log10(), share(k))).collect()
}

/// What no run at all is drawn as on a logarithmic axis of so many runs, percent.
fn least_percent(all: usize) -> f64 {
    100.0 / (all.max(1) as f64) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ellipse_holds_its_share_of_the_points() {
        let mut stream = hil_sim::noise::Stream::new(1, 0, "ellipse");
        let points: Vec<Point> = (0..2_000)
            .map(|_| {
                let (a, b) = (stream.normal(), stream.normal());
                (3.0 * a + 1.0, a + 0.5 * b)
            })
            .collect();
        let ellipse = ellipse(&points).unwrap();
        let inside = points.iter().filter(|p| {
            // A convex outline: to the left of every edge.
            ellipse.windows(2).all(|w| {
                let (edge, to) = ((w[1].0 - w[0].0, w[1].1 - w[0].1), (p.0 - w[0].0, p.1 - w[0].1));
                edge.0 * to.1 - edge.1 * to.0 >= 0.0
            })
        });
        let share = inside.count() as f64 / 2_000.0;
        // The drawn polygon lies a little inside the ellipse.
        assert!((0.985..=0.9905).contains(&share), "{share}");
    }

    #[test]
    fn a_curve_keeps_the_whole_tail() {
        let sorted: Vec<f64> = (1..=10_000).map(|k| f64::from(k) * 1e-3).collect();
        let curve = curve_of(&sorted, 10_000);
        assert!(curve.len() < 400);
        assert_eq!(curve.last(), Some(&(1.0, 100.0)));
    }
}
