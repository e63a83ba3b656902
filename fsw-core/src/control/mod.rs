//! Bank control: from measured bank and rate to an acceleration that brings the vehicle to the commanded bank.
//!
//! * [`profile`] the rate that brings a bank error to rest in the shortest time.
//! * [`step`] one minor frame of the control law. It holds no state, so guidance can fly it ahead of time too.

pub mod profile;

use crate::link::parameters::ControlParameters;
use crate::math::num::{clamp, wrap_angle};
use crate::time::FRAME;

/// What the actuator is asked for over the coming minor frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BankDemand {
    /// Bank acceleration, rad/s², held for the frame; within the acceleration limit.
    pub accel_radps2: f64,
    /// Bank rate at the end of the frame, rad/s; within the rate limit when the measured rate is.
    pub rate_radps: f64,
}

impl BankDemand {
    /// Nothing asked for.
    pub const NONE: Self = Self { accel_radps2: 0.0, rate_radps: 0.0 };
}

/// One minor frame of bank control: time-optimal turn through lift-up, within the limits, at rest on the command.
///
/// Bank angles are brought to (−π, π]; the turn is the plain difference of the two, never wrapped again, so it passes
/// bank 0 (lift up) and never ±π, even where that way is the longer one.
///
/// A measured rate beyond the limit is braked with the full acceleration. Anything not finite demands nothing.
#[must_use]
pub fn step(bank_rad: f64, bank_rate_radps: f64, command_rad: f64, control: &ControlParameters) -> BankDemand {
    let frame_s = FRAME.as_s();
    let (accel_max, rate_max) = (control.max_accel_radps2, control.max_rate_radps);
    let finite = bank_rad.is_finite() && bank_rate_radps.is_finite() && command_rad.is_finite();
    let usable = finite && accel_max > 0.0 && rate_max > 0.0 && control.lag_s >= 0.0;
    if !usable {
        return BankDemand::default();
    }
    // What is commanded now shows in the bank one frame and one lag later: steer from where the bank will be then.
    let ahead = bank_rate_radps * (frame_s + control.lag_s);
    let error = wrap_angle(command_rad) - (wrap_angle(bank_rad) + ahead);
    let response_s = profile::response_s(control.lag_s);
    let wanted = profile::rate_to_rest(error, response_s, accel_max, rate_max);
    // The wanted rate changes as the error shrinks at the present rate; feed that forward, close the rest in `response_s`.
    let accel = (wanted.rate_radps - bank_rate_radps) / response_s - wanted.slope_ps * bank_rate_radps;
    let rate_end = clamp(bank_rate_radps + clamp(accel, -accel_max, accel_max) * frame_s, -rate_max, rate_max);
    let accel_radps2 = clamp((rate_end - bank_rate_radps) / frame_s, -accel_max, accel_max);
    BankDemand { accel_radps2, rate_radps: bank_rate_radps + accel_radps2 * frame_s }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{deg, rad};
    use core::f64::consts::PI;
    use proptest::prelude::*;

    const DT: f64 = 0.02;

    fn parameters(lag_s: f64) -> ControlParameters {
        ControlParameters { initial_bank_rad: 0.0, max_rate_radps: rad(20.0), max_accel_radps2: rad(5.0), lag_s }
    }

    /// A plant that answers the demanded acceleration with a first-order lag, one frame late if asked.
    struct Plant {
        bank: f64,
        rate: f64,
        accel: f64,
        lag: f64,
        pipe: Option<f64>,
    }

    impl Plant {
        fn advance(&mut self, demand: f64) {
            let input = self.pipe.map_or(demand, |late| {
                self.pipe = Some(demand);
                late
            });
            for _ in 0..4 {
                let h = DT / 4.0;
                let share = if self.lag > 0.0 { 1.0 - (-h / self.lag).exp() } else { 1.0 };
                self.accel += (input - self.accel) * share;
                self.bank += self.rate * h + 0.5 * self.accel * h * h;
                self.rate += self.accel * h;
            }
        }
    }

    struct Turn {
        overshoot_deg: f64,
        settled_s: f64,
        rate_max_deg: f64,
        last_second_accel_deg: f64,
    }

    fn turn(from: f64, to: f64, lag: f64, late: bool) -> Turn {
        let p = parameters(lag);
        let mut plant = Plant { bank: rad(from), rate: 0.0, accel: 0.0, lag, pipe: late.then_some(0.0) };
        let side = if to >= from { 1.0 } else { -1.0 };
        let mut out = Turn { overshoot_deg: 0.0, settled_s: 0.0, rate_max_deg: 0.0, last_second_accel_deg: 0.0 };
        for frame in 0..1500 {
            let demand = step(plant.bank, plant.rate, rad(to), &p);
            assert!(demand.accel_radps2.abs() <= p.max_accel_radps2);
            plant.advance(demand.accel_radps2);
            out.overshoot_deg = out.overshoot_deg.max(side * (deg(plant.bank) - to));
            out.rate_max_deg = out.rate_max_deg.max(deg(plant.rate).abs());
            if (deg(plant.bank) - to).abs() > 0.1 {
                out.settled_s = f64::from(frame + 1) * DT;
            }
            if frame >= 1450 {
                out.last_second_accel_deg = out.last_second_accel_deg.max(deg(demand.accel_radps2).abs());
            }
        }
        out
    }

    #[test]
    fn a_reversal_takes_little_more_than_the_shortest_possible_time() {
        // Bang-bang at 5°/s² over 90° without reaching 20°/s takes 2·√(90/5) = 8.49 s; over 120° with it, 10 s.
        assert!(turn(45.0, -45.0, 0.0, false).settled_s < 8.49 + 0.7);
        assert!(turn(-60.0, 60.0, 0.0, false).settled_s < 10.0 + 0.7);
        assert!(turn(-60.0, 60.0, 0.1, true).settled_s < 10.0 + 3.0);
    }

    #[test]
    fn at_rest_on_the_command_the_demand_dies_out() {
        for (from, to) in [(0.0, 3.0), (45.0, -45.0), (-60.0, 60.0), (10.0, 10.2)] {
            // 30 s after the command only the tail of the exponential approach is left.
            assert!(turn(from, to, 0.1, true).last_second_accel_deg < 1e-3);
        }
    }

    #[test]
    fn the_turn_passes_lift_up_even_where_the_other_way_is_shorter() {
        let demand = step(rad(170.0), 0.0, rad(-170.0), &parameters(0.1));
        assert!(demand.accel_radps2 < 0.0);
        let p = parameters(0.0);
        let mut plant = Plant { bank: rad(170.0), rate: 0.0, accel: 0.0, lag: 0.0, pipe: None };
        let mut passed_lift_up = false;
        for _ in 0..2000 {
            plant.advance(step(plant.bank, plant.rate, rad(-170.0), &p).accel_radps2);
            assert!(plant.bank.abs() < PI);
            passed_lift_up |= plant.bank.abs() < rad(1.0);
        }
        assert!(passed_lift_up && (deg(plant.bank) + 170.0).abs() < 0.1);
    }

    #[test]
    fn what_is_not_a_number_demands_nothing() {
        for (b, r, c) in [(f64::NAN, 0.0, 0.0), (0.0, f64::INFINITY, 0.0), (0.0, 0.0, f64::NAN)] {
            assert_eq!(step(b, r, c, &parameters(0.1)), BankDemand::default());
        }
        let broken = ControlParameters { max_rate_radps: f64::NAN, ..parameters(0.1) };
        assert_eq!(step(0.3, 0.0, 0.0, &broken), BankDemand::default());
    }

    proptest! {
        #[test]
        fn every_turn_settles_without_overshoot_within_its_limits(
            from in -175.0..175.0f64, to in -175.0..175.0f64, lag in 0.0..0.2f64, late in any::<bool>(),
        ) {
            let t = turn(from, to, lag, late);
            prop_assert!(t.overshoot_deg < 0.05, "overshoot {}", t.overshoot_deg);
            // The lag and the late frame let the rate pass its limit by the acceleration not yet taken back.
            prop_assert!(t.rate_max_deg < 20.1, "rate {}", t.rate_max_deg);
            prop_assert!(t.settled_s < 29.0, "settled {}", t.settled_s);
        }

        #[test]
        fn the_demand_respects_the_limits_from_any_state(
            bank in -10.0..10.0f64, rate in -2.0..2.0f64, command in -10.0..10.0f64, lag in 0.0..1.0f64,
        ) {
            let p = parameters(lag);
            let d = step(bank, rate, command, &p);
            prop_assert!(d.accel_radps2.abs() <= p.max_accel_radps2);
            prop_assert!(d.rate_radps.abs() <= p.max_rate_radps * (1.0 + 1e-12) || d.rate_radps.abs() < rate.abs());
        }
    }
}
