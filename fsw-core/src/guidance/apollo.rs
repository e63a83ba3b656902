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

use crate::math::num::clamp;

use super::tables::{REFERENCE, REFERENCE_COS_BANK, ReferenceRow};

/// Over-control K: errors are taken out several times faster than over the rest of the flight. Apollo and MSL flew 5.
const OVER_CONTROL: f64 = 5.0;

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
    /// Predicted downrange error at the reference bank, m, positive beyond the target, and the cosine of the bank that
    /// takes it out, not limited. Beyond the table its end row holds.
    #[must_use]
    pub fn command(&self) -> (f64, f64) {
        let row = at(self.speed_mps);
        let [_, range, drag, climb, by_drag, by_climb, by_cos_bank] = row;
        let predicted_m = range + by_drag * (self.drag_mps2 - drag) + by_climb * (self.climb_mps - climb);
        let error_m = predicted_m - self.range_to_go_m;
        (error_m, REFERENCE_COS_BANK - OVER_CONTROL * error_m / by_cos_bank)
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
            let (error_m, cos_bank) = on_reference(row).command();
            assert!(error_m.abs() < 1e-6 && (cos_bank - REFERENCE_COS_BANK).abs() < 1e-9);
        }
    }

    #[test]
    fn more_range_to_go_asks_for_more_lift_up_and_more_drag_too() {
        for row in &REFERENCE[1..] {
            let reference = on_reference(row);
            let (_, further) = Terminal { range_to_go_m: reference.range_to_go_m + 1e3, ..reference }.command();
            let (_, denser) = Terminal { drag_mps2: 1.02 * reference.drag_mps2, ..reference }.command();
            assert!(further > REFERENCE_COS_BANK && denser > REFERENCE_COS_BANK, "{row:?}");
        }
    }

    #[test]
    fn beyond_the_table_its_ends_hold() {
        assert_eq!(at(1e4), wide(&REFERENCE[REFERENCE.len() - 1]));
        assert_eq!(at(0.0), wide(&REFERENCE[0]));
    }
}
