//! The page of P1's experiment.

use fsw_study::sekf::cases::{Flown, Outcome};
use fsw_study::sekf::kind::Kind;
use fsw_study::sekf::tuned::TunedFile;
use maud::{Markup, html};

use super::table::{HEADS, M7, cells, figure, limit_cells};
use super::{Study, figures};
use crate::campaign::report::document;
use crate::report::{Figure, PlotError};

/// Where the study departs from the print, and why.
const DEPARTURES: [&str; 5] = [
    "eq. 19, S₁ = P₁, is not the covariance it stands for; flown is the exact start, in the joint form: the SEKF is a filter \
     with the unknown input as a second half of its state, whose gain is tied to that of the first half. As printed, the first self-calibrated predictions have a covariance that \
     is none.",
    "eq. 12, 14 and 16 lose the covariance's symmetry to rounding step by step, whatever the start; the joint form, kept as a \
     triangular factor, cannot. Rows \"SEKF as printed\" and \"SEKF (12)+(16)\" (the same with the exact start) show it.",
    "eq. 23 prints +D in the rate of the speed; flown is −D as in eq. 20.",
    "The lift terms, which the paper calls a control, are part of the equations of motion; eq. 11 does not change by that.",
    "The paper leaves open: profile α, bank, step, noises, Q. Defaults are in study.toml beside this page.",
];

/// The page.
pub fn html(study: &Study<'_>, tuned: &TunedFile) -> Result<String, PlotError> {
    let config = study.config;
    let flown = |name: &str| study.cases.iter().find(|case| case.case == name);
    let case = |name: &str| flown(name).map_or(&[][..], |case| &case.filters);
    let limits = |name: &str| flown(name).map_or(&[][..], |case| &case.limits);
    let drawn = [
        figures::profile(config),
        figures::single(config, case("untuned")),
        figures::rmse(
            config,
            "Root mean square errors, untuned (P1, Fig. 3)",
            "All runs, logarithmic. The EKF is biased by every piece of the input; the SEKF follows it at the cost of noise. \
             Where the input is nothing, which the EKF takes for granted, it is below the bound of who has to find that out.",
            (case("untuned"), limits("untuned")),
            &[Kind::Ekf, Kind::Sekf],
        ),
        figures::rmse(
            config,
            "Root mean square errors, each filter tuned",
            "The same for filters whose process noise and accelerometer noise were searched, each by the same search.",
            (case("tuned"), limits("tuned")),
            &[Kind::Ekf, Kind::Sekf, Kind::Aekf12],
        ),
        figures::rmse(
            config,
            "Root mean square errors, tuned, wrong parameters",
            "Density, drag area and lift of the filters are 10 % too large (Table 1).",
            (case("tuned-wrong"), limits("tuned-wrong")),
            &[Kind::Ekf, Kind::Sekf, Kind::Aekf17],
        ),
    ];
    let drawn: Result<Vec<Markup>, PlotError> = drawn.iter().map(Figure::render).collect();
    let body = html! {
        header {
            p.kicker { "Aeroshell study sekf" }
            h1 { "Self-calibrating against extended Kalman filter: the experiment of P1" }
            p.run {
                "Fu, Lou, Xiao 2015, doi 10.15982/j.issn.2095-7777.2015.03.006 · " b { (study.head.runs) } " runs of seed "
                b { (study.head.seed) } " a case · step " b { (config.experiment.step_s) } " s"
            }
            p.verdict.open { (verdict(study)) }
        }
        @for case in study.cases { (table(case)) }
        p.caption {
            (study.paper_says) ". EKF/filter: geometric mean over the six states of the ratio of their RMSE, averaged from "
            (config.experiment.average_from_s) " s on; above 1 is better than the EKF of the same case. Reference: an \
            independent implementation in another language at 1 s and 500 runs. NEES: mean over the same time, 6 is right. \
            Indefinite: share of steps whose covariance is. ns: of this machine, one thread, the fastest of some flights. \
            Bounds: posterior Cramér–Rao, for a filter that knows input and bias, and for one that knows of the input when it \
            jumps and its root mean square. A filter that lost its runs has no figure. Rows of the equations as printed are there to teach, not shipped. " (M7)
        }
        section { h2 { "Plots" } div.grid { @for figure in &drawn? { (figure) } } }
        (settings(study, tuned))
    };
    Ok(document("Aeroshell study sekf: the experiment of P1", &body))
}

