//! `compare`: campaigns side by side, as a table and as overlaid distributions.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use maud::{Markup, html};
use serde::Serialize;

use super::folder::{self, RUNS, read_scenario};
use super::identity::{Identity, read_identity};
use super::report::{
    document,
    misses::{curve_of, tail_of},
};
use super::runs::Runs;
use super::statistics::ascending;
use super::summary::{Summary, summarise};
use crate::cli::CompareArgs;
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::record::ScenarioFacts;
use crate::report::{Axis, Figure, Ink, Mark, Panel, number};
use crate::runfolder::write_whole;

/// Colours of the campaigns in order; as many as can be told apart.
const INKS: [Ink; 6] = [Ink::Blue, Ink::Orange, Ink::Green, Ink::Vermillion, Ink::Sky, Ink::Purple];

/// One campaign of the comparison.
#[derive(Serialize)]
struct Entry {
    /// Its folder.
    folder: PathBuf,
    /// What it is about, in words.
    name: String,
    /// Its figures.
    summary: Summary,
    /// Its misses, km, ascending.
    #[serde(skip)]
    misses_km: Vec<f64>,
}

/// Runs the command.
///
/// # Errors
/// A folder that holds no complete campaign, or a file that cannot be written.
pub fn run(args: &CompareArgs) -> Result<bool, HostError> {
    if args.campaigns.len() > INKS.len() {
        return Err(HostError::Option(format!("at most {} campaigns can be told apart in one picture", INKS.len())));
    }
    let entries = args.campaigns.iter().map(|path| open(path)).collect::<Result<Vec<_>, _>>()?;
    if let Some(out) = &args.out {
        if out.exists() && !args.force && !crate::runfolder::is_special(out) {
            return Err(HostError::FileExists(out.clone()));
        }
        let page = page(&entries).map_err(|e| HostError::Option(e.to_string()))?;
        write_whole(out, |file| std::io::Write::write_all(file, page.as_bytes()))?;
    }
    if args.json {
        print_json(&entries)?;
    } else {
        print(&table(&entries))?;
    }
    Ok(true)
}

fn open(path: &Path) -> Result<Entry, HostError> {
    let identity = read_identity(path)?;
    let table = path.join(RUNS);
    if !table.is_file() {
        let path = path.display();
        return Err(HostError::Option(format!("{path} is not complete: run its campaign again to the end first")));
    }
    let facts = ScenarioFacts::of(&read_scenario(path, &identity)?);
    let runs = Runs::open(&table, &identity)?;
    let read = || {
        let summary = summarise(&runs, &identity, &facts)?;
        std::io::Result::Ok((summary, runs.numbers("miss_m")?))
    };
    let (summary, misses) = read().map_err(HostError::file("read", &table))?;
    let misses_km = ascending(&misses).into_iter().map(|m| m * 1e-3).collect();
    Ok(Entry { folder: path.to_owned(), name: name(path, &identity), summary, misses_km })
}

/// Folder and what was asked for.
fn name(path: &Path, identity: &Identity) -> String {
    format!("{} ({}, seed {})", folder::short(path), identity.fly.join(" "), identity.seed)
}

