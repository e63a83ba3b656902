//! What a rehearsed prediction flies: the bank that guidance and control will command on the way, in closed form.
//!
//! * Range control: the magnitude sought, on one side until the lateral logic reverses it.
//! * Heading alignment: proportional navigation, sampled at every step.
//! * Every change of the command is a [`Turn`] of finite rate and acceleration.

use crate::frames::{PlanetFixed, Vec3};
use crate::link::parameters::{ControlParameters, GuidanceParameters};
use crate::math::fun::{asin, sin, sqrt};
use crate::math::num::{clamp, max, min};

use super::lateral;
use super::predictor::{Bank, Node, crossing};
use super::turn::{BankState, Turn};

/// Time from a crossing of the threshold to the command that follows it, s: on average half a guidance cycle.
const REVERSAL_DELAY_S: f64 = 0.5;
/// Longest step while the bank turns or follows the alignment, s.
const TURNING_STEP_S: f64 = 2.0;
/// Shortest piece of a step before an event, as a share of it.
const LEAST_SHARE: f64 = 0.05;
/// Gain of the proportional navigation.
const NAVIGATION_GAIN: f64 = 3.0;
/// Shortest time to go that steers, s: the bearing of a target just ahead swings wildly.
const LEAST_TIME_TO_GO_S: f64 = 4.0;
/// Lift acceleration below which no bank turns the track, m/s².
const MIN_LIFT_MPS2: f64 = 1e-6;

/// Rules and limits of the flight that is rehearsed.
#[derive(Clone, Copy, Debug)]
pub struct Steering<'a> {
    /// Guidance settings.
    pub guidance: &'a GuidanceParameters,
    /// Limits of the bank control.
    pub control: &'a ControlParameters,
    /// Direction of the target, planet-fixed unit vector.
    pub target_p: Vec3<PlanetFixed>,
    /// Radius of the reference sphere, m.
    pub radius_m: f64,
    /// Heading alignment begins below this speed, m/s.
    pub alignment_speed_mps: f64,
    /// Speed at the end of the alignment, m/s.
    pub stop_speed_mps: f64,
    /// Lift over drag of the onboard model at high speed.
    pub lift_to_drag: f64,
}

/// Who steers a rehearsed prediction: the command in force and the bank on its way to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pilot {
    bank: BankState,
    magnitude_rad: f64,
    /// Sine of it: what the lateral logic goes by.
    sin_magnitude: f64,
    side: f64,
    aligning: bool,
    turn: Option<Turn>,
}

impl Pilot {
    /// Starts from a bank with a commanded magnitude on a side.
    #[must_use]
    pub fn new(bank: BankState, magnitude_rad: f64, side: f64) -> Self {
        Self { bank, magnitude_rad, sin_magnitude: sin(magnitude_rad), side, aligning: false, turn: None }
    }

    /// Bank now, rad.
    #[must_use]
    pub fn bank_rad(&self) -> f64 {
        self.bank.bank_rad
    }

    /// Whether the bank turned in the last step.
    #[inline(always)]
    pub(super) fn is_turning(&self) -> bool {
        self.turn.is_some()
    }

    /// Decides the bank over the next step: its length, s, and the banks at its start, middle and end.
    #[inline(never)] // once in a step
    pub(super) fn plan(&mut self, node: &Node, step_s: f64, steering: &Steering<'_>, banks: &mut [Bank; 3]) -> f64 {
        self.aligning |= node.speed_mps <= steering.alignment_speed_mps;
        let command_rad = if self.aligning {
            let sight = Sight::new(&node.state, node.radius_m, steering);
            sight.command(&node.acceleration, &self.bank, node.lift_mps2, steering)
        } else {
            self.side * self.magnitude_rad
        };
        self.turn = None;
        if self.bank.bank_rad == command_rad && self.bank.rate_radps == 0.0 {
            return step_s;
        }
        let step_s = min(step_s, TURNING_STEP_S);
        let turn = Turn::new(self.bank, command_rad, steering.control);
        let [_, middle, last] = banks;
        *middle = Bank::of(turn.at(0.5 * step_s).bank_rad);
        self.bank = turn.at(step_s);
        *last = Bank::of(self.bank.bank_rad);
        self.turn = Some(turn);
        step_s
    }

    /// Looks at what happened over a step: the share of it at which the command changes, if it does.
    #[inline(never)] // once in a step
    pub(super) fn arrive(&mut self, [a, b]: [&Node; 2], step_s: f64, steering: &Steering<'_>) -> Option<f64> {
        if self.aligning {
            return None;
        }
        let share = if b.speed_mps <= steering.alignment_speed_mps {
            self.aligning = true;
            speed_crossing([a, b], step_s, steering.alignment_speed_mps)
        } else {
            self.reversal([a, b], step_s, steering)?
        };
        let share = max(share, LEAST_SHARE);
        if let (Some(turn), true) = (&self.turn, share < 1.0) {
            self.bank = turn.at(share * step_s);
        }
        (share < 1.0).then_some(share)
    }

