//! The page of a footprint.

use fsw_core::planet::STANDARD_GRAVITY_MPS2;
use maud::html;

use super::{Footprint, Reached, Slice, open_range};
use crate::campaign::report::document;
use crate::record::ScenarioFacts;
use crate::report::{Axis, Figure, Ink, Layer, Mark, Panel, PlotError, Point, number};

/// The page.
pub fn html(footprint: &Footprint, facts: &ScenarioFacts) -> Result<String, PlotError> {
    let figures = [reachable(footprint, facts).render()?, corridor(footprint, facts).render()?];
    let inside = if footprint.target_inside { "inside" } else { "outside" };
    let class = if footprint.target_inside { "good" } else { "bad" };
    let corridor = open_range(&footprint.corridor).map_or_else(
        || "the entry corridor is closed".to_owned(),
        |(low, high)| format!("the entry corridor reaches from {}° to {}°", number(low, 2), number(high, 2)),
    );
    let body = html! {
        header {
            p.kicker { "Aeroshell footprint" }
            h1 { (footprint.scenario) }
            p.verdict.(class) { "The target lies " (inside) " what the vehicle can reach; " (corridor) "." }
        }
        section { div.grid { @for figure in &figures { (figure) } } }
    };
    Ok(document(&format!("Aeroshell footprint: {}", footprint.scenario), &body))
}

fn km(reached: &Reached) -> Point {
    (reached.downrange_m * 1e-3, reached.crossrange_m * 1e-3)
}

fn reachable(footprint: &Footprint, facts: &ScenarioFacts) -> Figure {
    let low: Vec<Point> = footprint
        .rim
        .iter()
        .filter_map(|(_, r)| r.as_ref().filter(|r| r.altitude_m < facts.deploy.min_altitude_m).map(km))
        .collect();
    let mut rim: Vec<Point> = footprint.rim.iter().filter_map(|(_, r)| r.as_ref().map(km)).collect();
    rim.extend(rim.first().copied());
    let marked = |wanted: f64| {
        footprint.rim.iter().filter(move |(bank, _)| bank.abs() == wanted).filter_map(|(_, r)| r.as_ref().map(km))
    };
    let x = Axis::fit("downrange from the target, km").including(0.0);
    let panel = Panel::new(x, Axis::fit("crossrange, km").symmetric(), 420)
        .with(Layer::Area { corners: rim.clone(), ink: Ink::Blue, opacity: 0.08 })
        .dots(footprint.inside.iter().map(km).collect(), Ink::Sky, 1.8)
        .line(rim, Ink::Blue)
        .dots(low, Ink::Purple, 2.6)
        .dots(marked(0.0).collect(), Ink::Orange, 5.0)
        .dots(marked(180.0).collect(), Ink::Vermillion, 5.0)
        .crosses(vec![(0.0, 0.0)], Ink::Green);
    Figure {
        title: "Reachable at deployment",
        caption: "Constant banks from full lift up over both sides to full lift down, and flights with one reversal; \
                  undispersed air, a bank that turns at once."
            .into(),
        legend: vec![
            (Mark::Line, Ink::Blue, "constant bank".into()),
            (Mark::Dot, Ink::Sky, "one reversal".into()),
            (Mark::Dot, Ink::Purple, "below the deploy box".into()),
            (Mark::Dot, Ink::Orange, "lift up".into()),
            (Mark::Dot, Ink::Vermillion, "lift down".into()),
            (Mark::Cross, Ink::Green, "target".into()),
        ],
        panels: vec![panel],
        missing: "No bank brings the vehicle down within the time limit.",
    }
}

fn corridor(footprint: &Footprint, facts: &ScenarioFacts) -> Figure {
    let curve = |of: fn(&Slice) -> Option<f64>| -> Vec<Point> {
        footprint.corridor.iter().map(|s| (s.flight_path_angle_deg, of(s).unwrap_or(f64::NAN))).collect()
    };
    let up = curve(|s| s.lift_up.map(|r| r.downrange_m * 1e-3));
    let down = curve(|s| s.lift_down.map(|r| r.downrange_m * 1e-3));
    let edges = down.iter().zip(&up).map(|((x, low), (_, high))| (*x, *low, *high)).collect();
    let open = |panel: Panel| match open_range(&footprint.corridor) {
        Some((from, to)) => panel.with(Layer::Span { from, to, ink: Ink::Green }),
        None => panel,
    };
    // A shallow entry with its lift up nearly skips out and reaches as far as one likes: the axis stays with the target.
    let before = down.iter().map(|p| p.1).filter(|v| v.is_finite()).fold(0.0, f64::min);
    let beyond = 3.0 * footprint.margin_beyond_m.map_or(100.0, |m| (m * 1e-3).max(100.0));
    let ends = footprint.corridor.first().zip(footprint.corridor.last());
    let (from, to) = ends.map_or((0.0, 1.0), |(a, b)| (a.flight_path_angle_deg, b.flight_path_angle_deg));
    // The same for all panels, whatever their curves reach over.
    let x = |label: &str| Axis::fit(label).including(from).including(to);
    let y = Axis::fixed("downrange from the target, km", 1.1 * before.min(-50.0), beyond);
    let reach = Panel::new(x("").silent(), y, 240)
        .band(edges, Ink::Sky)
        .line(up, Ink::Orange)
        .line(down, Ink::Vermillion)
        .level(0.0, Ink::Green, "target");
    let aimed = |of: fn(&Reached) -> f64| -> Vec<Point> {
        let value = |s: &Slice| s.to_target.map_or(f64::NAN, |aimed| of(&aimed.reached));
        footprint.corridor.iter().map(|s| (s.flight_path_angle_deg, value(s))).collect()
    };
    let deploy = &facts.deploy;
    let altitude = Panel::new(x("").silent(), Axis::fit("deploy altitude, km"), 150)
        .line(aimed(|r| r.altitude_m * 1e-3), Ink::Blue)
        .level(deploy.min_altitude_m * 1e-3, Ink::Green, "deploy box");
    let limit_g = facts.constraints.load_mps2 / STANDARD_GRAVITY_MPS2;
    let load = Panel::new(x("entry flight-path angle, deg"), Axis::fit("peak load, g").including(0.0), 180)
        .line(curve(|s| s.lift_up.map(|r| r.peak.load_g)), Ink::Orange)
        .line(curve(|s| s.lift_down.map(|r| r.peak.load_g)), Ink::Vermillion)
        .line(aimed(|r| r.peak.load_g), Ink::Blue)
        .level(limit_g, Ink::Green, "limit");
    Figure {
        title: "Entry corridor",
        caption:
            "Reach of full lift up and full lift down over the entry flight-path angle; deploy altitude and peak load \
                  of the constant bank that ends at the target's distance. Shaded green: that bank ends inside the \
                  altitudes of the deploy box and keeps the limits of load, heat flux and dynamic pressure."
                .into(),
        legend: vec![
            (Mark::Line, Ink::Orange, "lift up".into()),
            (Mark::Line, Ink::Vermillion, "lift down".into()),
            (Mark::Line, Ink::Blue, "bank to the target".into()),
            (Mark::Band, Ink::Green, "corridor".into()),
        ],
        panels: vec![open(reach), open(altitude), open(load)],
        missing: "No bank brings the vehicle down within the time limit.",
    }
}
