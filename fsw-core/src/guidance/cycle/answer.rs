//! What a cycle answers: the best of its predictions, put right by the slope, or the gentler bank that a limit asks for.

use super::{Cycle, CycleContext, CycleResult, Flown};
use crate::guidance::corrector::{Sample, bank_of};
use crate::link::packet::CycleOutcome;
use crate::link::parameters::ConstraintParameters;
use crate::math::num::clamp;

impl Cycle {
    /// The prediction that best answers the search, with its outcome.
    fn best(&self) -> Option<(Flown, CycleOutcome)> {
        let (best, outcome) = self.corrector.best()?;
        let flown = self.flown.iter().find(|f| f.sample == best)?;
        Some((*flown, outcome))
    }

    /// When the best bank would exceed a limit and nothing with more lift up has been flown yet: the most lift allowed.
    pub(super) fn relief_to_try(&self, context: &CycleContext<'_>) -> Option<f64> {
        let (best, _) = self.best()?;
        let exceeds = best.peaks.worst_use(context.constraints) > 1.0;
        let most_lift = self.corrector.most_lift();
        let known = self.flown.iter().any(|f| f.sample.cos_bank > best.sample.cos_bank);
        (exceeds && !known && best.sample.cos_bank < most_lift).then_some(most_lift)
    }

    /// The result so far; `None` when no prediction was completed.
    ///
    /// A bank that would exceed a limit is replaced by the smaller bank at which the limit is met, found on the straight
    /// line (in cos σ) to the gentlest path with more lift up; where no such path is gentler, the limit cannot be helped
    /// by bank and the range solution stands.
    #[must_use]
    #[inline(never)] // once a second
    pub fn result(&self, constraints: &ConstraintParameters) -> Option<CycleResult> {
        let (best, outcome) = self.best()?;
        let unbounded = CycleResult {
            bank_rad: bank_of(self.refined(&best.sample)),
            error_m: best.sample.error_m,
            aside_m: best.aside_m,
            peaks: best.peaks,
            outcome,
        };
        let used = best.peaks.worst_use(constraints);
        if used <= 1.0 {
            return Some(unbounded);
        }
        let gentler = self.flown.iter().filter(|f| f.sample.cos_bank > best.sample.cos_bank);
        let relief =
            gentler.reduce(|a, b| if b.peaks.worst_use(constraints) < a.peaks.worst_use(constraints) { b } else { a });
        let Some(relief) = relief else { return Some(unbounded) };
        let relief_used = relief.peaks.worst_use(constraints);
        if relief_used >= used {
            return Some(unbounded);
        }
        let share = clamp((used - 1.0) / (used - relief_used), 0.0, 1.0);
        Some(CycleResult {
            bank_rad: bank_of(best.sample.cos_bank + share * (relief.sample.cos_bank - best.sample.cos_bank)),
            error_m: best.sample.error_m + share * (relief.sample.error_m - best.sample.error_m),
            aside_m: best.aside_m,
            peaks: if share > 0.5 { relief.peaks } else { best.peaks },
            outcome: CycleOutcome::Constrained,
        })
    }

    /// The cosine of the bank to command: that of the best sample, put right by the slope where one is remembered.
    fn refined(&self, best: &Sample) -> f64 {
        match self.slope_m() {
            Some(slope_m) if self.start.slope_m.is_some() => self.corrector.refined(best, slope_m),
            _ => best.cos_bank,
        }
    }

    /// Slope of the downrange error with the cosine of the bank, m: as this cycle found it, else as remembered.
    #[must_use]
    #[inline(never)]
    pub fn slope_m(&self) -> Option<f64> {
        self.corrector.found_slope_m().filter(|slope| *slope > 0.0).or(self.start.slope_m)
    }
}
