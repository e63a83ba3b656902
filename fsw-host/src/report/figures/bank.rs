//! Bank angle: what guidance commanded, what the vehicle flew.

use fsw_core::units::deg;

use super::Story;
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Mark, Panel, Point};

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let record = story.record;
    let flown = broken(&story.truth(|s| deg(s.packet.bank_rad)));
    let believed = broken(&record.nav.iter().map(|(t, n)| (t.as_s(), deg(f64::from(n.bank_rad)))).collect::<Vec<_>>());
    let commanded = commanded_deg(story);
    let (reversals, modes) = (story.reversals(), story.modes());
    let rate: Vec<Point> =
        record.actuators.iter().map(|a| (f64::from(a.frame) * 0.02, deg(a.bank_rate_radps))).collect();
    let angle =
        Panel::new(story.time_axis().silent(), Axis::fit("bank, deg").symmetric().every(30.0).including(60.0), 400)
            .instants(modes.iter().map(|(t, _)| *t), Ink::Muted)
            .instants(reversals.iter().copied(), Ink::Purple)
            .thin(believed, Ink::Sky)
            .line(commanded, Ink::Blue)
            .line(flown, Ink::Orange);
    let rate_panel =
        Panel::new(story.time_axis(), Axis::fit("rate, deg/s").symmetric().every(10.0).including(10.0), 190)
            .instants(reversals.iter().copied(), Ink::Purple)
            .thin(rate, Ink::Blue);
    Figure {
        title: "Bank angle",
        caption: format!(
            "Positive is lift to the right of the velocity; below, the rate command of the bank control. {} reversal{} commanded.",
            reversals.len(),
            if reversals.len() == 1 { "" } else { "s" }
        ),
        legend: vec![
            (Mark::Line, Ink::Blue, "commanded".into()),
            (Mark::Line, Ink::Orange, "flown (truth)".into()),
            (Mark::Line, Ink::Sky, "estimated".into()),
            (Mark::Instant, Ink::Purple, "reversal".into()),
            (Mark::Instant, Ink::Muted, "mode change".into()),
        ],
        panels: vec![angle, rate_panel],
        missing: "No bank angle was recorded.",
    }
}

/// The commanded bank as steps: each command acts from its effective time until the next one does.
#[must_use]
pub fn commanded_deg(story: &Story<'_>) -> Vec<Point> {
    let commands: Vec<Point> =
        story.record.guidance.iter().map(|(_, g)| (g.effective.as_s(), deg(g.bank_rad))).collect();
    let ends = commands.iter().skip(1).map(|c| c.0).chain([story.end_s()]);
    commands.iter().zip(ends).flat_map(|((from, bank), to)| [(*from, *bank), (to.max(*from), *bank)]).collect()
}

/// Interrupts the curve where the angle wraps around.
#[must_use]
pub fn broken(points: &[Point]) -> Vec<Point> {
    let mut line = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        if i > 0 && (point.1 - points[i - 1].1).abs() > 180.0 {
            line.push((point.0, f64::NAN));
        }
        line.push(*point);
    }
    line
}