fn verdict(study: &Study<'_>) -> String {
    let ratio = |case: &str, kind: Kind| {
        let case = study.cases.iter().find(|flown| flown.case == case);
        let outcome = case.and_then(|case| case.filters.iter().find(|outcome| outcome.filter == kind));
        figure(outcome.map_or(f64::NAN, |outcome| outcome.ratio_to_ekf), 2)
    };
    format!(
        "Against an EKF that ignores the input the SEKF is {} times better, {} and {} at a tenth and a hundredth of the \
         noise. Against a tuned EKF it is {} (below 1 is worse), while a tuned filter that estimates the input is {}, and \
         {} with wrong parameters once it estimates those too.",
        ratio("untuned", Kind::Sekf),
        ratio("untuned-0.1", Kind::Sekf),
        ratio("untuned-0.01", Kind::Sekf),
        ratio("tuned", Kind::Sekf),
        ratio("tuned", Kind::Aekf12),
        ratio("tuned-wrong", Kind::Aekf17),
    )
}

fn table(case: &Flown) -> Markup {
    html! {
        section id=(case.case) {
            h2 { (case.title) }
            table.overlay {
                thead { tr { @for (at, head) in HEADS.iter().enumerate() { th.text[at == 0] { (head) } } th { "pull-in m" } } }
                tbody {
                    @for outcome in &case.filters {
                        tr {
                            @for (at, cell) in cells(case, outcome).iter().enumerate() {
                                @if at == 0 { th.text { (cell) } } @else { td { (cell) } }
                            }
                            td { (figure(if outcome.failed > 0 { f64::NAN } else { outcome.pull_in_peak_m }, 0)) }
                        }
                    }
                    @for limit in &case.limits {
                        tr {
                            @for (at, cell) in limit_cells(limit).iter().enumerate() {
                                @if at == 0 { th.text { (cell) } } @else { td { (cell) } }
                            }
                            td {}
                        }
                    }
                }
            }
            details {
                summary { "Errors of each state" }
                (states(case))
            }
        }
    }
}

fn states(case: &Flown) -> Markup {
    let filters = case.filters.iter().map(|outcome: &Outcome| (outcome.filter.name(), &outcome.rmse));
    let limits = case.limits.iter().map(|limit| (limit.knowledge.name(), &limit.rmse));
    html! {
        table.overlay {
            thead { tr { th.text { "RMSE" } @for (name, _) in figures::AXES { th { (name) } } } }
            tbody {
                @for (name, rmse) in filters.chain(limits) {
                    tr {
                        th.text { (name) }
                        @for state in 0..rmse.len() {
                            td { (figure(figures::value(rmse, state), if state < 2 { 2 } else { 5 })) }
                        }
                    }
                }
            }
        }
    }
}

/// A setting that may be next to nothing.
fn small(value: f64) -> String {
    if value > 0.0 && value < 1e-3 { format!("{value:e}") } else { value.to_string() }
}

fn settings(study: &Study<'_>, tuned: &TunedFile) -> Markup {
    html! {
        section id="settings" {
            h2 { "Settings that the search found" }
            table.overlay {
                thead { tr { th.text { "case" } th.text { "filter" } th { "process" } th { "accelerometer" } th { "input" } } }
                tbody {
                    @for line in &tuned.tuned {
                        tr {
                            th.text { (line.case) } th.text { (line.filter.name()) }
                            td { (line.settings.process) } td { (line.settings.accelerometer) }
                            td { @if line.filter.has_input_setting() { (small(line.settings.input)) } @else { "–" } }
                        }
                    }
                }
            }
            p.caption {
                "Process: added process noise in amplitudes of the input over √s. Accelerometer: factor on the assumed \
                 deviation. Input: walk of the estimated input in amplitudes over √s, deviation of the considered one, ρ. \
                 Every filter had the same search, a grid and from its best point on by ever smaller factors, on other runs, for a step of " (tuned.step_s) " s."
            }
            h2 { "How it departs from the print" }
            ul { @for departure in DEPARTURES { li { (departure) } } }
            h2 { "Fly it again" }
            pre { (study.head.command) "\n" (tuned.command) "\n" }
        }
    }
}
