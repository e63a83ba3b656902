//! The page: header with the verdict, key figures, sections of figures, tables.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::figures::{self, Story};
use super::plot::{Figure, PlotError, number};
use super::{computer, palette, tables};
use crate::record::{End, FlightRecord, Summary};

/// The style of every page.
pub const STYLE: &str = include_str!("style.css");

/// The whole page.
///
/// # Errors
/// When a plot cannot be drawn.
pub fn html(record: &FlightRecord) -> Result<String, PlotError> {
    let story = Story::new(record);
    let title = format!("{} · seed {}", record.facts.name, record.seed);
    let mut sections = Vec::new();
    for (id, name, figures) in contents(&story) {
        let figures: Vec<Markup> = figures.iter().map(Figure::render).collect::<Result<_, _>>()?;
        sections.push((id, name, figures));
    }
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { "Aeroshell flight report: " (title) }
                style { (PreEscaped(palette::style_sheet())) (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (header(record))
                    (cards(&record.summary))
                    (tables::events(record))
                    @for (id, name, figures) in &sections {
                        section id=(id) {
                            h2 { (name) }
                            div.grid { @for figure in figures { (figure) } }
                        }
                    }
                    (computer::section(record))
                    (tables::link(record))
                    (refly(record))
                }
            }
        }
    };
    Ok(page.into_string())
}

/// Sections of figures in the order of the page.
fn contents(story: &Story<'_>) -> Vec<(&'static str, &'static str, Vec<Figure>)> {
    let lateral = figures::guidance::figures(story);
    let mut computer = vec![figures::innovations::figure(story), figures::loads::figure(story)];
    // A flight computer elsewhere tells its worst frames only: they are in a table.
    if !story.record.frame_cost_us.is_empty() || story.record.summary.cost.is_none() {
        computer.push(figures::cost::figure(story));
    }
    vec![
        ("flight", "Flight", vec![figures::timeline::figure(story), figures::descent::figure(story)]),
        ("track", "Track and bank", vec![figures::track::figure(story), figures::bank::figure(story)]),
        ("guidance", "Guidance", lateral),
        ("navigation", "Navigation", figures::navigation::figures(story)),
        ("measurements", "Measurements, loads and computer", computer),
    ]
}

fn header(record: &FlightRecord) -> Markup {
    let summary = &record.summary;
    let (class, verdict) = verdict(record);
    html! {
        header {
            p.kicker { "Aeroshell flight report" }
            h1 { (record.facts.name) }
            p.run {
                "seed " b { (record.seed) } " · run " b { (record.run) } " · "
                @if record.nominal { "nominal, dispersions off" } @else { "dispersed" }
                @if record.summary.computer.place.contains(':') { " · computer " b { (record.summary.computer.place) } }
                " · navigation " b { (record.facts.navigation.title()) }
                " · " (number(f64::from(summary.frames), 0)) " frames in " (number(summary.wall_s, 2)) " s of wall time"
            }
            p.verdict.(class) role="status" { (verdict) }
        }
    }
}

/// What became of the flight: style class and one sentence.
fn verdict(record: &FlightRecord) -> (&'static str, String) {
    let summary = &record.summary;
    let miss = summary.miss_m.map(|m| format!("{} km from the target", number(m * 1e-3, 2)));
    if summary.success {
        return (
            "good",
            format!("Parachute deployed inside the box, {}.", miss.unwrap_or_else(|| "miss unknown".into())),
        );
    }
    let reason = summary.reason.clone().map(|r| format!(": {}", r.trim_end_matches('.'))).unwrap_or_default();
    let what = match &record.end {
        End::Deployed => format!("Deployed{}, but outside the box", miss.map(|m| format!(" {m}")).unwrap_or_default()),
        End::Ground => "Reached the ground without a parachute".into(),
        End::TimeLimit => "Still flying at the time limit".into(),
        End::Interrupted => "Interrupted in flight".into(),
        End::Failed(cause) => return ("bad", format!("Failed: {}.", cause.trim_end_matches('.'))),
    };
    (if record.end == End::Interrupted { "open" } else { "bad" }, format!("{what}{reason}."))
}

/// One key figure: name, value, unit, small print.
type Card = (&'static str, String, &'static str, String);

fn cards(summary: &Summary) -> Markup {
    let known =
        |value: Option<f64>, scale: f64, digits| value.map_or_else(|| "–".to_owned(), |v| number(v * scale, digits));
    let deploy = summary.deploy;
    let signed = format!(
        "{} km downrange, {} km across",
        known(summary.downrange_error_m, 1e-3, 2),
        known(summary.crossrange_error_m, 1e-3, 2)
    );
    let conditions = deploy
        .map_or_else(String::new, |d| format!("Mach {}, {} Pa", number(d.mach, 2), number(d.dynamic_pressure_pa, 0)));
    let consistent = summary.navigation.nees_mean.map_or_else(String::new, |n| format!(", NEES {} of 6", number(n, 1)));
    let limit = match (summary.navigation.position_bound_m, summary.navigation.velocity_bound_mps) {
        (Some(position), Some(velocity)) => format!("; bound {} m, {} m/s", number(position, 0), number(velocity, 2)),
        _ => String::new(),
    };
    let corrector = &summary.corrector;
    let cards: [Card; 8] = [
        ("Miss", known(summary.miss_m, 1e-3, 2), "km", signed),
        (
            "Deploy altitude",
            known(deploy.map(|d| d.altitude_m), 1e-3, 2),
            "km",
            deploy.map_or_else(String::new, |d| format!("at {} s", number(d.time_s, 1))),
        ),
        ("Deploy speed", known(deploy.map(|d| d.speed_mps), 1.0, 0), "m/s", conditions),
        (
            "Peak load",
            number(summary.peak.load_g, 1),
            "g",
            format!("{} kPa dynamic pressure", number(summary.peak.dynamic_pressure_pa * 1e-3, 1)),
        ),
        (
            "Peak heat flux",
            number(summary.peak.heat_flux_wpm2 * 1e-3, 0),
            "kW/m²",
            "stagnation point, convective".into(),
        ),
        (
            "Bank reversals",
            summary.reversals.to_string(),
            "",
            format!(
                "{} iterations a cycle, at most {}",
                number(corrector.mean_iterations, 2),
                corrector.max_iterations
            ),
        ),
        (
            "Navigation error",
            known(summary.navigation.position_error_m, 1.0, 0),
            "m",
            format!("{} m/s at the end{consistent}{limit}", known(summary.navigation.velocity_error_mps, 1.0, 2)),
        ),
        (
            "Predictor work",
            corrector.max_integrations.to_string(),
            "evaluations",
            format!("worst cycle, bound {}", corrector.bound),
        ),
    ];
    html! {
        section.cards id="figures" aria-label="Key figures" {
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

/// How to fly this flight again.
fn refly(record: &FlightRecord) -> Markup {
    let nominal = if record.nominal { " --nominal" } else { "" };
    let place = record.summary.computer.place.as_str();
    let elsewhere = if place.contains(':') { format!(" --computer {place}") } else { String::new() };
    html! {
        section id="again" {
            h2 { "Fly it again" }
            p { "From this run folder; the scenario file beside this page holds every setting." }
            pre { "aeroshell fly scenario.toml --seed " (record.seed) " --run " (record.run) (nominal) (elsewhere) "\naeroshell replay ." }
            p { "From the repository, " code { "cargo run --release --" } " stands for " code { "aeroshell" } "." }
            @if !record.summary.output_hash.is_empty() {
                p.hash { "Output hash " code { (record.summary.output_hash) } }
            }
        }
    }
}
