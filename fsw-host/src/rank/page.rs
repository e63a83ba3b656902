//! The page of a ranking.

use maud::{Markup, html};

use super::RankArgs;
use super::table::{Over, Placed, Ranking};
use crate::campaign::report::document;
use crate::report::{Axis, Figure, Ink, Mark, Panel, PlotError, Point, number};

/// Filters that are drawn, where they fly, and their colours; all of them would be no picture.
const DRAWN: [(&str, Ink); 6] = [
    ("ekf", Ink::Blue),
    ("augmented", Ink::Green),
    ("schmidt", Ink::Sky),
    ("rddf2-lite", Ink::Orange),
    ("mmae-bayes", Ink::Purple),
    ("dead-reckoning", Ink::Vermillion),
];
/// Smaller errors are drawn as this one.
const LEAST: f64 = 1e-2;

/// The page.
pub(super) fn page(args: &RankArgs, rankings: &[Ranking]) -> Result<String, PlotError> {
    let sections = rankings.iter().map(|ranking| section(args, ranking)).collect::<Result<Vec<_>, _>>()?;
    let body = html! {
        header {
            p.kicker { "Aeroshell ranking" }
            h1 { (args.scenario) ": navigation filters on the same bytes" }
            p { (args.runs) " dispersed entries of seed " (args.seed) ". Each was flown once and its link recorded; every filter then read the same bytes." }
        }
        @for section in &sections { (section) }
    };
    Ok(document("Aeroshell ranking", &body))
}

fn section(args: &RankArgs, ranking: &Ranking) -> Result<Markup, PlotError> {
    let figure = errors(args, ranking).render()?;
    Ok(html! {
        section {
            h2 { "Case " (ranking.case) }
            div.wide { (figure) }
            (table(ranking))
            @if let Some(told) = ranking.standing() { p { (told) } }
            p { (ranking.failures()) }
            p { "M7: thousands of instructions (not cycles) on the reference computer, over whole hard flights: navigation in a second on average, and the worst minor frame with guidance and link in it." }
        }
    })
}

/// The table of the screen, with what each filter is.
fn table(ranking: &Ranking) -> Markup {
    let of = |value: Option<f64>, digits: usize| value.map_or_else(|| "–".to_owned(), |v| number(v, digits));
    let bound = &ranking.bound;
    html! {
        table {
            thead {
                tr {
                    th.text { "filter" }
                    th { "at deployment, m" } th { "m/s" } th { "over bound" } th { "m/s" }
                    th { "over flight, m" } th { "m/s" }
                    th { "NEES" } th { "in 95 %" } th { "given up" } th { "miss, 50 %, m" } th { "90 %" } th { "opened" }
                    th { "M7, k/s" } th { "k/frame" }
                }
            }
            tbody {
                tr {
                    th.text style="white-space: nowrap" { "Cramér–Rao bound" }
                    td { (number(bound.deploy[0], 1)) } td { (number(bound.deploy[1], 3)) } td { "1" } td { "1" }
                    td { (number(bound.flight[0], 1)) } td { (number(bound.flight[1], 3)) }
                    @for _ in 0..8 { td {} }
                }
                @for p in &ranking.filters {
                    tr {
                        th.text title=(p.title) style="white-space: nowrap" { (p.filter) }
                        td { (number(p.deploy[0], 1)) } td { (number(p.deploy[1], 3)) }
                        td { (number(p.over_bound[0], 2)) } td { (number(p.over_bound[1], 2)) }
                        td { (number(p.flight[0], 1)) } td { (number(p.flight[1], 3)) }
                        td { (of(p.nees, 2)) } td { (of(p.nees_inside_pct, 1)) }
                        td { (p.given_up) }
                        td { (of(p.miss_m.map(|m| m[0]), 0)) } td { (of(p.miss_m.map(|m| m[1]), 0)) }
                        td { @if let Some(opened) = p.opened { (opened) "/" (p.flights) } @else { "–" } }
                        td { (of(p.on_target.map(|cost| f64::from(cost.navigation_per_second) * 1e-3), 0)) }
                        td { (of(p.on_target.map(|cost| f64::from(cost.worst_frame) * 1e-3), 1)) }
                    }
                }
            }
        }
    }
}

fn errors(args: &RankArgs, ranking: &Ranking) -> Figure {
    let drawn: Vec<(&Placed, Ink)> = DRAWN
        .iter()
        .filter_map(|(name, ink)| Some((ranking.filters.iter().find(|placed| placed.filter == *name)?, *ink)))
        .collect();
    let line = |over: &[Over], which: usize| -> Vec<Point> {
        over.iter().map(|point| (point.time_s, point.rmse[which].max(LEAST).log10())).collect()
    };
    let panel = |which: usize, time: Axis, name: &str, height| {
        let bound =
            Panel::new(time, Axis::fit(name).decades(), height).line(line(&ranking.bound.over_time, which), Ink::Text);
        drawn.iter().fold(bound, |panel, (placed, ink)| panel.line(line(&placed.over_time, which), *ink))
    };
    let legend = drawn.iter().map(|(placed, ink)| (Mark::Line, *ink, placed.filter.to_owned()));
    Figure {
        title: "Errors over the flight",
        caption: format!(
            "Root mean square over {} entries of the errors in position and velocity, on logarithmic axes, until half of the \
             parachutes have opened. The bound is the least that any filter can reach which integrates the inertial unit and knows \
             the statistics of its errors.",
            args.runs
        ),
        legend: std::iter::once((Mark::Line, Ink::Text, "Cramér–Rao bound".to_owned())).chain(legend).collect(),
        panels: vec![
            panel(0, Axis::fit("").silent(), "position, m", 300),
            panel(1, Axis::fit("time, s"), "velocity, m/s", 300),
        ],
        missing: "Nothing was flown.",
    }
}
