//! Guidance: what it predicts, how hard it works, how far it is from a reversal, what margins it sees.

use fsw_core::link::packet::{CycleOutcome, GuidanceTlm};

use super::{KILO, Story};
use crate::report::palette::Ink;
use crate::report::plot::{Axis, Figure, Mark, Panel, Point};

/// Prediction and work; heading offset and margins.
#[must_use]
pub fn figures(story: &Story<'_>) -> Vec<Figure> {
    vec![prediction(story), lateral(story)]
}

/// One quantity of the guidance telemetry at the time its command acts.
fn series(story: &Story<'_>, quantity: impl Fn(&GuidanceTlm) -> f64) -> Vec<Point> {
    story.record.guidance.iter().map(|(_, g)| (g.effective.as_s(), quantity(g))).collect()
}

/// Cycles that really predicted.
const fn predicted(g: &GuidanceTlm) -> bool {
    g.predictions > 0
}

fn prediction(story: &Story<'_>) -> Figure {
    let missing = "No guidance cycle ran in this flight.";
    let miss = |wanted: &dyn Fn(&GuidanceTlm) -> bool| {
        series(story, |g| if predicted(g) && wanted(g) { magnitude(g.predicted_downrange_error_m) } else { f64::NAN })
    };
    let settled = |g: &GuidanceTlm| g.outcome == CycleOutcome::Converged;
    let work = |value: &dyn Fn(&GuidanceTlm) -> f64| series(story, value);
    let bound = f64::from(story.record.summary.corrector.bound);
    let evaluations = Axis::fit("evaluations").including(0.0);
    Figure {
        title: "Guidance cycles",
        caption: "Predicted downrange miss with the bank chosen, and the work of each cycle.".into(),
        legend: vec![
            (Mark::Dot, Ink::Blue, "converged".into()),
            (Mark::Dot, Ink::Vermillion, "best so far, or out of reach".into()),
            (Mark::Dot, Ink::Sky, "predictions".into()),
            (Mark::Dot, Ink::Purple, "corrector iterations".into()),
        ],
        panels: vec![
            Panel::new(story.time_axis().silent(), Axis::fit("|miss|, m").decades().including(0.0).including(3.0), 160)
                .instants(story.modes().iter().map(|m| m.0), Ink::Muted)
                .dots(miss(&|g| settled(g)), Ink::Blue, 2.2)
                .dots(miss(&|g| !settled(g)), Ink::Vermillion, 2.6),
            Panel::new(story.time_axis().silent(), Axis::fit("count").including(0.0).including(4.0).every(1.0), 120)
                .dots(work(&|g| f64::from(g.predictions)), Ink::Sky, 2.6)
                .dots(work(&|g| f64::from(g.iterations)), Ink::Purple, 1.6),
            Panel::new(
                story.time_axis(),
                if bound > 0.0 { evaluations.including(1.1 * bound) } else { evaluations },
                170,
            )
            .level(bound, Ink::Vermillion, if bound > 0.0 { format!("bound {bound}") } else { String::new() })
            .dots(work(&|g| f64::from(g.evaluations)), Ink::Blue, 2.2),
        ],
        missing,
    }
}

/// Decimal logarithm of a distance, at least a tenth of a metre.
fn magnitude(miss_m: f64) -> f64 {
    if miss_m.is_finite() { miss_m.abs().max(0.1).log10() } else { f64::NAN }
}

fn lateral(story: &Story<'_>) -> Figure {
    let threshold: Vec<_> = story
        .record
        .guidance
        .iter()
        .filter(|(_, g)| g.heading_threshold_m > 0.0)
        .map(|(_, g)| (g.effective.as_s(), -g.heading_threshold_m * KILO, g.heading_threshold_m * KILO))
        .collect();
    let margin = |i: usize| series(story, |g| if predicted(g) { 100.0 * f64::from(g.margins[i]) } else { f64::NAN });
    Figure {
        title: "Lateral logic and margins",
        caption: "Heading offset, positive when the target lies to the right: a reversal is due when it leaves the \
                  threshold. Below, how far the predicted peaks stay under their limits."
            .into(),
        legend: vec![
            (Mark::Line, Ink::Blue, "heading offset".into()),
            (Mark::Band, Ink::Green, "threshold".into()),
            (Mark::Instant, Ink::Purple, "reversal".into()),
            (Mark::Line, Ink::Orange, "load".into()),
            (Mark::Line, Ink::Vermillion, "heat flux".into()),
            (Mark::Line, Ink::Sky, "dynamic pressure".into()),
        ],
        panels: vec![
            Panel::new(story.time_axis().silent(), Axis::fit("offset, km").symmetric(), 250)
                .band(threshold, Ink::Green)
                .instants(story.reversals(), Ink::Purple)
                .line(series(story, |g| g.heading_offset_m * KILO), Ink::Blue),
            Panel::new(story.time_axis(), Axis::fit("margin, %").including(0.0).including(100.0), 200)
                .line(margin(0), Ink::Orange)
                .line(margin(1), Ink::Vermillion)
                .line(margin(2), Ink::Sky),
        ],
        missing: "No guidance cycle ran in this flight.",
    }
}
