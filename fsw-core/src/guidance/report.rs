//! What guidance reports once a second.

use super::course::Course;
use super::cycle::{Cycle, CycleResult};
use super::{Guidance, GuidanceInput};
use crate::link::packet::{CycleOutcome, GuidanceTlm};
use crate::math::num::clamp;

impl Guidance {
    /// The report of an ended cycle; `Held` when it found nothing.
    #[inline(never)]
    pub(super) fn report(
        &self,
        cycle: Option<&Cycle>,
        result: Option<&CycleResult>,
        course: &Course,
        input: &GuidanceInput<'_>,
    ) -> GuidanceTlm {
        let count = |n: usize| u8::try_from(n).unwrap_or(u8::MAX);
        let common = GuidanceTlm {
            iterations: cycle.map_or(0, |cycle| count(cycle.iterations())),
            predictions: cycle.map_or(0, |cycle| count(cycle.predictions())),
            evaluations: cycle.map_or(0, Cycle::evaluations),
            ..self.where_we_are(course, input)
        };
        let Some(result) = result else { return GuidanceTlm { outcome: CycleOutcome::Held, ..common } };
        GuidanceTlm {
            predicted_downrange_error_m: result.error_m,
            outcome: result.outcome,
            margins: result.peaks.margins(input.context.constraints).map(single),
            ..common
        }
    }

    /// The part of a report that needs no prediction.
    #[inline(never)]
    pub(super) fn where_we_are(&self, course: &Course, input: &GuidanceInput<'_>) -> GuidanceTlm {
        let (target_p, radius_m) = (self.aim.target_p, input.context.model.planet.radius_m);
        GuidanceTlm {
            range_to_go_m: course.range_m(&target_p, radius_m),
            heading_offset_m: course.heading_offset_m(&target_p, radius_m),
            heading_threshold_m: self.threshold_m(course, self.command_rad, input),
            ..self.held(input)
        }
    }

    /// A report that says only which command is held.
    pub(super) fn held(&self, input: &GuidanceInput<'_>) -> GuidanceTlm {
        GuidanceTlm {
            cycle: self.cycles,
            effective: input.now,
            bank_rad: self.command_rad,
            outcome: CycleOutcome::Held,
            reversals: self.reversals,
            ..GuidanceTlm::default()
        }
    }
}

/// A margin for the report, brought into a range that single precision holds.
#[allow(clippy::cast_possible_truncation)] // bounded just before
fn single(margin: f64) -> f32 {
    clamp(margin, -1e6, 1.0) as f32
}
