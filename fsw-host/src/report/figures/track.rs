//! Ground track: the whole arc, and the last kilometres at equal scale with rings about the target.

use super::Story;
use crate::report::palette::Ink;
use crate::report::plot::{Anchor, Axis, Figure, Layer, Mark, Panel, Point, number};

/// Radii of the rings, km.
const RINGS_KM: [f64; 3] = [1.0, 5.0, 10.0];
/// Length of the last part, km.
const LAST_KM: f64 = 30.0;

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let track = story.track_km();
    let reversals: Vec<Point> = story.reversals().iter().filter_map(|t| point_at(story, *t)).collect();
    let finite = track.iter().filter(|p| p.0.is_finite()).count() > 1;
    let mut panels = Vec::new();
    if finite {
        panels.push(whole(story, &track, &reversals));
        // A flight that ended far away never saw the rings.
        panels.extend((end_distance_km(&track) < 2.0 * LAST_KM).then(|| last(story, &track, &reversals)));
    }
    let miss = story.record.summary.miss_m;
    Figure {
        title: "Ground track",
        caption: format!(
            "Along and across the great circle from the nominal entry point to the target, crossrange positive to the \
             right. Above the whole arc, its crossrange stretched; below the end at equal scale with rings of 1, 5 and \
             10 km.{}",
            miss.map(|m| format!(" Miss {} km.", number(m * 1e-3, 2))).unwrap_or_default()
        ),
        legend: vec![
            (Mark::Line, Ink::Orange, "flown (truth)".into()),
            (Mark::Line, Ink::Blue, "estimated".into()),
            (Mark::Cross, Ink::Green, "target".into()),
            (Mark::Dot, Ink::Vermillion, "parachute".into()),
            (Mark::Dot, Ink::Purple, "reversal".into()),
        ],
        panels,
        missing: "No true state was recorded.",
    }
}

fn whole(story: &Story<'_>, track: &[Point], reversals: &[Point]) -> Panel {
    let y = Axis::fit("crossrange, km").symmetric().including(5.0);
    let panel = Panel::new(Axis::fit("downrange from the target, km").including(0.0), y, 190);
    marks(panel.line(track.to_vec(), Ink::Orange), story, reversals)
}

/// Distance from the target to where the track ends, km.
fn end_distance_km(track: &[Point]) -> f64 {
    let end = track.iter().rev().find(|p| p.0.is_finite() && p.1.is_finite());
    end.map_or(0.0, |(x, y)| x.hypot(*y))
}

/// The end of the flight: from the last 30 km to beyond the target or the deploy point.
fn last(story: &Story<'_>, track: &[Point], reversals: &[Point]) -> Panel {
    let reach = (1.15 * end_distance_km(track)).max(12.0);
    let x = Axis::fixed("downrange from the target, km", -LAST_KM.max(reach), reach.min(LAST_KM));
    let span = 0.8 * reach.min(LAST_KM);
    let panel = Panel::new(x, Axis::fixed("crossrange, km", -span, span), 400).equal_scale();
    let panel = rings(panel).thin(story.believed_track_km(), Ink::Blue).line(track.to_vec(), Ink::Orange);
    marks(panel, story, reversals)
}

/// Rings about the target, each with its radius.
#[must_use]
pub fn rings(panel: Panel) -> Panel {
    RINGS_KM.iter().fold(panel, |panel, radius| {
        let at = |i: u32| {
            let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 120.0).sin_cos();
            (radius * cosine, radius * sine)
        };
        let ring = Layer::Line { points: (0..=120).map(at).collect(), ink: Ink::Green, width: 1.1, opacity: 0.8 };
        let note = at(15);
        panel.with(ring).note(note, format!(" {radius} km"), Ink::Green, Anchor::Start)
    })
}

/// Target, parachute and reversals.
fn marks(panel: Panel, story: &Story<'_>, reversals: &[Point]) -> Panel {
    panel.dots(reversals.to_vec(), Ink::Purple, 4.0).crosses(vec![(0.0, 0.0)], Ink::Green).dots(
        story.deploy_km().into_iter().collect(),
        Ink::Vermillion,
        5.0,
    )
}

/// The true position at a time, km.
#[must_use]
pub fn point_at(story: &Story<'_>, time_s: f64) -> Option<Point> {
    let sample = story.sample_at(time_s)?;
    story.local_km(&fsw_core::frames::surface_point(sample.longitude_rad, sample.latitude_rad))
}
