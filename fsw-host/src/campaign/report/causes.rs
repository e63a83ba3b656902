//! Which dispersed input explains the miss: rank correlations with it, and the proof that every input was applied.

use hil_sim::scenario::{Dispersion, Scenario};
use maud::{Markup, html};

use super::super::columns::INPUT;
use super::super::statistics::{deviation, mean, spearman};
use super::{CampaignReportError, Material};
use crate::report::number;

/// Inputs that are shown.
const SHOWN: usize = 12;

/// Rank correlation of an input with the parts of the miss.
struct Cause {
    name: String,
    downrange: f64,
    crossrange: f64,
    /// How far the input lies from its middle, against the size of the miss.
    size: f64,
}

impl Cause {
    fn strength(&self) -> f64 {
        self.downrange.abs().max(self.crossrange.abs()).max(self.size.abs())
    }
}

/// The causes, strongest first; inputs that did not vary are left out.
fn causes(material: &Material<'_>) -> Result<Vec<Cause>, CampaignReportError> {
    let runs = material.runs;
    let (down, cross, miss) =
        (runs.numbers("downrange_error_m")?, runs.numbers("crossrange_error_m")?, runs.numbers("miss_m")?);
    let deployed: Vec<usize> = (0..miss.len()).filter(|k| miss[*k].is_finite()).collect();
    let of_deployed = |values: &[f64]| deployed.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let (down, cross, miss) = (of_deployed(&down), of_deployed(&cross), of_deployed(&miss));
    let names: Vec<String> = runs.names(INPUT).map(str::to_owned).collect();
    let mut causes = Vec::new();
    for name in names {
        let values = of_deployed(&runs.numbers(&name)?);
        let middle = mean(&values).unwrap_or(0.0);
        let off: Vec<f64> = values.iter().map(|v| (v - middle).abs()).collect();
        if let (Some(downrange), Some(crossrange), Some(size)) =
            (spearman(&values, &down), spearman(&values, &cross), spearman(&off, &miss))
        {
            causes.push(Cause { name: name.trim_start_matches(INPUT).to_owned(), downrange, crossrange, size });
        }
    }
    causes.sort_by(|a, b| b.strength().total_cmp(&a.strength()).then_with(|| a.name.cmp(&b.name)));
    causes.truncate(SHOWN);
    Ok(causes)
}

/// Rank correlation bars.
pub fn section(material: &Material<'_>) -> Result<Markup, CampaignReportError> {
    let causes = causes(material)?;
    let chance = 1.96 / ((material.summary.completed.max(2) - 1) as f64).sqrt();
    Ok(html! {
        section id="causes" {
            h2 { "What explains the miss" }
            p.caption {
                "Spearman's rank correlation of each input, as read back from the truth, with the signed errors of the "
                "runs; in the last column of its distance from the mean with the size of the miss. The " (causes.len())
                " strongest of " (material.runs.names(INPUT).count()) " inputs are shown. Of inputs that have nothing to do "
                "with the miss, 95 % lie within ±" (number(chance, 2)) " (the grey zone) in so many runs."
            }
            @if causes.is_empty() { p.missing { "Too few runs, or nothing was dispersed." } } @else {
                table.causes {
                    thead { tr { th.text { "input" } th { "downrange error" } th { "crossrange error" } th { "size of the miss" } } }
                    tbody {
                        @for cause in &causes {
                            tr {
                                th.text { (cause.name) }
                                @for value in [cause.downrange, cause.crossrange, cause.size] { td { (bar(value, chance)) } }
                            }
                        }
                    }
                }
            }
        }
    })
}

/// A bar to the left or right of the middle, with its value; grey where it may be chance.
fn bar(value: f64, chance: f64) -> Markup {
    let (left, width) = (if value < 0.0 { 50.0 + 50.0 * value } else { 50.0 }, 50.0 * value.abs());
    let class = if value.abs() < chance { "chance" } else { "real" };
    let zone = format!("left:{:.2}%;width:{:.2}%", 50.0 - 50.0 * chance.min(1.0), 100.0 * chance.min(1.0));
    html! {
        span.axis {
            span.zone style=(zone) {}
            span.(class) style=(format!("left:{left:.2}%;width:{width:.2}%")) {}
        }
        span.figure { (number(value, 2)) }
    }
}

/// What was asked for and what the runs had.
pub fn applied(material: &Material<'_>) -> Result<Markup, CampaignReportError> {
    let mut rows = Vec::new();
    for (name, asked, expected) in requests(material.scenario) {
        let values = material.runs.numbers(&format!("{INPUT}{name}"))?;
        let (mean, deviation) = (mean(&values).unwrap_or(0.0), deviation(&values).unwrap_or(0.0));
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        rows.push((name, asked, expected, [mean, deviation, low, high]));
    }
    Ok(html! {
        section id="inputs" {
            h2 { "Inputs as applied" }
            p.caption {
                "Every dispersed quantity as it was asked for and as the truth of the runs had it: read back from the "
                "entry state, the air, the wind and the vehicle that were flown, not from the draws."
            }
            details {
                summary { "Statistics of " (rows.len()) " inputs" }
                table {
                    thead { tr {
                        th.text { "input" } th.text { "asked for" } th { "σ asked" } th { "mean" } th { "σ" } th { "least" } th { "most" }
                    } }
                    tbody {
                        @for (name, asked, expected, figures) in &rows {
                            tr {
                                th.text { (name) }
                                td.text { (asked) }
                                td { (short(*expected)) }
                                @for figure in figures { td { (short(*figure)) } }
                            }
                        }
                    }
                }
            }
        }
    })
}

/// Name, words and standard deviation of every request.
fn requests(scenario: &Scenario) -> Vec<(&'static str, String, f64)> {
    let of = |(name, dispersion): (&'static str, Dispersion)| match dispersion {
        Dispersion::None => (name, "not dispersed".to_owned(), 0.0),
        Dispersion::Normal { three_sigma } => (name, format!("normal, 3σ = {three_sigma}"), three_sigma / 3.0),
        Dispersion::Uniform { bounds: [low, high] } => {
            (name, format!("uniform, {low} to {high}"), (high - low) / 12f64.sqrt())
        }
    };
    scenario.dispersions.all().into_iter().map(of).collect()
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".into();
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9);
    number(value, digits as usize)
}
