//! Sensed load, heat flux and dynamic pressure against their limits.

use fsw_core::planet::STANDARD_GRAVITY_MPS2;

use super::{KILO, Story};
use crate::record::TruthSample;
use crate::report::palette::Ink;
use crate::report::plot::{Anchor, Axis, Figure, Panel, Point, number};

/// The figure.
#[must_use]
pub fn figure(story: &Story<'_>) -> Figure {
    let limits = &story.record.facts.constraints;
    let load = Quantity { name: "sensed load", unit: "g", limit: limits.load_mps2 / STANDARD_GRAVITY_MPS2, digits: 1 };
    let flux = Quantity { name: "heat flux", unit: "kW/m²", limit: limits.heat_flux_wpm2 * KILO, digits: 0 };
    let pressure = Quantity { name: "pressure", unit: "kPa", limit: limits.dynamic_pressure_pa * KILO, digits: 1 };
    Figure {
        title: "Loads and heating",
        caption: "True sensed load, convective heat flux at the stagnation point and dynamic pressure; each axis reaches up to its limit.".into(),
        legend: Vec::new(),
        panels: vec![
            load.panel(story, |s| s.load_g, true, 150),
            flux.panel(story, |s| s.heat_flux_wpm2 * KILO, true, 150),
            pressure.panel(story, |s| s.packet.dynamic_pressure_pa * KILO, false, 186),
        ],
        missing: "No true state was recorded.",
    }
}

/// One quantity with its limit.
struct Quantity {
    name: &'static str,
    unit: &'static str,
    limit: f64,
    digits: usize,
}

impl Quantity {
    fn panel(&self, story: &Story<'_>, value: impl Fn(&TruthSample) -> f64, silent: bool, height: u32) -> Panel {
        let curve = story.truth(value);
        let peak = curve.iter().filter(|p| p.1.is_finite()).copied().reduce(|a, b| if b.1 > a.1 { b } else { a });
        let x = if silent { story.time_axis().silent() } else { story.time_axis() };
        let y = Axis::fit(format!("{}, {}", self.name, self.unit)).including(0.0).including(self.limit * 1.08);
        let limit = format!("limit {} {}", number(self.limit, self.digits), self.unit);
        let panel = Panel::new(x, y, height).instants(story.modes().iter().map(|m| m.0), Ink::Muted);
        let panel = panel.line(curve, Ink::Orange).level(self.limit, Ink::Vermillion, limit);
        let Some((time, top)) = peak else { return panel };
        let text = format!("peak {} {} at {} s", number(top, self.digits), self.unit, number(time, 1));
        // The note stands on the side that has more room.
        let (side, anchor) = if time > 0.6 * story.end_s() { (-1.0, Anchor::End) } else { (1.0, Anchor::Start) };
        let at: Point = (time + side * 0.015 * story.end_s(), top);
        panel.dots(vec![(time, top)], Ink::Orange, 3.0).note(at, text, Ink::Text, anchor)
    }
}
