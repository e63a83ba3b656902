//! What a minor frame costs on this computer.

use super::Story;
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Layer, Panel, Point, number};

/// Bins of the histogram per decade.
const BINS_PER_DECADE: f64 = 12.0;

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let cost: Vec<f64> = story.record.frame_cost_us.iter().map(|c| f64::from(*c)).collect();
    let known: Vec<f64> = cost.iter().copied().filter(|c| c.is_finite() && *c > 0.0).collect();
    let max = known.iter().copied().fold(0.0, f64::max);
    let over_time: Vec<Point> = cost
        .iter()
        .enumerate()
        .map(|(i, c)| ((i + 1) as f64 * 0.02, if *c > 0.0 { c.log10() } else { f64::NAN }))
        .collect();
    let time = Panel::new(story.time_axis(), Axis::fit("µs per frame").decades().including(0.0), 210)
        .with(Layer::Line { points: over_time, ink: Ink::Blue, width: 0.8, opacity: 0.75 })
        .level(max.max(1e-3).log10(), Ink::Vermillion, format!("max {} µs", number(max, 0)));
    Figure {
        title: "Cost of a frame",
        caption: format!(
            "Wall time of the flight software on the computer that ran this flight: median {} µs, 99 % below {} µs, \
             worst {} µs of the 20 000 µs that a frame lasts.",
            number(quantile(&known, 0.5), 1),
            number(quantile(&known, 0.99), 1),
            number(max, 0)
        ),
        legend: Vec::new(),
        panels: if known.len() > 1 { vec![time, histogram(&known)] } else { Vec::new() },
        missing: "The flight software ran elsewhere or stopped at once: no cost was measured frame by frame.",
    }
}

fn histogram(cost: &[f64]) -> Panel {
    let bin_of = |c: f64| (c.log10() * BINS_PER_DECADE).floor();
    let first = cost.iter().copied().map(bin_of).fold(f64::INFINITY, f64::min);
    let last = cost.iter().copied().map(bin_of).fold(f64::NEG_INFINITY, f64::max);
    let mut counts = vec![0u32; (last - first) as usize + 1];
    for c in cost {
        if let Some(count) = counts.get_mut((bin_of(*c) - first) as usize) {
            *count += 1;
        }
    }
    let left = |i: usize| (first + i as f64) / BINS_PER_DECADE;
    // Counts on a logarithmic axis that starts below one, so that a single slow frame can be seen.
    let top = |count: u32| f64::from(count).max(1.0).log10();
    let bar = |(i, count): (usize, &u32)| Layer::Area {
        corners: vec![(left(i), -0.3), (left(i), top(*count)), (left(i + 1), top(*count)), (left(i + 1), -0.3)],
        ink: Ink::Blue,
        opacity: 0.65,
    };
    let highest = counts.iter().copied().max().map_or(1.0, top);
    let x = Axis::fixed("µs per frame", (left(0) - 0.1).min(0.0), left(counts.len()) + 0.15).decades();
    let panel = Panel::new(x, Axis::fixed("frames", -0.3, highest + 0.2).decades(), 190);
    counts.iter().enumerate().filter(|(_, count)| **count > 0).map(bar).fold(panel, Panel::with)
}

/// The value below which a share of the costs lies.
fn quantile(cost: &[f64], share: f64) -> f64 {
    let mut sorted = cost.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    sorted.get(((sorted.len() as f64 - 1.0).max(0.0) * share).round() as usize).copied().unwrap_or(f64::NAN)
}
