//! The page of P3's experiment.

use fsw_study::mmae::TIMED_FLIGHTS;
use fsw_study::mmae::bars::last_model_passes_s;
use fsw_study::mmae::case::CaseResult;
use maud::{Markup, html};

use super::{Study, figures, table};
use crate::campaign::report::document;
use crate::report::{Figure, PlotError};

/// Where the study departs from the print, and why.
const DEPARTURES: [&str; 9] = [
    "eqs. 3 and 8: the rows of the velocities are missing in the text at hand; flown is the complete form, lift up along \
     the part of the position across the velocity in the air (with the other sign the vehicle is on the ground at 110 s).",
    "eq. 12: Q is not given: 0, a setting.",
    "eq. 19: the density lacks (2π)^(m/2) and has |W| for its root; flown is the correct form.",
    "eq. 23 prints a ← −a + …; with eq. 24 it is plus.",
    "after eq. 25: not g but its exponentials leave the range of numbers; flown twice, with the largest taken out before \
     (gating) and as printed (bare-gating), which ends in an error and a name for it.",
    "the normaliser called escape velocity is that of a circular orbit; kept as printed.",
    "Δ ~ N(−0.10, 0.10) with a maximum of 10 %: uniform over ±0.1; a setting.",
    "Table 1 says 3σ (reading A); Table 5 fits a standard deviation (reading B) and readings once or twice a second.",
    "η, rate of the readings and the parachute's condition are not given: settings, in study.toml beside this page.",
];

/// The page.
pub fn html(study: &Study<'_>) -> Result<String, PlotError> {
    let cases = study.cases;
    let mut drawn = vec![figures::weights(&cases.fixed, &study.config.bank.densities)];
    drawn.extend(cases.fixed.iter().map(figures::errors));
    drawn.extend(cases.table5.iter().map(figures::rmse));
    drawn.push(figures::ranking(&cases.ranking, "Filters on the same draws"));
    drawn.push(figures::ranking(&cases.robust, "Density in waves, accelerometer biased"));
    let drawn: Result<Vec<Markup>, PlotError> = drawn.iter().map(Figure::render).collect();
    let body = html! {
        header {
            p.kicker { "Aeroshell study mmae" }
            h1 { "Multiple models against density errors: the experiment of P3" }
            p.run {
                "Deng, Gao, Cui 2017, doi 10.15982/j.issn.2095-7777.2017.06.006 · " b { (study.head.runs) } " runs of seed "
                b { (study.head.seed) } " a case"
            }
            p.verdict.open { (verdict(study)) }
        }
        (asked(study))
        @for case in cases.all() { (section(case)) }
        p.caption {
            "RMSE at the parachute's opening, over the runs in which the filter came there. Bound: posterior Cramér–Rao \
             bound with the density unknown, and known, averaged over the same draws. NEES: 6 is right. Indef.: share of \
             instants with an indefinite covariance. Diverged: farther than " (study.config.flight.divergence_m)
             " m at the end, or stopped by an error. EKFs: time of a step on this machine over that of one EKF, the \
             fastest of " (TIMED_FLIGHTS) " flights of one thread; a filter that failed has none. " (table::M7)
        }
        section { h2 { "Plots" } div.grid { @for figure in &drawn? { (figure) } } }
        section id="departures" {
            h2 { "How it departs from the print" }
            ul { @for departure in DEPARTURES { li { (departure) } } }
            h2 { "Fly it again" }
            pre { (study.head.command) "\n" }
        }
    };
    Ok(document("Aeroshell study mmae: the experiment of P3", &body))
}

fn verdict(study: &Study<'_>) -> String {
    let met = study.bars.iter().filter(|bar| bar.is_met).count();
    let sentence = |case: &CaseResult| {
        let position = |label: &str| table::figure(case.filter(label).map_or(f64::NAN, |f| f.rmse.position_m), 0);
        let gating = case.best_gating().map_or_else(|| "–".to_owned(), |f| table::figure(f.rmse.position_m, 0));
        let bound = table::figure(case.bound.map_or(f64::NAN, |bound| bound.unknown_density.position_m), 0);
        format!(
            "scenario {}: {} m with the density estimated, {gating} m with the paper's gating at its best rate, bound {bound} m",
            case.scenario,
            position("augmented")
        )
    };
    let sentences: Vec<String> = study.cases.ranking.iter().map(sentence).collect();
    let passed = study.cases.fixed.last().and_then(|case| last_model_passes_s(case, 0.9));
    let passed = passed.map_or_else(String::new, |s| {
        format!(" The right model is found after {} s (P3: about 50 s).", table::figure(s, 0))
    });
    format!(
        "Position at the end, {}.{passed} {met} of {} figures are where they are asked to be.",
        sentences.join("; "),
        study.bars.len()
    )
}

fn asked(study: &Study<'_>) -> Markup {
    html! {
        section id="bars" {
            h2 { "What is asked of the figures" }
            table.overlay {
                thead { tr { th.text { "" } th { "ours" } th { "asked" } th { "" } } }
                tbody {
                    @for bar in study.bars {
                        tr {
                            th.text { (bar.what) }
                            td { b { (table::bar_value(bar)) } }
                            td { (table::bar_limits(bar)) }
                            td { @if bar.is_met { "met" } @else if bar.value.is_none() { "not flown" } @else { b { "missed" } } }
                        }
                    }
                }
            }
            p.caption {
                "One root mean square over " (study.head.runs) " runs is uncertain by up to " (table::uncertainty_pct(study.head.runs))
                " % (1 σ); figures of few runs say little about what is asked for 1000. " (table::ATTAINED)
            }
        }
    }
}

fn section(case: &CaseResult) -> Markup {
    let rows = table::rows(case);
    let (head, body) = rows.split_at(1);
    html! {
        section id={ (case.name) "-" (case.scenario) } {
            h2 { (table::title(case)) }
            table.overlay {
                thead { @for row in head { tr { (cells(row)) } } }
                tbody { @for row in body { tr { (cells(row)) } } }
            }
            @for failure in table::failures(case) { p.caption { (failure) } }
        }
    }
}

fn cells(row: &table::Row) -> Markup {
    html! { @for (at, cell) in row.iter().enumerate() { @if at == 0 { th.text { (cell) } } @else { td { (cell) } } } }
}
