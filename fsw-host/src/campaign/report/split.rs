//! The split of the miss: shares of atmosphere, navigation and guidance, and how the miss shrinks without them.

use maud::{Markup, html};

use super::super::columns::SPLIT;
use super::super::statistics::ascending;
use super::super::summary::Split;
use super::misses::curve_of;
use super::{CampaignReportError, Material};
use crate::report::{Axis, Figure, Ink, Mark, Panel, number};

/// The misses of the same runs; none when no run was flown again.
pub fn figures(material: &Material<'_>) -> Result<Vec<Figure>, CampaignReportError> {
    if material.summary.split.is_none() {
        return Ok(Vec::new());
    }
    let read = |name: &str| material.runs.numbers(name).map(|v| v.iter().map(|m| m * 1e-3).collect::<Vec<f64>>());
    let (misses, known, ideal) = (read("miss_m")?, read(SPLIT[0])?, read(SPLIT[1])?);
    let flown: Vec<f64> = misses.iter().zip(&ideal).filter(|(_, k)| k.is_finite()).map(|(m, _)| *m).collect();
    let curve = |values: &[f64]| {
        let sorted = ascending(values);
        curve_of(&sorted, sorted.len())
    };
    let panel = Panel::new(Axis::fit("miss, km").decades(), Axis::fixed("within, % of these runs", 0.0, 100.0), 260)
        .line(curve(&ideal), Ink::Green)
        .line(curve(&known), Ink::Orange)
        .line(curve(&flown), Ink::Blue);
    Ok(vec![Figure {
        title: "The same runs with less to contend with",
        caption: "As flown, with the density of their air known on board, and with ideal navigation on top of that."
            .into(),
        legend: vec![
            (Mark::Line, Ink::Blue, "as flown".into()),
            (Mark::Line, Ink::Orange, "known density".into()),
            (Mark::Line, Ink::Green, "and ideal navigation".into()),
        ],
        panels: vec![panel],
        missing: "",
    }])
}

/// The shares as bars.
pub fn shares(split: &Split) -> Markup {
    let bounds = split.bounds.map(|b| [b.atmosphere_pct, b.navigation_pct, b.guidance_pct]);
    let shares = [
        ("atmosphere", split.atmosphere_pct),
        ("navigation", split.navigation_pct),
        ("guidance and vehicle", split.guidance_pct),
    ];
    html! {
        figure {
            h3 { "Shares of the mean squared miss" }
            p.caption {
                (split.runs) " runs flown three times. The share of the atmosphere goes when the density is known on board, "
                "that of navigation when it is ideal too; the rest is left to guidance and the dispersed vehicle. A share is "
                "below zero when the miss grew. Root mean square " (number(split.flown_m, 0)) " m as flown, "
                (number(split.known_density_m, 0)) " m with known density, " (number(split.ideal_navigation_m, 0))
                " m with ideal navigation too."
            }
            table.shares {
                thead { tr { th.text { "share" } th { "%" } th { "95 % bounds" } th {} } }
                tbody {
                    @for (k, (name, share)) in shares.iter().enumerate() {
                        tr {
                            th.text { (name) }
                            td { (number(*share, 0)) }
                            td { @if let Some(bounds) = bounds { (number(bounds[k][0], 0)) " … " (number(bounds[k][1], 0)) } @else { "–" } }
                            td { span.axis { span style=(format!("width:{:.1}%", share.clamp(0.0, 100.0))) {} } }
                        }
                    }
                }
            }
        }
    }
}
