//! The page: header with the verdict, key figures, sections of figures, tables.

use hil_sim::scenario::Scenario;
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{CampaignReportError, Material, Sections, causes, split, tables};
use crate::report::{Figure, STYLE, number, style_sheet};

/// What the pages of campaigns add to the style of the flight report.
const MORE: &str = include_str!("style.css");

/// The whole page.
pub fn html(material: &Material<'_>, sections: &Sections) -> Result<String, CampaignReportError> {
    let mut drawn = Vec::new();
    for (id, name, figures) in sections {
        drawn.push((id, name, figures.iter().map(Figure::render).collect::<Result<Vec<Markup>, _>>()?));
    }
    let (explained, applied) = (causes::section(material)?, causes::applied(material)?);
    let body = html! {
        (header(material))
        (cards(material))
        (tables::figures(material.summary))
        @for (id, name, figures) in drawn.iter().filter(|(_, _, figures)| !figures.is_empty()) {
            section id=(id) {
                h2 { (name) }
                div.grid {
                    @if let ("split", Some(split)) = (**id, &material.summary.split) { (split::shares(split)) }
                    @for figure in figures { (figure) }
                }
            }
        }
        (explained)
        (tables::worst(material.summary))
        (applied)
        (again(material))
    };
    Ok(document(&format!("Aeroshell campaign: {}", material.summary.scenario), &body))
}

/// A page of its own around a body.
pub fn document(title: &str, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(style_sheet())) (PreEscaped(STYLE)) (PreEscaped(MORE)) }
            }
            body { main { (body) } }
        }
    };
    page.into_string()
}

fn header(material: &Material<'_>) -> Markup {
    let s = material.summary;
    let last = (s.first + s.runs).saturating_sub(1);
    let scenario = material.scenario;
    let all = s.success_pct.is_some_and(|share| share.value >= 100.0);
    html! {
        header {
            p.kicker { "Aeroshell campaign" }
            h1 { (s.scenario) }
            p.run {
                b { (s.runs) } " runs, " (s.first) " to " (last) ", of seed " b { (s.seed) }
                " · guidance " b { (word(scenario, "guidance", "mode")) }
                " · trigger " b { (word(scenario, "deploy", "trigger")) }
                " · navigation " b { (word(scenario, "navigation", "filter")) }
                @if scenario.dispersions.winds { " · dispersed winds" }
            }
            p.verdict.(if all { "good" } else { "bad" }) role="status" { (verdict(material)) }
        }
    }
}

/// A field of the scenario as its file has it.
fn word(scenario: &Scenario, block: &str, field: &str) -> String {
    let value = serde_json::to_value(scenario).unwrap_or_default();
    value[block][field].as_str().unwrap_or_default().to_owned()
}

fn verdict(material: &Material<'_>) -> String {
    let s = material.summary;
    let inside = s.success_pct.map_or_else(String::new, |share| {
        format!(
            "{} % deployed inside the box [{} … {}]",
            number(share.value, 2),
            number(share.low, 2),
            number(share.high, 2)
        )
    });
    let miss = s.miss_m.map_or_else(
        || "no run deployed".to_owned(),
        |m| format!("half of them within {} m, 99 % within {} m", number(m.p50, 0), number(m.p99, 0)),
    );
    format!("{inside}; {miss}.")
}

/// One key figure: name, value, unit, small print.
type Card = (&'static str, String, &'static str, String);

fn cards(material: &Material<'_>) -> Markup {
    let s = material.summary;
    let range = |[low, high]: [Option<f64>; 2]| {
        let text = |v: Option<f64>| v.map_or_else(|| "–".to_owned(), |v| number(v, 0));
        format!("95 % bounds {} … {}", text(low), text(high))
    };
    let miss = s.miss_m.unwrap_or_default();
    let within = s.within_pct.km1.unwrap_or_default();
    let altitude = s.deploy.altitude_m.unwrap_or_default();
    let speed = s.deploy.speed_mps.unwrap_or_default();
    let load = s.peak.load_g.unwrap_or_default();
    let work = &s.guidance;
    let unreachable = &s.unreachable;
    let cards: [Card; 8] = [
        ("Median miss", number(miss.p50, 0), "m", range(miss.bounds.p50)),
        ("99 % of the runs within", number(miss.p99, 0), "m", range(miss.bounds.p99)),
        (
            "Within 1 km",
            number(within.value, 2),
            "%",
            format!("95 % bounds {} … {}", number(within.low, 2), number(within.high, 2)),
        ),
        (
            "Called unreachable",
            unreachable.at_end.to_string(),
            "runs",
            unreachable.miss_m.map_or_else(
                || format!("by the flight software to the end; {} at some time", unreachable.ever),
                |m| {
                    let (low, high) = (number(m.min, 0), number(m.max, 0));
                    format!(
                        "by the flight software to the end, missed by {low} … {high} m; {} at some time",
                        unreachable.ever
                    )
                },
            ),
        ),
        (
            "Deploy altitude",
            number(altitude.p50 * 1e-3, 2),
            "km",
            format!("{} … {} km", number(altitude.min * 1e-3, 2), number(altitude.max * 1e-3, 2)),
        ),
        (
            "Deploy speed",
            number(speed.p50, 0),
            "m/s",
            format!("{} … {} m/s", number(speed.min, 1), number(speed.max, 1)),
        ),
        ("Peak load", number(load.max, 1), "g", format!("median {} g", number(load.p50, 1))),
        (
            "Evaluations a cycle",
            number(work.evaluations_per_cycle.unwrap_or(0.0), 0),
            "",
            format!(
                "most {}; {} reversals a flight",
                work.max_evaluations,
                number(s.reversals.unwrap_or_default().mean, 2)
            ),
        ),
    ];
    html! {
        section.cards id="cards" aria-label="Key figures" {
            @for (name, value, unit, note) in cards {
                div.card {
                    span.name { (name) }
                    span.value { (value) @if !unit.is_empty() { " " span.unit { (unit) } } }
                    span.note { (note) }
                }
            }
        }
    }
}

/// How to fly this campaign again.
fn again(material: &Material<'_>) -> Markup {
    let i = material.identity;
    let split = if i.split == crate::cli::DEFAULT_SPLIT { String::new() } else { format!(" --split {}", i.split) };
    let first = if i.first == 0 { String::new() } else { format!(" --first {}", i.first) };
    html! {
        section id="again" {
            h2 { "Fly it again" }
            p { "The file scenario.toml beside this page holds every setting; runs.parquet holds every run." }
            pre { "aeroshell campaign " (i.fly.join(" ")) " --seed " (i.seed) " --runs " (i.runs) (first) (split) }
        }
    }
}
