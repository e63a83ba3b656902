//! Mode `apollo`: terminal-point guidance derived from that of Apollo, as flown by the Mars Science Laboratory.
//!
//! A reference flight is stored by speed: range still to fly, drag, altitude rate, and how the range depends on each.
//!
//! ```text
//! R_p = R_ref + F₁ (D − D_ref) + F₂ (ḣ − ḣ_ref),      cos σ = cos σ_ref + K (R_togo − R_p) / F₃
//! ```
//!
//! with F₁ = ∂R/∂D, F₂ = ∂R/∂ḣ, F₃ = ∂R/∂cos σ for the rest of the flight. No prediction is flown. The drag is that which
//! is felt, so that air of another density shows at once.

use crate::link::packet::CycleOutcome;
use crate::math::num::{clamp, max};

use super::constraints::Peaks;
use super::corrector::bank_of;
use super::cycle::CycleResult;
use super::tables::{REFERENCE, REFERENCE_COS_BANK, ReferenceRow};

/// Over-control K: errors are taken out several times faster than over the rest of the flight. Apollo and MSL flew 5.
const OVER_CONTROL: f64 = 5.0;
/// Least ∂R/∂cos σ that the law divides by, m: shortly before the trigger bank changes the range no more, and lift-up even
/// shortens the flight by a few metres.
const LEAST_AUTHORITY_M: f64 = 100.0;

/// What the law looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terminal {
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Altitude rate, m/s.
    pub climb_mps: f64,
    /// Sensed drag, m/s².
    pub drag_mps2: f64,
    /// Range to go, m.
    pub range_to_go_m: f64,
}

impl Terminal {
    /// The bank that takes the predicted downrange error out, with what is left of the error when its cosine must lie
    /// between `low` and `high`. Beyond the table its end row holds.
    #[must_use]
    pub fn command(&self, low: f64, high: f64) -> CycleResult {
        let (error_m, cos_bank, by_cos_bank) = self.free_command();
        // Held at the limit for the rest of the flight, without the over-control.
        let left = |limit: f64| error_m + by_cos_bank * (limit - REFERENCE_COS_BANK);
        let (error_m, outcome) = if cos_bank > high && left(high) < 0.0 {
            (left(high), CycleOutcome::Short)
        } else if cos_bank < low && left(low) > 0.0 {
            (left(low), CycleOutcome::Long)
        } else {
            (error_m, CycleOutcome::Converged)
        };
        let bank_rad = bank_of(clamp(cos_bank, low, high));
        CycleResult { bank_rad, error_m, aside_m: 0.0, peaks: Peaks::default(), outcome }
    }

    /// Predicted downrange error at the reference bank, m, positive beyond the target, the cosine of the bank that takes it
    /// out, not limited, and how the range depends on it, m.
    fn free_command(&self) -> (f64, f64, f64) {
        let row = at(self.speed_mps);
        let [_, range, drag, climb, by_drag, by_climb, by_cos_bank] = row;
        let predicted_m = range + by_drag * (self.drag_mps2 - drag) + by_climb * (self.climb_mps - climb);
        let error_m = predicted_m - self.range_to_go_m;
        let by_cos_bank = max(by_cos_bank, LEAST_AUTHORITY_M);
        (error_m, REFERENCE_COS_BANK - OVER_CONTROL * error_m / by_cos_bank, by_cos_bank)
    }
}

/// The reference at a speed, linear between rows.
fn at(speed_mps: f64) -> [f64; 7] {
    let mut between = REFERENCE.first().map_or([0.0; 7], wide);
    for pair in REFERENCE.windows(2) {
        if let [low, high] = pair {
            let (low, high) = (wide(low), wide(high));
            let ([from, ..], [to, ..]) = (low, high);
            if speed_mps > from {
                let share = clamp((speed_mps - from) / (to - from), 0.0, 1.0);
                for ((value, a), b) in between.iter_mut().zip(&low).zip(&high) {
                    *value = a + (b - a) * share;
                }
            }
        }
    }
    between
}

fn wide(row: &ReferenceRow) -> [f64; 7] {
    row.map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// On the reference at a row of it.
    fn on_reference(row: &ReferenceRow) -> Terminal {
        let [speed_mps, range_to_go_m, drag_mps2, climb_mps, ..] = wide(row);
        Terminal { speed_mps, climb_mps, drag_mps2, range_to_go_m }
    }

    #[test]
    fn on_the_reference_its_own_bank_is_commanded() {
        for row in &REFERENCE {
            let (error_m, cos_bank, _) = on_reference(row).free_command();
            assert!(error_m.abs() < 1e-6 && (cos_bank - REFERENCE_COS_BANK).abs() < 1e-9);
        }
    }

    #[test]
    fn more_range_to_go_asks_for_more_lift_up_and_more_drag_too() {
        for row in &REFERENCE[1..] {
            let reference = on_reference(row);
            let (_, further, _) = Terminal { range_to_go_m: reference.range_to_go_m + 1e3, ..reference }.free_command();
            let (_, denser, _) = Terminal { drag_mps2: 1.02 * reference.drag_mps2, ..reference }.free_command();
            assert!(further > REFERENCE_COS_BANK && denser > REFERENCE_COS_BANK, "{row:?}");
        }
    }

    #[test]
    fn where_bank_changes_the_range_no_more_the_sense_of_the_law_stays() {
        let slowest = on_reference(&REFERENCE[0]);
        assert!(REFERENCE[0][6] < LEAST_AUTHORITY_M as f32);
        let (_, further, _) = Terminal { range_to_go_m: slowest.range_to_go_m + 20.0, ..slowest }.free_command();
        assert!((further - REFERENCE_COS_BANK - 1.0).abs() < 1e-3, "{further}");
    }

    #[test]
    fn at_a_limit_what_is_left_of_the_error_is_told() {
        let row = &REFERENCE[REFERENCE.len() / 2];
        let (reference, by_cos_bank) = (on_reference(row), f64::from(row[6]));
        let at = |further_m: f64| {
            Terminal { range_to_go_m: reference.range_to_go_m + further_m, ..reference }.command(-0.6, 0.98)
        };
        // So much further the rest of the flight reaches with the most lift up.
        let reach_m = by_cos_bank * (0.98 - REFERENCE_COS_BANK);
        let (beyond, within) = (at(1.5 * reach_m), at(0.5 * reach_m));
        assert_eq!((beyond.outcome, within.outcome), (CycleOutcome::Short, CycleOutcome::Converged));
        assert!((beyond.error_m + 0.5 * reach_m).abs() < 1.0 && (within.bank_rad.cos() - 0.98).abs() < 1e-9);
        assert_eq!(at(-1.5 * by_cos_bank).outcome, CycleOutcome::Long);
    }

    #[test]
    fn beyond_the_table_its_ends_hold() {
        assert_eq!(at(1e4), wide(&REFERENCE[REFERENCE.len() - 1]));
        assert_eq!(at(0.0), wide(&REFERENCE[0]));
    }
}
