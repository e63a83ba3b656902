//! The one picture of a flight: altitude against speed coloured by load, the bank history, the end about the target.

use super::figures::{Story, bank, descent, track};
use super::palette::{Ink, Theme};
use super::plot::{Anchor, Axis, Canvas, Layer, Panel, PlotError, Point, number};
use crate::record::{End, FlightRecord, TruthSample};
use fsw_core::units::deg;

const SIZE: (u32, u32) = (1200, 720);
/// Widths of the two columns, heights of the two rows, pixels.
const MAIN: (u32, u32) = (770, 400);
const SIDE: u32 = 390;
const TITLE: u32 = 84;
/// Pieces of different colour along the path.
const PIECES: usize = 220;
/// Spacing and number of the layers that make the glow of the air, km: thicker by the same share each step down.
const AIR_STEP_KM: f64 = 4.0;
const AIR_LAYERS: u32 = 16;

/// The picture as an SVG file.
///
/// # Errors
/// When the plotting library fails.
pub fn svg(record: &FlightRecord) -> Result<String, PlotError> {
    let story = Story::new(record);
    let mut canvas = Canvas::new(SIZE.0, SIZE.1, Theme::Dark);
    canvas.backdrop();
    let (title, subtitle) = titles(record);
    canvas.text((28, 40), 26, Ink::Text, &title);
    canvas.text((28, 66), 15, Ink::Muted, &subtitle);
    let known = record.truth.iter().filter(|s| s.speed_mps.is_finite() && s.altitude_m.is_finite()).count() > 1;
    if !known {
        canvas.text((28, 120), 15, Ink::Muted, "No true state was recorded.");
        return Ok(canvas.into_file());
    }
    canvas.draw(&path(&story), (8, TITLE), MAIN.0)?;
    canvas.draw(&end_of_flight(&story), (8 + MAIN.0, TITLE), SIDE)?;
    canvas.draw(&bank_history(&story), (8, TITLE + MAIN.1), SIZE.0 - 32)?;
    Ok(canvas.into_file())
}

/// Title and the figures below it.
fn titles(record: &FlightRecord) -> (String, String) {
    let summary = &record.summary;
    let how = if record.nominal { "nominal".to_owned() } else { format!("seed {}", record.seed) };
    let miss = summary.miss_m.map(|m| format!(", {} km from the target", number(m * 1e-3, 2))).unwrap_or_default();
    let end = match &record.end {
        End::Deployed => format!("parachute{miss}"),
        End::Failed(_) => "failed".to_owned(),
        other => other.word().to_owned(),
    };
    let deploy = summary.deploy.map(|d| {
        format!(
            " · parachute at {} km, {} m/s, Mach {}",
            number(d.altitude_m * 1e-3, 1),
            number(d.speed_mps, 0),
            number(d.mach, 2)
        )
    });
    let subtitle = format!(
        "peak load {} g · peak heat flux {} kW/m² · {} bank reversals{}",
        number(summary.peak.load_g, 1),
        number(summary.peak.heat_flux_wpm2 * 1e-3, 0),
        summary.reversals,
        deploy.unwrap_or_default()
    );
    (format!("{} ({how}): {end}", record.facts.name), subtitle)
}

/// Altitude against falling speed, the path coloured by the load it bears.
fn path(story: &Story<'_>) -> Panel {
    let truth = &story.record.truth;
    let fastest = truth.iter().map(|s| s.speed_mps).filter(|v| v.is_finite()).fold(0.0, f64::max);
    let highest = truth.iter().map(|s| s.altitude_m * 1e-3).filter(|h| h.is_finite()).fold(10.0, f64::max);
    let x = Axis::fixed("planet-relative speed, m/s", -1.04 * fastest, 0.0).negated();
    let panel = Panel::new(x, Axis::fixed("altitude, km", 0.0, 1.08 * highest), MAIN.1);
    let panel = air(panel, fastest);
    let corners = descent::deploy_box(story).into_iter().map(|(v, h)| (-v, h)).collect();
    let panel = panel.with(Layer::Area { corners, ink: Ink::Green, opacity: 0.5 });
    scale(labels(coloured(panel, truth), story, fastest), story, fastest, highest)
}

/// The glow of the air: equal steps of opacity at equal steps of altitude, as the logarithm of density.
fn air(panel: Panel, fastest: f64) -> Panel {
    (1..=AIR_LAYERS).fold(panel, |panel, k| {
        let (left, top) = (-1.04 * fastest, f64::from(k) * AIR_STEP_KM);
        let corners = vec![(left, 0.0), (0.0, 0.0), (0.0, top), (left, top)];
        panel.with(Layer::Area { corners, ink: Ink::Vermillion, opacity: 0.022 })
    })
}

fn coloured(panel: Panel, truth: &[TruthSample]) -> Panel {
    let peak = peak_load(truth);
    let length = truth.len().div_ceil(PIECES).max(1);
    (0..truth.len()).step_by(length).fold(panel, |panel, from| {
        let piece = truth.get(from..(from + length + 1).min(truth.len())).unwrap_or_default();
        let load = piece.iter().map(|s| s.load_g).filter(|l| l.is_finite()).fold(0.0, f64::max);
        let points = piece.iter().map(|s| (-s.speed_mps, s.altitude_m * 1e-3)).collect();
        panel.with(Layer::Line { points, ink: Ink::Ramp(level(load, peak)), width: 4.6, opacity: 1.0 })
    })
}