    /// Share of the step at which a reversal is commanded; the side is that after it.
    #[inline(always)]
    fn reversal(&mut self, [a, b]: [&Node; 2], step_s: f64, steering: &Steering<'_>) -> Option<f64> {
        let after = steering.excess(b, self.side, self.sin_magnitude);
        if after <= 0.0 {
            return None;
        }
        let before = min(steering.excess(a, self.side, self.sin_magnitude), 0.0);
        self.side = -self.side;
        Some(min(before / (before - after) + REVERSAL_DELAY_S / step_s, 1.0))
    }
}

impl Steering<'_> {
    /// Threshold of the heading offset, m, at a distance from the target's direction (unit vectors), a speed and a bank.
    #[must_use]
    pub fn threshold_m(&self, distance: f64, speed_mps: f64, sin_bank: f64) -> f64 {
        let range_m = distance * self.radius_m;
        self.guidance.reversal_share
            * lateral::recoverable_m(self.lift_to_drag, sin_bank, speed_mps / self.stop_speed_mps, range_m)
    }

    /// By how much the target lies outside the threshold on the side away from the lift, m; negative inside.
    #[inline(never)] // once in a step, or twice
    fn excess(&self, node: &Node, side: f64, sin_bank: f64) -> f64 {
        let [x, y, z, vx, vy, vz] = node.state;
        let (hx, hy, hz) = (vy * z - vz * y, vz * x - vx * z, vx * y - vy * x);
        let [tx, ty, tz] = self.target_p.to_array();
        // sin χ, to the right; the arc is longer than its sine by less than a metre at 60 km.
        let offset = (hx * tx + hy * ty + hz * tz) / sqrt(hx * hx + hy * hy + hz * hz);
        // The chord for the arc: 0.2 % short from entry.
        let cosine = (x * tx + y * ty + z * tz) / node.radius_m;
        let chord = sqrt(max(2.0 - 2.0 * cosine, 0.0));
        -side * offset * self.radius_m - self.threshold_m(chord, node.speed_mps, sin_bank)
    }
}

#[inline(never)] // once in a prediction
fn speed_crossing(nodes: [&Node; 2], step_s: f64, speed_mps: f64) -> f64 {
    let speeds = nodes.map(|node| {
        let ([_, _, _, vx, vy, vz], [ax, ay, az]) = (node.state, node.acceleration);
        (node.speed_mps, (vx * ax + vy * ay + vz * az) / node.speed_mps)
    });
    crossing(speeds, step_s, speed_mps)
}

/// The target as seen along the ground track.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Unit vector to the right of the track.
    right: [f64; 3],
    /// Distances to the target along the track and to the right of it, m.
    ahead_m: f64,
    right_m: f64,
    /// Horizontal speed, m/s.
    ground_speed_mps: f64,
    speed_mps: f64,
}

impl Sight {
    /// From position and planet-relative velocity.
    #[inline(never)] // in alignment only
    #[must_use]
    pub fn new(&[x, y, z, vx, vy, vz]: &[f64; 6], radius_m: f64, steering: &Steering<'_>) -> Self {
        let (hx, hy, hz) = (vy * z - vz * y, vz * x - vx * z, vx * y - vy * x);
        let h = max(sqrt(hx * hx + hy * hy + hz * hz), 1.0);
        let right = [hx / h, hy / h, hz / h];
        let [rx, ry, rz] = right;
        let [tx, ty, tz] = steering.target_p.to_array();
        // ahead = up × right
        let (ax, ay, az) = (y * rz - z * ry, z * rx - x * rz, x * ry - y * rx);
        Self {
            right,
            ahead_m: ax * tx + ay * ty + az * tz,
            right_m: (rx * tx + ry * ty + rz * tz) * radius_m,
            ground_speed_mps: h / radius_m,
            speed_mps: sqrt(vx * vx + vy * vy + vz * vz),
        }
    }

