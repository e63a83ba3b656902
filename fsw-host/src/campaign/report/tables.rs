//! Tables of the page: percentages and percentiles with their bounds, worst and failed runs.

use maud::{Markup, html};

use super::super::statistics::Share;
use super::super::summary::{Distribution, Spread, Summary, Worst};
use crate::report::number;

/// Shares within a distance, and percentiles.
pub fn figures(summary: &Summary) -> Markup {
    html! {
        section id="figures" {
            h2 { "Figures with 95 % bounds" }
            div.pair {
                table {
                    thead { tr { th.text { "runs" } th { "share" } th { "lower" } th { "upper" } } }
                    tbody {
                        @for (ring, share) in summary.within_pct.rings() { (share_row(&format!("within {ring}"), share)) }
                        (share_row("deployed inside the box", summary.success_pct))
                        @if summary.unreachable.at_end > 0 {
                            @for (ring, share) in summary.unreachable.others_within_pct.rings() {
                                (share_row(&format!("not called unreachable, within {ring}"), share))
                            }
                        }
                    }
                }
                table {
                    thead { tr { th.text { "" } th { "50 %" } th { "90 %" } th { "99 %" } th { "99.9 %" } th { "max" } th { "mean" } } }
                    tbody {
                        (distribution_rows("miss, m", summary.miss_m.as_ref(), 0))
                        (distribution_rows("position error, m", summary.navigation_position_error_m.as_ref(), 1))
                        (distribution_rows("velocity error, m/s", summary.navigation_velocity_error_mps.as_ref(), 2))
                    }
                }
                (spreads(summary))
            }
        }
    }
}

/// Conditions at deployment and peaks, with bounds.
fn spreads(summary: &Summary) -> Markup {
    let (deploy, peak) = (&summary.deploy, &summary.peak);
    html! {
        table {
            thead { tr { th.text { "" } th { "min" } th { "1 %" } th { "50 %" } th { "99 %" } th { "max" } th { "mean" } } }
            tbody {
                (spread_rows("deploy altitude, km", deploy.altitude_m.as_ref(), 1e-3, 2))
                (spread_rows("deploy speed, m/s", deploy.speed_mps.as_ref(), 1.0, 1))
                (spread_rows("deploy Mach number", deploy.mach.as_ref(), 1.0, 2))
                (spread_rows("deploy dynamic pressure, Pa", deploy.dynamic_pressure_pa.as_ref(), 1.0, 0))
                (spread_rows("peak load, g", peak.load_g.as_ref(), 1.0, 2))
                (spread_rows("peak heat flux, kW/m²", peak.heat_flux_wpm2.as_ref(), 1e-3, 0))
                (spread_rows("peak dynamic pressure, kPa", peak.dynamic_pressure_pa.as_ref(), 1e-3, 2))
            }
        }
    }
}

fn spread_rows(name: &str, spread: Option<&Spread>, scale: f64, digits: usize) -> Markup {
    let Some(s) = spread else { return html! {} };
    let of = |v: f64| number(v * scale, digits);
    html! {
        tr {
            th.text { (name) }
            @for value in [s.min, s.p01, s.p50, s.p99, s.max, s.mean] { td { (of(value)) } }
        }
        tr.bounds {
            td.text { "95 % bounds" }
            td {}
            @for pair in [s.bounds.p01, s.bounds.p50, s.bounds.p99] { td { (bound(pair, of)) } }
            td {} td {}
        }
    }
}

/// A pair of bounds as text.
fn bound([low, high]: [Option<f64>; 2], of: impl Fn(f64) -> String) -> String {
    let text = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), &of);
    format!("{} … {}", text(low), text(high))
}

fn share_row(name: &str, share: Option<Share>) -> Markup {
    html! {
        @if let Some(share) = share {
            tr {
                th.text { (name) }
                td { (number(share.value, 2)) " %" }
                td { (number(share.low, 2)) }
                td { (number(share.high, 2)) }
            }
        }
    }
}

fn distribution_rows(name: &str, distribution: Option<&Distribution>, digits: usize) -> Markup {
    // Ideal navigation has no errors to show.
    let Some(d) = distribution.filter(|d| d.max > 0.0) else { return html! {} };
    let of = |v: f64| number(v, digits);
    html! {
        tr {
            th.text { (name) }
            @for value in [d.p50, d.p90, d.p99, d.p999, d.max, d.mean] { td { (of(value)) } }
        }
        tr.bounds {
            td.text { "95 % bounds" }
            @for pair in [d.bounds.p50, d.bounds.p90, d.bounds.p99, d.bounds.p999] { td { (bound(pair, of)) } }
            td {} td {}
        }
    }
}

/// Worst runs and failed ones, each with its command.
pub fn worst(summary: &Summary) -> Markup {
    html! {
        section id="worst" {
            h2 { "Worst runs" }
            (runs(&summary.worst))
            @if !summary.failed.is_empty() {
                h2 { "Runs that failed their own checks" }
                p.caption { "The first " (summary.failed.len()) "; the column success of runs.parquet has all of them." }
                (runs(&summary.failed))
            }
        }
    }
}

fn runs(list: &[Worst]) -> Markup {
    let remarks = list.iter().any(|run| run.unreachable || run.reason.is_some());
    html! {
        table.runs {
            thead { tr { th { "run" } th { "miss, m" } @if remarks { th.text { "remarks" } } th.text { "fly it again" } } }
            tbody {
                @for run in list {
                    tr {
                        td { (run.run) }
                        td { (run.miss_m.map_or_else(|| "–".to_owned(), |m| number(m, 0))) }
                        @if remarks {
                            td.text {
                                @if run.unreachable { "called unreachable by the flight software" }
                                @if run.unreachable && run.reason.is_some() { "; " }
                                @if let Some(reason) = &run.reason { (reason) }
                            }
                        }
                        td.text { code { (run.command) } }
                    }
                }
            }
        }
    }
}