/// One line of the table: what it says and how every campaign says it.
type Line = (&'static str, fn(&Summary) -> String);

const LINES: &[Line] = &[
    ("runs", |s| s.runs.to_string()),
    ("deployed inside the box, %", |s| share(s.success_pct)),
    ("within 50 m, %", |s| share(s.within_pct.m50)),
    ("within 1 km, %", |s| share(s.within_pct.km1)),
    ("within 2 km, %", |s| share(s.within_pct.km2)),
    ("within 2.5 km, %", |s| share(s.within_pct.km2_5)),
    ("within 5 km, %", |s| share(s.within_pct.km5)),
    ("within 10 km, %", |s| share(s.within_pct.km10)),
    ("miss 50 %, m", |s| s.miss_m.map_or_else(none, |m| bounded(m.p50, m.bounds.p50))),
    ("miss 90 %, m", |s| s.miss_m.map_or_else(none, |m| bounded(m.p90, m.bounds.p90))),
    ("miss 99 %, m", |s| s.miss_m.map_or_else(none, |m| bounded(m.p99, m.bounds.p99))),
    ("miss 99.9 %, m", |s| s.miss_m.map_or_else(none, |m| bounded(m.p999, m.bounds.p999))),
    ("largest miss, m", |s| s.miss_m.map_or_else(none, |m| number(m.max, 0))),
    ("called unreachable", |s| s.unreachable.at_end.to_string()),
    // Ideal navigation has no errors to show.
    ("navigation error 99 %, m", |s| {
        s.navigation_position_error_m.filter(|d| d.max > 0.0).map_or_else(none, |m| bounded(m.p99, m.bounds.p99))
    }),
    ("deploy altitude, km", |s| range(s.deploy.altitude_m.map(|d| [d.min * 1e-3, d.max * 1e-3]), 2)),
    ("deploy speed, m/s", |s| range(s.deploy.speed_mps.map(|d| [d.min, d.max]), 1)),
    ("largest load, g", |s| s.peak.load_g.map_or_else(none, |p| number(p.max, 2))),
    ("reversals a flight", |s| s.reversals.map_or_else(none, |r| number(r.mean, 2))),
    ("evaluations a cycle", |s| s.guidance.evaluations_per_cycle.map_or_else(none, |e| number(e, 0))),
    ("most evaluations", |s| s.guidance.max_evaluations.to_string()),
];

fn none() -> String {
    "–".to_owned()
}

fn share(share: Option<super::statistics::Share>) -> String {
    share.map_or_else(none, |s| format!("{} [{} … {}]", number(s.value, 2), number(s.low, 2), number(s.high, 2)))
}

fn bounded(value: f64, [low, high]: [Option<f64>; 2]) -> String {
    let text = |v: Option<f64>| v.map_or_else(none, |v| number(v, 0));
    format!("{} [{} … {}]", number(value, 0), text(low), text(high))
}

fn range(range: Option<[f64; 2]>, digits: usize) -> String {
    range.map_or_else(none, |[low, high]| format!("{} … {}", number(low, digits), number(high, digits)))
}

fn table(entries: &[Entry]) -> String {
    let mut out = String::new();
    for (k, entry) in entries.iter().enumerate() {
        let _ = writeln!(out, "  {}  {}", letter(k), entry.name);
    }
    let cells: Vec<Vec<String>> =
        LINES.iter().map(|(_, cell)| entries.iter().map(|entry| cell(&entry.summary)).collect()).collect();
    let length = |text: &String| text.chars().count();
    let widths: Vec<usize> =
        (0..entries.len()).map(|k| cells.iter().map(|line| length(&line[k])).max().unwrap_or(1)).collect();
    let padded = |text: &str, width: usize| format!("{}{text}", " ".repeat(width - text.chars().count().min(width)));
    let heads: Vec<String> = (0..entries.len()).map(|k| padded(&letter(k), widths[k])).collect();
    let _ = writeln!(out, "\n  {:<28}  {}", "", heads.join("   "));
    for ((name, _), line) in LINES.iter().zip(&cells) {
        let line: Vec<String> = line.iter().zip(&widths).map(|(text, width)| padded(text, *width)).collect();
        let _ = writeln!(out, "  {name:<28}  {}", line.join("   "));
    }
    out
}

/// A, B, C, …
fn letter(k: usize) -> String {
    char::from(b'A' + k as u8).to_string()
}

fn page(entries: &[Entry]) -> Result<String, crate::report::PlotError> {
    let within = |entry: &Entry| curve_of(&entry.misses_km, entry.summary.runs as usize);
    let farther = |entry: &Entry| tail_of(&entry.misses_km, entry.summary.runs as usize);
    let panel = Panel::new(Axis::fit("").silent().decades(), Axis::fixed("within, % of the runs", 0.0, 100.0), 320);
    let tail = Panel::new(Axis::fit("miss, km").decades(), Axis::fit("farther, % of the runs").decades(), 260);
    let coloured = || entries.iter().zip(INKS);
    let figure = Figure {
        title: "Distribution of the miss",
        caption:
            "Above the share of the runs that deployed within a distance of the target, below the share beyond it on a \
                  logarithmic scale."
                .into(),
        legend: coloured().map(|(entry, ink)| (Mark::Line, ink, entry.name.clone())).collect(),
        panels: vec![
            coloured().fold(panel, |panel, (entry, ink)| panel.line(within(entry), ink)),
            coloured().fold(tail, |panel, (entry, ink)| panel.line(farther(entry), ink)),
        ],
        missing: "No run deployed.",
    };
    let figure = figure.render()?;
    let body: Markup = html! {
        header { p.kicker { "Aeroshell campaigns side by side" } h1 { "Comparison of " (entries.len()) " campaigns" } }
        section { div.wide { (figure) } }
        section {
            h2 { "Figures with 95 % bounds" }
            table.overlay {
                thead { tr { th.text { "" } @for entry in entries { th { (entry.name) } } } }
                tbody {
                    @for (name, cell) in LINES {
                        tr { th.text { (name) } @for entry in entries { td { (cell(&entry.summary)) } } }
                    }
                }
            }
        }
    };
    Ok(document("Aeroshell campaigns side by side", &body))
}
