//! The page of P4's experiment: verdict, comparison, the paper's plots, what was flown.

use fsw_core::units::deg;
use maud::{Markup, html};

use super::published::{Line, Said};
use super::{CONDITIONS, Flown, StudyArgs, figures, nominal};
use crate::campaign::report::document;
use crate::record::TruthSample;
use crate::report::{PlotError, number};

/// What the paper prints and this study flies otherwise, each with its place.
const CORRECTIONS: [&str; 8] = [
    "eq. 1: θ' and φ' print φ for ψ, ψ' prints cosφ for cosψ; flown are the corrected equations of motion.",
    "eq. 2: the path length differs from the great circle by kilometres; the predicted end point's downrange is used.",
    "eq. 5 and 6 mix φ and ψ; eq. 7 drops the convergence of the meridians; both are in the alignment.",
    "eq. 8: heat flux grows as the root of the density (Sutton–Graves), not with the density.",
    "eq. 9: the normal load is |L cosα + D sinα|.",
    "§4.1: predictions that stop at a waypoint saturate under dispersion, because there is no air to steer with before the \
     first one, at 64 km: mode segmented flies that as it is printed, mode segmented-table takes the remaining range from a \
     table, in the air that it learns in flight.",
    "§4.1 says only of range that it is flown from waypoint to waypoint. Crossrange is counted from the arc to the deploy \
     point (§3.1) and steered to it (§3.3), so both segmented modes look at the target sideways.",
    "§5 names neither its dispersions nor its number of runs: those here are the base dispersions of the scenario.",
];

/// The page.
pub fn html(args: &StudyArgs, modes: &[Flown], lines: &[Line]) -> Result<String, PlotError> {
    let drawn = |all: Vec<crate::report::Figure>| all.iter().map(crate::report::Figure::render).collect();
    let points: Result<Vec<Markup>, PlotError> =
        drawn(modes.iter().map(figures::deploys).chain([figures::distribution(modes)]).collect());
    let offsets: Result<Vec<Markup>, PlotError> = drawn(modes.iter().map(figures::offset).collect());
    let paths: Result<Vec<Markup>, PlotError> =
        drawn(vec![figures::altitude(modes), figures::track(modes), figures::bank(modes)]);
    let body = html! {
        (header(args, modes))
        (comparison(modes, lines))
        (ends(modes))
        (section("Deploy points", &points?))
        (section("Crossrange against its threshold", &offsets?))
        (section("Trajectories", &paths?))
        (flown(args, modes))
    };
    Ok(document("Aeroshell study npc: the experiment of P4", &body))
}

fn header(args: &StudyArgs, modes: &[Flown]) -> Markup {
    html! {
        header {
            p.kicker { "Aeroshell study npc" }
            h1 { "Predictor-corrector, full and segmented: the experiment of P4" }
            p.run {
                "Xia, Shen, Sun, Zhou 2015, doi 10.15982/j.issn.2095-7777.2015.04.007 · scenario " b { (args.config) }
                " without rotation and J2, ideal navigation · " b { (args.runs) } " runs of seed " b { (args.seed) }
                " a mode"
            }
            p.verdict.open { (verdict(modes)) }
        }
    }
}

/// One sentence a mode.
fn verdict(modes: &[Flown]) -> String {
    let full = modes.first().and_then(Flown::evaluations_per_flight);
    let sentence = |m: &Flown| {
        let within = m.summary.within_pct.km5.map_or_else(|| "–".to_owned(), |s| number(s.value, 1));
        let work = match (m.evaluations_per_flight(), full) {
            (Some(m), Some(full)) if full > 0.0 => number(100.0 * m / full, 0),
            _ => "–".to_owned(),
        };
        format!("{}: {within} % within 5 km with {work} % of the evaluations", m.mode.name())
    };
    format!(
        "{}. P4: full 98 %, segmented 86 % in half the time.",
        modes.iter().map(sentence).collect::<Vec<_>>().join("; ")
    )
}

