//! Altitude and speed over time with the modes of the flight software behind them.

use super::{KILO, Story};
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Layer, Mark, Panel};

/// The colours that neighbouring modes take in turn.
const SHADES: [Ink; 3] = [Ink::Muted, Ink::Blue, Ink::Green];

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let altitude = story.truth(|s| s.altitude_m * KILO);
    let speed = story.truth(|s| s.speed_mps * KILO);
    let path_angle = story.truth(|s| s.flight_path_angle_rad.to_degrees());
    let panel = |label: &str, silent: bool, height| {
        let x = if silent { story.time_axis().silent() } else { story.time_axis() };
        let panel = Panel::new(x, Axis::fit(label).including(0.0), height);
        let panel = shaded(panel, story);
        panel.instants(story.reversals(), Ink::Purple)
    };
    Figure {
        title: "The flight over time",
        caption: "True state; the shading shows the modes of the flight software.".into(),
        legend: legend(story),
        panels: vec![
            panel("altitude, km", true, 170).line(altitude, Ink::Orange),
            panel("speed, km/s", true, 140).line(speed, Ink::Orange),
            panel("path angle, deg", false, 170).line(path_angle, Ink::Orange),
        ],
        missing: "No true state was recorded.",
    }
}

/// Modes in order of appearance, each with its shade.
fn spans(story: &Story<'_>) -> Vec<(f64, f64, Ink, &'static str)> {
    let modes = story.modes();
    let ends = modes.iter().skip(1).map(|m| m.0).chain([story.end_s()]);
    let shade = |i: usize| SHADES[i % SHADES.len()];
    modes
        .iter()
        .zip(ends)
        .enumerate()
        .map(|(i, ((from, mode), to))| (*from, to, shade(i), super::mode_name(*mode)))
        .collect()
}

fn shaded(panel: Panel, story: &Story<'_>) -> Panel {
    spans(story).into_iter().fold(panel, |panel, (from, to, ink, _)| panel.with(Layer::Span { from, to, ink }))
}

fn legend(story: &Story<'_>) -> Vec<(Mark, Ink, String)> {
    let lasting = spans(story).into_iter().filter(|(from, to, ..)| to > from);
    let mut legend: Vec<_> = lasting.map(|(_, _, ink, name)| (Mark::Band, ink, name.to_owned())).collect();
    if !story.reversals().is_empty() {
        legend.push((Mark::Instant, Ink::Purple, "bank reversal".to_owned()));
    }
    legend
}
