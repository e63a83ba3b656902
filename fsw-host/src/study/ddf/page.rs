//! The page of P2's experiment.

use fsw_study::ddf::reference::middle;
use fsw_study::ddf::{Kind, Outcome};
use maud::{Markup, html};

use super::table::{self, HEADS, NOTES};
use super::{PAPER, Study, figures};
use crate::campaign::report::document;
use crate::report::{Figure, PlotError, number};

/// Where the study departs from the paper, and why.
const DEPARTURES: [&str; 7] = [
    "The paper's equations 20–65 are pictures that its text lost; flown are those that follow from the definitions it names, \
     verified: the gain is Schmidt's consider gain to twelve digits, the sensitivities are the derivatives of the whole filter.",
    "W is no free weight: the closed-form gain is that of Schmidt's filter for parameters of covariance W. W = (0.5, 0.01) \
     means 71 % of density and 10 % of lift, 1 σ; reported and judged is the covariance P + S W Sᵀ.",
    "The factor is updated as that of [Sb − K T1, K Sv, K T2], which holds for any gain; P − K Pyy Kᵀ would not.",
    "Sensitivities by dual numbers through the points make RDDF2 cost less than twice RDDF1, not 20.8 times: no Jacobians, no \
     linear systems.",
    "The threshold 0.0002 has no meaning without the units of the degree of nonlinearity, its points and its map, which the \
     paper does not give; the thresholds here are settings in units that are named.",
    "The free degree of nonlinearity uses the filter's own difference points: P2's adaptation without its 25 evaluations; \
     its filter takes the sensitivities of RDDF1.",
    "The paper leaves open: errors of the parameters, all noises, start. Defaults are in study.toml beside this page.",
];

/// The page.
pub fn html(study: &Study<'_>) -> Result<String, PlotError> {
    let outcomes: Vec<Outcome> = study.filters.iter().map(|filter| filter.outcome.clone()).collect();
    let config = study.config;
    let drawn = [
        figures::errors(config, &outcomes, study.limits),
        figures::nonlinearity(config, &outcomes, Kind::ArddfRank),
        figures::three(config, &outcomes, Kind::ArddfRank),
        figures::nonlinearity(config, &outcomes, Kind::ArddfFree),
        figures::three(config, &outcomes, Kind::ArddfFree),
    ];
    let drawn: Result<Vec<Markup>, PlotError> = drawn.iter().map(Figure::render).collect();
    let truth = &config.truth;
    let body = html! {
        header {
            p.kicker { "Aeroshell study ddf" }
            h1 { "Desensitized divided-difference filters of adaptive order: the experiment of P2" }
            p.run {
                (PAPER) " · " b { (study.head.runs) } " runs of seed " b { (study.head.seed) } " · density "
                b { (number(100.0 * truth.density_error, 0)) } " % and lift " b { (number(100.0 * truth.lift_error, 0)) }
                " % above what the filters believe · step " b { (config.experiment.step_s) } " s"
            }
            p.verdict.open { (verdict(&outcomes)) }
        }
        section id="filters" {
            h2 { "Filters" }
            table.overlay {
                thead { tr { @for (at, head) in HEADS.iter().enumerate() { th.text[at == 0] { (head) } } } }
                tbody {
                    @for row in study.limits.iter().map(table::limit_row).chain(table::rows(study.filters)) {
                        tr {
                            @for (at, cell) in row.iter().enumerate() {
                                @if at == 0 { th.text { (cell) } } @else { td { (cell) } }
                            }
                        }
                    }
                }
            }
            p.caption { (NOTES.join(" ")) }
        }
        section id="bars" {
            h2 { "What is asked for" }
            ul { @for bar in study.bars { li { (table::said(bar)) } } }
        }
        section { h2 { "Plots" } div.grid { @for figure in &drawn? { (figure) } } }
        section id="flown" {
            h2 { "How it departs from the paper" }
            ul { @for departure in DEPARTURES { li { (departure) } } }
            h2 { "Fly it again" }
            pre { (study.head.command) "\n" }
        }
    };
    Ok(document("Aeroshell study ddf: the experiment of P2", &body))
}

/// The study in a sentence.
fn verdict(outcomes: &[Outcome]) -> String {
    let position = |kind| {
        let outcome = middle(outcomes, kind);
        outcome.map_or_else(|| "–".to_owned(), |outcome| number(outcome.position_rmse_m * 1e-3, 1))
    };
    format!(
        "Position: EKF {} km, tuned {} km, RDDF1 {} km, RDDF2 {} km, ARDDF {} km by ranks and {} km from its own points; an \
         EKF that estimates density and lift {} km.",
        position(Kind::Ekf),
        position(Kind::EkfTuned),
        position(Kind::Rddf1),
        position(Kind::Rddf2),
        position(Kind::ArddfRank),
        position(Kind::ArddfFree),
        position(Kind::Ekf8),
    )
}
