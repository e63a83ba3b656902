//! Whether the target can still be reached: a verdict that takes time to be given and time to be taken back.
//!
//! Two signs that it cannot, both from the best prediction of a cycle:
//!
//! * downrange: the bank is at a limit, its own or one of load, heat or pressure, and the path still ends short or long;
//! * lateral, in mode `aeroshell`: the rehearsed path ends beside the target, which still lies on the side that was banked to
//!   all the way.
//!
//! A miss of less than a kilometre may still be won or lost by the air. One cycle proves nothing: an estimate settles, air
//! is learned, a reversal falls due. So the signs must stand for three cycles, and the verdict stands until they have been
//! gone for as many.

use crate::link::packet::CycleOutcome;
use crate::math::num::{abs, max};

use super::cycle::CycleResult;

/// A predicted miss that is beyond the reach of guidance, m.
const BEYOND_M: f64 = 1000.0;
/// One that is within reach again, m.
const WITHIN_M: f64 = 500.0;
/// Cycles in a row, nearly, that it takes to give the verdict or to take it back.
const CYCLES: u8 = 3;

/// How the verdict has just changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// Out of reach, with the predicted miss, m: downrange, positive beyond the target, or to the side, positive,
    /// whichever is worse.
    Unreachable(f64),
    /// In reach again.
    Reachable,
}

/// The verdict and the doubts about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reach {
    /// Cycles that spoke against reaching the target, less those that spoke for it.
    doubts: u8,
    lost: bool,
}

impl Reach {
    /// The target is taken to be in reach.
    pub const NEW: Self = Self { doubts: 0, lost: false };

    /// Takes note of a cycle; the verdict, when this cycle has changed it.
    pub fn judge(&mut self, result: &CycleResult) -> Option<Verdict> {
        let at_a_limit = matches!(result.outcome, CycleOutcome::Short | CycleOutcome::Long | CycleOutcome::Constrained);
        let along_m = if at_a_limit { result.error_m } else { 0.0 };
        let aside_m = max(result.aside_m, 0.0);
        let miss_m = max(abs(along_m), aside_m);
        if miss_m > BEYOND_M {
            self.doubts = self.doubts.saturating_add(1).min(CYCLES);
        } else if miss_m < WITHIN_M {
            self.doubts = self.doubts.saturating_sub(1);
        }
        let before = self.lost;
        self.lost = self.doubts == CYCLES || (before && self.doubts > 0);
        match (before, self.lost) {
            (false, true) => Some(Verdict::Unreachable(if aside_m > abs(along_m) { aside_m } else { along_m })),
            (true, false) => Some(Verdict::Reachable),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guidance::constraints::Peaks;

    fn result(outcome: CycleOutcome, error_m: f64, aside_m: f64) -> CycleResult {
        CycleResult { bank_rad: 1.0, error_m, aside_m, peaks: Peaks::default(), outcome }
    }

    /// Which of a row of equal cycles gives a verdict, counted from one, and what it says.
    fn verdict(result: &CycleResult) -> Option<(u8, Verdict)> {
        let mut reach = Reach::NEW;
        (1..100).find_map(|cycle| Some((cycle, reach.judge(result)?)))
    }

    #[test]
    fn a_miss_at_a_bank_limit_that_stays_is_named_once_with_its_sign() {
        assert_eq!(verdict(&result(CycleOutcome::Short, -5e3, 0.0)), Some((CYCLES, Verdict::Unreachable(-5e3))));
        assert_eq!(verdict(&result(CycleOutcome::Long, 5e3, 0.0)), Some((CYCLES, Verdict::Unreachable(5e3))));
        let mut reach = Reach::NEW;
        let named = (0..100).filter(|_| reach.judge(&result(CycleOutcome::Long, 5e3, 0.0)).is_some());
        assert_eq!(named.count(), 1);
    }

    #[test]
    fn a_target_that_stays_on_the_side_banked_to_is_named_and_one_crossed_is_not() {
        assert_eq!(verdict(&result(CycleOutcome::Converged, 20.0, 40e3)), Some((CYCLES, Verdict::Unreachable(40e3))));
        assert_eq!(verdict(&result(CycleOutcome::Converged, 20.0, -40e3)), None);
    }

    #[test]
    fn a_search_that_has_not_converged_and_a_small_miss_are_not_out_of_reach() {
        assert_eq!(verdict(&result(CycleOutcome::BestSoFar, -9e3, 0.0)), None);
        assert_eq!(verdict(&result(CycleOutcome::Short, -0.9e3, 0.0)), None);
        assert_eq!(verdict(&result(CycleOutcome::Short, f64::NAN, f64::NAN)), None);
    }

    /// The last change that a row of equal cycles makes.
    fn after(reach: &mut Reach, cycles: u8, result: &CycleResult) -> Option<Verdict> {
        (0..cycles).filter_map(|_| reach.judge(result)).last()
    }

    #[test]
    fn the_verdict_does_not_chatter() {
        let (far, near) = (result(CycleOutcome::Short, -5e3, 0.0), result(CycleOutcome::Converged, 50.0, 0.0));
        let between = result(CycleOutcome::Short, -700.0, 0.0);
        let mut reach = Reach::NEW;
        // Every other cycle: never.
        assert!((0..50).all(|_| reach.judge(&far).is_none() && reach.judge(&near).is_none()));
        assert_eq!(after(&mut reach, CYCLES, &far), Some(Verdict::Unreachable(-5e3)));
        assert_eq!(after(&mut reach, 50, &between), None, "between the two thresholds the verdict stands");
        assert_eq!(after(&mut reach, CYCLES - 1, &near), None);
        assert_eq!(after(&mut reach, 1, &near), Some(Verdict::Reachable));
        assert_eq!(after(&mut reach, 50, &near), None);
    }
}
