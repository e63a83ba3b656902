//! A bank turn in closed form: the shortest turn from any bank and rate to rest on a command, within rate and acceleration.
//!
//! The bank control flies very nearly this; predictions follow it instead of stepping the control law frame by frame.

use crate::link::parameters::ControlParameters;
use crate::math::fun::sqrt;
use crate::math::num::{abs, max, min};

/// A bank angle and its rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BankState {
    /// Bank, rad.
    pub bank_rad: f64,
    /// Its rate, rad/s.
    pub rate_radps: f64,
}

/// A turn: accelerate towards the command, keep the largest rate, brake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    start: BankState,
    command_rad: f64,
    /// Acceleration of the first part, rad/s²; the last part has the opposite one.
    accel_radps2: f64,
    /// Rate between the first part and the last, rad/s.
    cruise_radps: f64,
    /// End of the first part, start of the last, end of the turn, s.
    ends_s: [f64; 3],
}

impl Turn {
    /// The turn from `start` to rest on `command_rad`.
    #[inline(never)] // in turns only
    #[must_use]
    pub fn new(start: BankState, command_rad: f64, control: &ControlParameters) -> Self {
        let (accel, limit) = (control.max_accel_radps2, control.max_rate_radps);
        // Where braking at once would end decides which way the first part goes.
        let rate = start.rate_radps;
        let to_go = command_rad - start.bank_rad;
        let side = if to_go - rate * abs(rate) / (2.0 * accel) < 0.0 { -1.0 } else { 1.0 };
        let (to_go, rate) = (side * to_go, side * rate);
        let peak = sqrt(max(accel * to_go + 0.5 * rate * rate, 0.0));
        let cruise = min(peak, max(limit, rate));
        let rise_s = max((cruise - rate) / accel, 0.0);
        let fall_s = cruise / accel;
        let covered = 0.5 * (rate + cruise) * rise_s + 0.5 * cruise * fall_s;
        let level_s = if cruise > 0.0 { max((to_go - covered) / cruise, 0.0) } else { 0.0 };
        Self {
            start,
            command_rad,
            accel_radps2: side * accel,
            cruise_radps: side * cruise,
            ends_s: [rise_s, rise_s + level_s, rise_s + level_s + fall_s],
        }
    }

    /// Bank and rate `t_s` after the start.
    #[inline(never)] // in turns only
    #[must_use]
    pub fn at(&self, t_s: f64) -> BankState {
        let [rise_s, level_s, end_s] = self.ends_s;
        if t_s >= end_s {
            return BankState { bank_rad: self.command_rad, rate_radps: 0.0 };
        }
        if t_s > level_s {
            let left_s = end_s - t_s;
            let rate_radps = self.accel_radps2 * left_s;
            return BankState { bank_rad: self.command_rad - 0.5 * rate_radps * left_s, rate_radps };
        }
        let (rate, accel) = (self.start.rate_radps, self.accel_radps2);
        let risen_s = min(t_s, rise_s);
        let risen = self.start.bank_rad + (rate + 0.5 * accel * risen_s) * risen_s;
        if t_s <= rise_s {
            return BankState { bank_rad: risen, rate_radps: rate + accel * t_s };
        }
        BankState { bank_rad: risen + self.cruise_radps * (t_s - rise_s), rate_radps: self.cruise_radps }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::units::rad;
    use proptest::prelude::*;

    static CONFIG: Config = Config::DEFAULT;

    #[test]
    fn a_reversal_takes_the_time_of_the_textbook() {
        // Bang-bang at 5°/s²: 90° in 2·√(90/5) = 8.49 s without reaching 20°/s, 120° in 120/20 + 20/5 = 10 s.
        for (from, to, expected_s) in [(45.0, -45.0, 8.485), (-60.0, 60.0, 10.0)] {
            let start = BankState { bank_rad: rad(from), rate_radps: 0.0 };
            let [.., end_s] = Turn::new(start, rad(to), &CONFIG.control).ends_s;
            // 90° in 8.49 s needs 21°/s at its middle: the limit of 20°/s costs a little.
            assert!((end_s - expected_s).abs() < 0.03, "{end_s}");
        }
    }

    proptest! {
        #[test]
        fn every_turn_is_smooth_within_its_limits_and_ends_on_the_command(
            from in -2.5..2.5f64, rate in -0.35..0.35f64, to in -2.5..2.5f64,
        ) {
            let start = BankState { bank_rad: from, rate_radps: rate };
            let turn = Turn::new(start, to, &CONFIG.control);
            prop_assert_eq!(turn.at(0.0).bank_rad, from);
            prop_assert_eq!(turn.at(1e3), BankState { bank_rad: to, rate_radps: 0.0 });
            let dt_s = 0.01;
            let mut before = start;
            for k in 1..3000 {
                let now = turn.at(f64::from(k) * dt_s);
                prop_assert!(now.rate_radps.abs() <= CONFIG.control.max_rate_radps + 1e-9);
                prop_assert!((now.rate_radps - before.rate_radps).abs() <= CONFIG.control.max_accel_radps2 * dt_s + 1e-9);
                let mean = 0.5 * (now.rate_radps + before.rate_radps);
                // A corner of the rate within the step leaves half the acceleration times its square.
                prop_assert!((now.bank_rad - before.bank_rad - mean * dt_s).abs() < 2e-5);
                before = now;
            }
        }
    }
}
