//! Bank actuator: thrusters that follow a commanded acceleration, held over a frame, with a first-order lag and limits.
//!
//! The command c, limited to ±a_max, is followed with a lag τ: a' = (c − a)/τ, p' = a, σ' = p; all in closed form. At
//! ±p_max, reached from inside, the rate is held and a is zero for the rest of the frame. The rate that travels with the
//! command is for actuators that close a rate loop of their own; this one has none, so an error of the navigator's bank
//! rate never turns into a wrong torque.

use libm::{expm1, log};

/// What the actuator can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Largest bank rate, rad/s.
    pub max_rate_radps: f64,
    /// Largest bank acceleration, rad/s².
    pub max_accel_radps2: f64,
    /// Time constant of the acceleration, s; 0 is immediate.
    pub lag_s: f64,
}

/// Bank angle and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bank {
    /// Bank about the air-relative velocity, rad; not wrapped.
    pub angle_rad: f64,
    /// Bank rate, rad/s.
    pub rate_radps: f64,
    /// Bank acceleration, rad/s².
    pub accel_radps2: f64,
}

/// Motion of the bank over one frame: driven by the command, then held at the rate limit if that was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BankMotion {
    driven: Phase,
    held: Option<Phase>,
}

/// Motion under one constant command.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Phase {
    begin_s: f64,
    start: Bank,
    command_radps2: f64,
    lag_s: f64,
}

/// Steps of the bisection for an instant of cut-off: below 1e-16 s for any frame.
const BISECTIONS: usize = 60;

impl BankMotion {
    /// Motion over a frame of `frame_s` from `start` under a commanded acceleration; one that is not finite counts as zero.
    #[must_use]
    pub fn new(start: Bank, accel_radps2: f64, limits: &Limits, frame_s: f64) -> Self {
        let limit = limits.max_accel_radps2;
        let command_radps2 = if accel_radps2.is_finite() { accel_radps2.clamp(-limit, limit) } else { 0.0 };
        let driven = Phase { begin_s: 0.0, start, command_radps2, lag_s: limits.lag_s.max(0.0) };
        let top = limits.max_rate_radps;
        let held = [1.0, -1.0].into_iter().find_map(|side| {
            let begin_s = driven.exceeds(side, top, frame_s)?;
            let start = Bank { rate_radps: side * top, accel_radps2: 0.0, ..driven.at(begin_s) };
            Some(Phase { begin_s, start, command_radps2: 0.0, ..driven })
        });
        Self { driven, held }
    }

    /// Bank `t_s` after the start of the frame.
    #[must_use]
    pub fn at(&self, t_s: f64) -> Bank {
        self.held.filter(|held| held.begin_s <= t_s).unwrap_or(self.driven).at(t_s)
    }
}

impl Phase {
    /// Bank at a time of the frame.
    fn at(&self, t_s: f64) -> Bank {
        let t = t_s - self.begin_s;
        let Bank { angle_rad, rate_radps, accel_radps2 } = self.start;
        let c = self.command_radps2;
        if self.lag_s <= 0.0 {
            let angle_rad = angle_rad + t * (rate_radps + 0.5 * c * t);
            return Bank { angle_rad, rate_radps: rate_radps + c * t, accel_radps2: c };
        }
        let (tau, excess, x) = (self.lag_s, accel_radps2 - c, t / self.lag_s);
        let rise = -expm1(-x);
        Bank {
            angle_rad: angle_rad + t * (rate_radps + 0.5 * c * t) + excess * tau * tau * (x - rise),
            rate_radps: rate_radps + c * t + excess * tau * rise,
            accel_radps2: c + excess * (1.0 - rise),
        }
    }

    /// First instant up to `end_s` at which the rate leaves the limit on one side from inside; now, when it is there and
    /// the acceleration leads on. A vehicle that starts beyond the limit may slow down through it.
    fn exceeds(&self, side: f64, top_radps: f64, end_s: f64) -> Option<f64> {
        let inside = top_radps - side * self.start.rate_radps;
        let tendency = if self.lag_s > 0.0 && self.start.accel_radps2 != 0.0 {
            self.start.accel_radps2
        } else {
            self.command_radps2
        };
        if inside > 0.0 {
            self.reaches(side * top_radps, end_s)
        } else {
            (inside == 0.0 && side * tendency > 0.0).then_some(self.begin_s)
        }
    }

