//! Innovations of every sensor over their standard deviation.

use fsw_core::link::packet::{Innovation, MeasurementKind, Verdict};

use super::Story;
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Mark, Panel, Point, number};

/// Ratios beyond this are drawn at the edge.
const EDGE: f64 = 5.6;

/// The figure: one panel per kind and source.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let record = story.record;
    let all: Vec<Innovation> =
        record.nav.iter().flat_map(|(_, nav)| nav.innovations.iter().flatten().copied()).collect();
    let mut channels: Vec<(MeasurementKind, u8)> = Vec::new();
    for innovation in all.iter().filter(|i| i.sigma > 0.0) {
        let channel = (innovation.kind, innovation.source);
        if !channels.contains(&channel) {
            channels.push(channel);
        }
    }
    channels.sort_by_key(|(kind, source)| (*kind as u8, *source));
    let count = channels.len();
    let panel = |(i, channel): (usize, &(MeasurementKind, u8))| {
        let (x, height) = if i + 1 < count { (story.time_axis().silent(), 132) } else { (story.time_axis(), 168) };
        let mine: Vec<&Innovation> = all.iter().filter(|i| (i.kind, i.source) == *channel).collect();
        let points =
            |wanted: &dyn Fn(Verdict) -> bool| mine.iter().filter(|i| wanted(i.verdict)).map(|i| ratio(i)).collect();
        Panel::new(x, Axis::fixed("ratio", -6.0, 6.0).every(3.0), height)
            .named(label(story, *channel))
            .instants(story.modes().iter().map(|m| m.0), Ink::Muted)
            .level(3.0, Ink::Green, "")
            .level(-3.0, Ink::Green, "")
            .dots(points(&|v| matches!(v, Verdict::NotUsed | Verdict::OutOfValidity)), Ink::Axis, 1.3)
            .dots(points(&|v| v == Verdict::Used), Ink::Blue, 1.7)
            .crosses(points(&|v| v == Verdict::Gated), Ink::Vermillion)
    };
    Figure {
        title: "Innovations over their σ",
        caption: format!("Measured minus predicted. Mean square of those used, one when consistent: {}.", means(story)),
        legend: vec![
            (Mark::Dot, Ink::Blue, "used".into()),
            (Mark::Cross, Ink::Vermillion, "rejected by the gate".into()),
            (Mark::Dot, Ink::Axis, "seen, not used".into()),
            (Mark::Line, Ink::Green, "±3σ".into()),
        ],
        panels: channels.iter().enumerate().map(panel).collect(),
        missing: "No measurement reached a filter in this flight.",
    }
}

/// Time and normalised innovation, kept inside the plot.
fn ratio(innovation: &Innovation) -> Point {
    let value = f64::from(innovation.value) / f64::from(innovation.sigma);
    (innovation.time.as_s(), if value.is_nan() { f64::NAN } else { value.clamp(-EDGE, EDGE) })
}

fn label(story: &Story<'_>, (kind, source): (MeasurementKind, u8)) -> String {
    let kind = match kind {
        MeasurementKind::Pressure => return "stagnation pressure".to_owned(),
        MeasurementKind::Range => "range",
        MeasurementKind::RangeRate => "range-rate",
    };
    let sources = &story.record.facts.source_names;
    if sources.is_empty() {
        return kind.to_owned();
    }
    sources.get(usize::from(source)).map_or_else(|| format!("{kind} {source}"), |name| format!("{kind}, {name}"))
}

/// The mean normalised innovation squared per kind.
fn means(story: &Story<'_>) -> String {
    let nis = &story.record.summary.navigation.nis_mean;
    let of = |name: &str, mean: Option<f64>| mean.map(|m| format!("{name} {}", number(m, 2)));
    let known = [of("pressure", nis.pressure), of("range", nis.range), of("range-rate", nis.range_rate)];
    let known: Vec<String> = known.into_iter().flatten().collect();
    if known.is_empty() { "none used".to_owned() } else { known.join(", ") }
}