fn comparison(modes: &[Flown], lines: &[Line]) -> Markup {
    html! {
        section id="comparison" {
            h2 { "Our figures beside the paper's" }
            table.overlay {
                thead {
                    tr {
                        th.text { "" } th { "P4 full" } th { "P4 segmented" }
                        @for mode in modes { th { "ours: " (mode.mode.name()) } }
                        th.text { "P4 says it in" }
                    }
                }
                tbody {
                    @for line in lines {
                        tr {
                            th.text { (line.quantity) }
                            @for which in 0..2 { td { @if is_said(line, which) { b { (line.said(which)) } } @else { "–" } } }
                            @for figure in &line.ours { td { (line.text(figure)) } }
                            td.text { (line.source) }
                        }
                    }
                }
            }
            p.caption {
                "In brackets the 95 % bounds (Wilson) of a share, and the range of all runs of an altitude. Times are those \
                 of this machine's guidance slot over a whole flight, each frame in the quickest of " (nominal::TIMED_FLIGHTS)
                " flights; in mode segmented-table they include learning the air, which the other two do not. The paper's are \
                 of a 2.2 GHz Core 2 Duo. A dash: the paper gives no figure."
            }
        }
    }
}

/// A quantity of the paper's Table 1: its initial and its final value, digits after the point, and ours of a true state.
type Entry = (&'static str, Option<f64>, Option<f64>, usize, fn(&TruthSample) -> f64);

/// Table 1 of the paper.
const TABLE_1: [Entry; 6] = [
    ("longitude, deg", Some(-90.072), Some(-73.260), 3, |s| deg(s.longitude_rad)),
    ("latitude, deg", Some(-43.898), Some(-41.450), 3, |s| deg(s.latitude_rad)),
    ("altitude, km", Some(125.3), Some(7.8), 1, |s| s.altitude_m * 1e-3),
    ("heading from east to north, deg", Some(4.99), None, 2, |s| 90.0 - deg(s.heading_rad)),
    ("speed, m/s", Some(5505.0), None, 0, |s| s.speed_mps),
    ("flight-path angle, deg", Some(-14.15), None, 2, |s| deg(s.flight_path_angle_rad)),
];

/// The undispersed flights at entry and at deployment beside the paper's Table 1.
fn ends(modes: &[Flown]) -> Markup {
    let said = |value: Option<f64>, digits| value.map_or_else(|| "–".to_owned(), |value| number(value, digits));
    let ours = |sample: Option<&TruthSample>, of: fn(&TruthSample) -> f64, digits| said(sample.map(of), digits);
    html! {
        section id="ends" {
            h2 { "Undispersed flights at entry and deployment: Table 1" }
            table.overlay {
                thead {
                    tr {
                        th.text { "" } th { "P4 entry" } th { "ours" } th { "P4 deployment" }
                        @for mode in modes { th { "ours: " (mode.mode.name()) } }
                    }
                }
                tbody {
                    @for (quantity, entry, end, digits, of) in TABLE_1 {
                        tr {
                            th.text { (quantity) }
                            td { b { (said(entry, digits)) } }
                            td { (ours(modes.first().and_then(|m| m.nominal.record.truth.first()), of, digits)) }
                            td { b { (said(end, digits)) } }
                            @for mode in modes { td { (ours(mode.nominal.record.truth.last(), of, digits)) } }
                        }
                    }
                }
            }
        }
    }
}

fn is_said(line: &Line, which: usize) -> bool {
    !matches!(line.published.get(which), None | Some(Said::Nothing(())))
}

fn section(name: &str, figures: &[Markup]) -> Markup {
    html! {
        section { h2 { (name) } div.grid { @for figure in figures { (figure) } } }
    }
}

fn flown(args: &StudyArgs, modes: &[Flown]) -> Markup {
    html! {
        section id="flown" {
            h2 { "What is flown, and how it departs from the print" }
            p { "The scenario with " code { (CONDITIONS.join(", ")) } "." }
            ul { @for correction in CORRECTIONS { li { (correction) } } }
            h2 { "Fly it again" }
            pre {
                "aeroshell study npc --config " (args.config) " --runs " (args.runs) " --seed " (args.seed)
                @for set in &args.common.set { " --set '" (set) "'" } "\n"
                @for mode in modes { (mode.command) "\n" }
            }
            p.caption { "Each mode's folder beside this page is a campaign: report, table of runs, and the worst runs with the commands that fly them again." }
        }
    }
}