    /// The bank of proportional navigation, rad.
    ///
    /// Lateral acceleration N y / t², with y the distance of the target from the track and t the time until the vehicle is
    /// abeam of it or at the trigger, less what acts to the side without lift. It brings y to zero whatever the density ahead.
    #[inline(never)] // in alignment only
    #[must_use]
    pub fn command(&self, acceleration: &[f64; 3], bank: &BankState, lift_mps2: f64, steering: &Steering<'_>) -> f64 {
        if lift_mps2 <= MIN_LIFT_MPS2 {
            return 0.0;
        }
        let [ax, ay, az] = acceleration;
        let [rx, ry, rz] = self.right;
        let free_mps2 = ax * rx + ay * ry + az * rz - lift_mps2 * sin(bank.bank_rad);
        let slowing = 0.5 * (1.0 + min(steering.stop_speed_mps / self.speed_mps, 1.0));
        let time_s = max(self.ahead_m / (slowing * self.ground_speed_mps), LEAST_TIME_TO_GO_S);
        let wanted_mps2 = NAVIGATION_GAIN * self.right_m / (time_s * time_s) - free_mps2;
        let limit = sin(steering.guidance.alignment_max_bank_rad);
        asin(clamp(wanted_mps2 / lift_mps2, -limit, limit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::surface_point;
    use crate::units::rad;

    static CONFIG: Config = Config::DEFAULT;
    const RADIUS_M: f64 = 3_397_200.0;

    /// The target east along the equator.
    fn steering() -> Steering<'static> {
        Steering {
            guidance: &CONFIG.guidance,
            control: &CONFIG.control,
            target_p: surface_point(0.0, 0.0),
            radius_m: RADIUS_M,
            alignment_speed_mps: 600.0,
            stop_speed_mps: 450.0,
            lift_to_drag: 0.24,
        }
    }

    /// Flying east, so far before the target and north of it, at 20 km.
    fn node(before_m: f64, north_m: f64, speed_mps: f64) -> Node {
        let r_m = RADIUS_M + 20e3;
        let (east, north) = (-before_m / RADIUS_M, north_m / RADIUS_M);
        let position = surface_point(east, north) * r_m;
        let [x, y, z] = position.to_array();
        let state = [x, y, z, -speed_mps * east.sin(), speed_mps * east.cos(), 0.0];
        Node { state, acceleration: [0.0; 3], radius_m: r_m, speed_mps, lift_mps2: 2.0 }
    }

    #[test]
    fn the_bank_is_reversed_only_when_the_target_lies_far_enough_on_the_other_side() {
        let s = steering();
        // North of the target, it lies to the right: banked left, to the side −1, away from it.
        let sine = rad(50.0).sin();
        let threshold_m = s.threshold_m(200e3 / RADIUS_M, 3000.0, sine);
        for (share, side, out) in [(0.9, -1.0, false), (1.1, -1.0, true), (1.1, 1.0, false)] {
            let excess_m = s.excess(&node(200e3, share * threshold_m, 3000.0), side, sine);
            assert_eq!(excess_m > 0.0, out, "{share} {side}: {excess_m}");
        }
    }

    #[test]
    fn a_step_that_crosses_the_threshold_reverses_half_a_second_later() {
        let s = steering();
        let magnitude = rad(50.0);
        let mut pilot = Pilot::new(BankState { bank_rad: -magnitude, rate_radps: 0.0 }, magnitude, -1.0);
        let limit_m = s.threshold_m(200e3 / RADIUS_M, 3000.0, magnitude.sin());
        let (a, b) = (node(206e3, 0.9 * limit_m, 3000.0), node(200e3, 1.1 * limit_m, 3000.0));
        let share = pilot.arrive([&a, &b], 2.0, &s).unwrap();
        assert!(share > 0.25 && share < 1.0, "{share}");
        let mut banks = [Bank::of(0.0); 3];
        // The next step turns towards the other side.
        let step_s = pilot.plan(&b, 4.0, &s, &mut banks);
        assert_eq!(step_s, TURNING_STEP_S);
        assert!(pilot.bank_rad() > -magnitude && pilot.is_turning());
        assert_eq!(pilot.arrive([&b, &b], 2.0, &s), None, "one reversal, not one a step");
    }

    #[test]
    fn alignment_begins_at_its_speed_and_steers_to_the_target() {
        let s = steering();
        let mut pilot = Pilot::new(BankState::default(), 0.0, 1.0);
        let (a, b) = (node(20e3, 300.0, 620.0), node(19e3, 300.0, 590.0));
        let (a, b) = (Node { acceleration: [0.0, -15.0, 0.0], ..a }, Node { acceleration: [0.0, -15.0, 0.0], ..b });
        let share = pilot.arrive([&a, &b], 2.0, &s).unwrap();
        assert!((share - 2.0 / 3.0).abs() < 0.01, "{share}");
        for (north_m, sign) in [(300.0, 1.0), (-300.0, -1.0)] {
            let node = node(15e3, north_m, 580.0);
            let sight = Sight::new(&node.state, node.radius_m, &s);
            let command = sight.command(&[0.0; 3], &BankState::default(), node.lift_mps2, &s);
            assert!(command * sign > 0.0 && command.abs() <= CONFIG.guidance.alignment_max_bank_rad, "{command}");
        }
    }

    #[test]
    fn without_lift_nothing_is_commanded_and_at_the_target_nothing_wild() {
        let s = steering();
        let abeam = node(0.0, 50.0, 460.0);
        let sight = Sight::new(&abeam.state, abeam.radius_m, &s);
        assert_eq!(sight.command(&[0.0; 3], &BankState::default(), 0.0, &s), 0.0);
        let command = sight.command(&[0.0; 3], &BankState::default(), 2.0, &s);
        assert!(command.is_finite() && command.abs() <= CONFIG.guidance.alignment_max_bank_rad + 1e-12);
    }
}