    /// First instant up to `end_s` at which the rate crosses `stop`, which it does not start at.
    fn reaches(&self, stop: f64, end_s: f64) -> Option<f64> {
        let offset = |t: f64| self.at(t).rate_radps - stop;
        let begin = offset(self.begin_s);
        // The rate is monotonic but for one turning point, where the acceleration passes through zero.
        let crossed = |t: f64| offset(t) * begin <= 0.0;
        let (mut low, mut high) = match self.turning_point().filter(|t| *t < end_s) {
            Some(turn) if crossed(turn) => (self.begin_s, turn),
            Some(turn) if crossed(end_s) => (turn, end_s),
            None if crossed(end_s) => (self.begin_s, end_s),
            _ => return None,
        };
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if crossed(middle) {
                high = middle;
            } else {
                low = middle;
            }
        }
        Some(high)
    }

    fn turning_point(&self) -> Option<f64> {
        let (a, c) = (self.start.accel_radps2, self.command_radps2);
        (self.lag_s > 0.0 && a * c < 0.0).then(|| self.begin_s + self.lag_s * log((c - a) / c))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME_S: f64 = 0.02;

    fn limits(lag_s: f64) -> Limits {
        Limits { max_rate_radps: 0.35, max_accel_radps2: 0.087, lag_s }
    }

    fn fly(lag_s: f64, frames: u32, command: impl Fn(u32) -> f64) -> Bank {
        (0..frames)
            .fold(Bank::default(), |bank, k| BankMotion::new(bank, command(k), &limits(lag_s), FRAME_S).at(FRAME_S))
    }

    #[test]
    fn without_lag_a_held_acceleration_gives_a_parabola() {
        let bank = fly(0.0, 100, |_| 0.05);
        assert!((bank.rate_radps - 0.1).abs() < 1e-14 && (bank.angle_rad - 0.1).abs() < 1e-14);
    }

    #[test]
    fn with_lag_the_step_response_is_that_of_a_first_order_lag() {
        let (tau, t, c) = (0.3, 2.0, 0.05);
        let bank = fly(tau, 100, |_| c);
        let decay = (-t / tau).exp();
        assert!((bank.accel_radps2 - c * (1.0 - decay)).abs() < 1e-14);
        assert!((bank.rate_radps - c * (t - tau * (1.0 - decay))).abs() < 1e-13);
        assert!((bank.angle_rad - c * (0.5 * t * t - tau * t + tau * tau * (1.0 - decay))).abs() < 1e-13);
    }

    #[test]
    fn the_motion_does_not_depend_on_how_it_is_cut_into_frames() {
        let start = Bank { angle_rad: 0.3, rate_radps: -0.1, accel_radps2: 0.04 };
        let whole = BankMotion::new(start, -0.06, &limits(0.2), 0.5).at(0.5);
        let half = BankMotion::new(start, -0.06, &limits(0.2), 0.25).at(0.25);
        let twice = BankMotion::new(half, -0.06, &limits(0.2), 0.25).at(0.25);
        assert!(
            (whole.angle_rad - twice.angle_rad).abs() < 1e-15 && (whole.rate_radps - twice.rate_radps).abs() < 1e-15
        );
    }

    #[test]
    fn limits_hold_against_any_command() {
        for lag_s in [0.0, 0.1] {
            let bank = fly(lag_s, 2000, |_| 1e9);
            assert!((bank.rate_radps - 0.35).abs() < 1e-12, "{bank:?}");
            let one_frame = fly(0.0, 1, |_| -1e9);
            assert!((one_frame.rate_radps + 0.087 * FRAME_S).abs() < 1e-15);
        }
    }

    #[test]
    fn the_rate_limit_is_left_as_soon_as_the_command_turns() {
        for lag_s in [0.0, 0.1] {
            let bank = fly(lag_s, 500, |k| if k < 400 { 0.08 } else { -0.05 });
            let slowed = 0.05 * (2.0 - lag_s * (1.0 - (-2.0 / lag_s.max(1e-9)).exp()));
            assert!((bank.rate_radps - (0.35 - slowed)).abs() < 1e-12, "{bank:?}");
        }
    }

    #[test]
    fn commands_that_are_not_numbers_do_nothing() {
        let bank = fly(0.1, 10, |_| f64::NAN);
        assert_eq!(bank, Bank::default());
    }
}