fn peak_load(truth: &[TruthSample]) -> f64 {
    truth.iter().map(|s| s.load_g).filter(|l| l.is_finite()).fold(1e-3, f64::max)
}

fn level(load: f64, peak: f64) -> u8 {
    (255.0 * (load / peak).clamp(0.0, 1.0)).round() as u8
}

/// The milestones beside the path.
fn labels(panel: Panel, story: &Story<'_>, fastest: f64) -> Panel {
    let at = |t: f64| story.sample_at(t).map(|s| (-s.speed_mps, s.altitude_m * 1e-3));
    let reversals: Vec<Point> = story.reversals().into_iter().filter_map(at).collect();
    let panel = panel.dots(reversals, Ink::Purple, 5.0);
    let mut last: Point = (f64::NEG_INFINITY, f64::INFINITY);
    let milestones = story.record.summary.timeline.iter().filter_map(|m| Some((at(m.time_s)?, m)));
    milestones.fold(panel, |panel, (point, milestone)| {
        let panel = panel.dots(vec![point], Ink::Text, 3.2);
        // A label needs room: 9 km of altitude or a sixth of the axis from the one before.
        let crowded = (point.0 - last.0) < fastest / 6.0 && (last.1 - point.1) < 9.0;
        if crowded {
            return panel;
        }
        last = point;
        let text = format!("{} · {} s", milestone.event, number(milestone.time_s, 0));
        if point.0 > -0.2 * fastest {
            // No room to the right: above, flush with the edge.
            return panel.note((-0.01 * fastest, point.1 + 24.0), text, Ink::Text, Anchor::End);
        }
        if point.0 > -0.4 * fastest {
            return panel.note((point.0, point.1 + 4.0), text, Ink::Text, Anchor::Middle);
        }
        panel.note((point.0 + 0.014 * fastest, point.1 + 1.5), text, Ink::Text, Anchor::Start)
    })
}

/// The colour scale in the empty corner.
fn scale(panel: Panel, story: &Story<'_>, fastest: f64, highest: f64) -> Panel {
    let (left, width, bottom) = (-0.42 * fastest, 0.38 * fastest, 0.9 * highest);
    let step = width / 40.0;
    let panel = (0..40u32).fold(panel, |panel, i| {
        let from = left + f64::from(i) * step;
        let top = bottom + 0.035 * highest;
        let corners = vec![(from, bottom), (from + 1.02 * step, bottom), (from + 1.02 * step, top), (from, top)];
        panel.with(Layer::Area { corners, ink: Ink::Ramp((i * 255 / 39) as u8), opacity: 1.0 })
    });
    let below = bottom - 0.055 * highest;
    panel
        .note((left, below), "0 g", Ink::Muted, Anchor::Start)
        .note((left + 0.5 * width, below), "sensed load", Ink::Muted, Anchor::Middle)
        .note(
            (left + width, below),
            format!("{} g", number(peak_load(&story.record.truth), 1)),
            Ink::Muted,
            Anchor::End,
        )
}

/// The last kilometres about the target.
fn end_of_flight(story: &Story<'_>) -> Panel {
    let track = story.track_km();
    let end = story.deploy_km().or_else(|| track.iter().rev().find(|p| p.0.is_finite()).copied()).unwrap_or((0.0, 0.0));
    let reach = (1.15 * end.0.hypot(end.1)).clamp(11.5, 60.0);
    let x = Axis::fixed("downrange from the target, km", -reach, reach);
    let panel = Panel::new(x, Axis::fixed("crossrange, km", -reach, reach), MAIN.1).equal_scale();
    let deploy: Vec<Point> = story.deploy_km().into_iter().collect();
    let panel = track::rings(panel).line(track, Ink::Orange).crosses(vec![(0.0, 0.0)], Ink::Green);
    let (left, bottom) = (-0.95 * reach, -0.9 * reach);
    panel
        .dots(deploy, Ink::Vermillion, 6.0)
        .note((left, bottom + 0.12 * reach), "flown", Ink::Orange, Anchor::Start)
        .note((left, bottom), "parachute", Ink::Vermillion, Anchor::Start)
        .note((left + 0.62 * reach, bottom), "target", Ink::Green, Anchor::Start)
}

/// Bank commanded and flown over the whole flight.
fn bank_history(story: &Story<'_>) -> Panel {
    let flown = bank::broken(&story.truth(|s| deg(s.packet.bank_rad)));
    let top = 78.0;
    let end = story.end_s();
    Panel::new(
        story.time_axis(),
        Axis::fit("bank, deg").symmetric().every(30.0).including(top),
        SIZE.1 - TITLE - MAIN.1 - 8,
    )
    .instants(story.reversals(), Ink::Purple)
    .line(bank::commanded_deg(story), Ink::Blue)
    .with(Layer::Line { points: flown, ink: Ink::Orange, width: 2.2, opacity: 1.0 })
    .note((0.012 * end, 0.72 * top), "flown", Ink::Orange, Anchor::Start)
    .note((0.062 * end, 0.72 * top), "commanded", Ink::Blue, Anchor::Start)
    .note((0.152 * end, 0.72 * top), "reversals", Ink::Purple, Anchor::Start)
}
