//! Altitude against speed with the deploy box as it lies in the air of this flight.

use super::{KILO, Story};
use crate::record::TruthSample;
use crate::report::palette::Ink;
use crate::report::plot::{Anchor, Axis, Figure, Layer, Mark, Panel, Point};

/// The box needs the air near the ground: it is drawn once the flight came below this altitude, m.
const BOX_KNOWN_BELOW_M: f64 = 30_000.0;

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let path: Vec<Point> = story.record.truth.iter().map(|s| (s.speed_mps, s.altitude_m * KILO)).collect();
    let has_path = path.iter().filter(|p| p.0.is_finite() && p.1.is_finite()).count() > 1;
    let corners = deploy_box(story);
    let whole = Panel::new(
        Axis::fit("planet-relative speed, m/s").including(0.0),
        Axis::fit("altitude, km").including(0.0),
        260,
    );
    let mut panels = Vec::new();
    if has_path {
        panels.push(decorate(whole, story, &corners).line(path.clone(), Ink::Orange));
    }
    if has_path && !corners.is_empty() {
        panels.push(decorate(zoom(story, &corners), story, &corners).line(path, Ink::Orange));
    }
    Figure {
        title: "Altitude against speed",
        caption: "The deploy box is the region where altitude, Mach number and dynamic pressure are all within their \
                  limits, in the air that this flight met."
            .into(),
        legend: vec![
            (Mark::Line, Ink::Orange, "flown (truth)".into()),
            (Mark::Band, Ink::Green, "deploy box".into()),
            (Mark::Instant, Ink::Blue, "trigger speed".into()),
            (Mark::Line, Ink::Vermillion, "last-chance floor".into()),
            (Mark::Dot, Ink::Vermillion, "parachute".into()),
            (Mark::Dot, Ink::Purple, "reversal".into()),
        ],
        panels,
        missing: "No true state was recorded.",
    }
}

/// The end of the descent about the box.
fn zoom(story: &Story<'_>, corners: &[Point]) -> Panel {
    let right = corners.iter().fold(story.record.facts.deploy.speed_mps, |m, p| m.max(p.0));
    let top = story.record.facts.deploy.max_altitude_m * KILO;
    let deploy = story.record.summary.deploy.unwrap_or_default();
    let x = Axis::fixed("planet-relative speed, m/s", 0.0, (1.5 * right).max(1.1 * deploy.speed_mps));
    Panel::new(x, Axis::fixed("altitude, km", 0.0, (1.25 * top).max(1.1 * deploy.altitude_m * KILO)), 260)
}

fn decorate(panel: Panel, story: &Story<'_>, corners: &[Point]) -> Panel {
    let facts = &story.record.facts.deploy;
    let deploy = story.record.summary.deploy.map(|d| (d.speed_mps, d.altitude_m * KILO));
    let at = |t: f64| story.sample_at(t).map(|s| (s.speed_mps, s.altitude_m * KILO));
    let panel = panel
        .with(Layer::Area { corners: corners.to_vec(), ink: Ink::Green, opacity: 0.28 })
        .instants([facts.speed_mps], Ink::Blue)
        .level(facts.floor_altitude_m * KILO, Ink::Vermillion, "")
        .dots(story.reversals().into_iter().filter_map(at).collect(), Ink::Purple, 3.5)
        .dots(deploy.into_iter().collect(), Ink::Vermillion, 5.0);
    match deploy {
        Some(point) => panel.note((point.0 + 18.0, point.1), "parachute", Ink::Text, Anchor::Start),
        None => panel,
    }
}

/// Outline of the deploy box in (m/s, km): between the speeds that its Mach number and dynamic pressure mean at each altitude.
#[must_use]
pub fn deploy_box(story: &Story<'_>) -> Vec<Point> {
    let (limits, truth) = (&story.record.facts.deploy, &story.record.truth);
    if truth.last().is_none_or(|s| s.altitude_m.is_nan() || s.altitude_m >= BOX_KNOWN_BELOW_M) {
        return Vec::new();
    }
    let (bottom, height) = (limits.min_altitude_m, limits.max_altitude_m - limits.min_altitude_m);
    let rows = (0..=40).map(|i| bottom + height * f64::from(i) / 40.0).filter_map(|altitude_m| {
        let (density, sound) = air_at(truth, altitude_m)?;
        let speed = |pressure: f64| (2.0 * pressure / density).sqrt();
        let low = (limits.min_mach * sound).max(speed(limits.min_dynamic_pressure_pa));
        let high = (limits.max_mach * sound).min(speed(limits.max_dynamic_pressure_pa));
        (low < high).then_some((low, high, altitude_m * KILO))
    });
    let rows: Vec<_> = rows.collect();
    rows.iter().map(|(low, _, h)| (*low, *h)).chain(rows.iter().rev().map(|(_, high, h)| (*high, *h))).collect()
}

/// Density and speed of sound at an altitude: as met on the way down, continued exponentially below the end of the flight.
fn air_at(truth: &[TruthSample], altitude_m: f64) -> Option<(f64, f64)> {
    let sound = |s: &TruthSample| s.speed_mps / s.packet.mach;
    let last = truth.last()?;
    let met = truth.iter().rev().find(|s| s.altitude_m >= altitude_m);
    let air = match met {
        Some(sample) if last.altitude_m <= altitude_m => (sample.packet.density_kgpm3, sound(sample)),
        _ => {
            let above = truth.iter().rev().find(|s| s.altitude_m >= last.altitude_m + 2000.0)?;
            let slope =
                (last.packet.density_kgpm3 / above.packet.density_kgpm3).ln() / (above.altitude_m - last.altitude_m);
            (last.packet.density_kgpm3 * (slope * (last.altitude_m - altitude_m)).exp(), sound(last))
        }
    };
    (air.0.is_finite() && air.0 > 0.0 && air.1.is_finite() && air.1 > 0.0).then_some(air)
}
