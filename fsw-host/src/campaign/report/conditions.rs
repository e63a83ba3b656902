//! Conditions at deployment against their box, and the loads of the paths against their limits.

use fsw_core::planet::STANDARD_GRAVITY_MPS2;

use super::{CampaignReportError, Material, histogram, thinned};
use crate::report::{Axis, Figure, Ink, Layer, Mark, Panel, Point};

/// Bars of a histogram.
const BARS: usize = 40;

/// Deploy box, loads and heat.
pub fn figures(material: &Material<'_>) -> Result<Vec<Figure>, CampaignReportError> {
    Ok(vec![deploy_box(material)?, loads(material)?])
}

fn deploy_box(material: &Material<'_>) -> Result<Figure, CampaignReportError> {
    let limits = &material.facts.deploy;
    let altitude_km: Vec<f64> = material.runs.numbers("deploy_altitude_m")?.iter().map(|m| m * 1e-3).collect();
    let (low_km, high_km) = (limits.min_altitude_m * 1e-3, limits.max_altitude_m * 1e-3);
    let panel = |name: &str, label: &str, low: f64, high: f64| -> Result<Panel, CampaignReportError> {
        let points: Vec<Point> = material.runs.numbers(name)?.into_iter().zip(altitude_km.iter().copied()).collect();
        let points: Vec<Point> = points.into_iter().filter(|p| p.0.is_finite() && p.1.is_finite()).collect();
        let inside = |p: &Point| (low..=high).contains(&p.0) && (low_km..=high_km).contains(&p.1);
        let (good, bad): (Vec<Point>, Vec<Point>) = points.into_iter().partition(inside);
        let (middle, centre) = ((0.5 * (low + high), high - low), (0.5 * (low_km + high_km), high_km - low_km));
        let size = |p: &Point| ((p.0 - middle.0) / middle.1).hypot((p.1 - centre.0) / centre.1);
        let corners = vec![(low, low_km), (high, low_km), (high, high_km), (low, high_km)];
        let x = Axis::fit(label).including(low).including(high);
        let y = Axis::fit("altitude, km").including(low_km).including(high_km);
        Ok(Panel::new(x, y, 270)
            .with(Layer::Area { corners, ink: Ink::Green, opacity: 0.14 })
            .dots(thinned(&good, size), Ink::Blue, 1.8)
            .dots(thinned(&bad, size), Ink::Vermillion, 2.6))
    };
    Ok(Figure {
        title: "Deploy box",
        caption:
            "Altitude against air-relative Mach number and dynamic pressure at deployment; the box defines success."
                .into(),
        legend: vec![
            (Mark::Band, Ink::Green, "deploy box".into()),
            (Mark::Dot, Ink::Blue, "inside".into()),
            (Mark::Dot, Ink::Vermillion, "outside".into()),
        ],
        panels: vec![
            panel("deploy_mach", "Mach number", limits.min_mach, limits.max_mach)?,
            panel(
                "deploy_dynamic_pressure_pa",
                "dynamic pressure, Pa",
                limits.min_dynamic_pressure_pa,
                limits.max_dynamic_pressure_pa,
            )?,
        ],
        missing: "No run deployed.",
    })
}

fn loads(material: &Material<'_>) -> Result<Figure, CampaignReportError> {
    let limits = &material.facts.constraints;
    let panel = |name: &str, label: &str, scale: f64, limit: f64| -> Result<Panel, CampaignReportError> {
        let values: Vec<f64> = material.runs.numbers(name)?.iter().map(|v| v * scale).collect();
        let x = Axis::fit(label).including(limit * scale);
        let panel = bars(Panel::new(x, Axis::fit("% of the runs").including(0.0), 180), &values, BARS);
        Ok(panel.instants([limit * scale], Ink::Vermillion))
    };
    Ok(Figure {
        title: "Loads and heat",
        caption: "Largest values along each path. The lines are the limits that guidance is told.".into(),
        legend: vec![(Mark::Band, Ink::Orange, "runs".into()), (Mark::Instant, Ink::Vermillion, "limit".into())],
        panels: vec![
            panel("peak_load_g", "peak sensed load, g", 1.0, limits.load_mps2 / STANDARD_GRAVITY_MPS2)?,
            panel("peak_heat_flux_wpm2", "peak heat flux, kW/m²", 1e-3, limits.heat_flux_wpm2)?,
            panel("peak_dynamic_pressure_pa", "peak dynamic pressure, kPa", 1e-3, limits.dynamic_pressure_pa)?,
        ],
        missing: "No run was flown.",
    })
}

/// A histogram in a panel.
pub fn bars(panel: Panel, values: &[f64], bars: usize) -> Panel {
    histogram(values, bars).into_iter().filter(|(_, _, share)| *share > 0.0).fold(panel, |panel, (from, to, share)| {
        let corners = vec![(from, 0.0), (to, 0.0), (to, share), (from, share)];
        panel.with(Layer::Area { corners, ink: Ink::Orange, opacity: 0.75 })
    })
}
