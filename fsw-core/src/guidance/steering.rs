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
}

/// Who steers a rehearsed prediction: the command in force and the bank on its way to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pilot {
    bank: BankState,
    magnitude_rad: f64,
    side: f64,
    aligning: bool,
    turn: Option<Turn>,
}

impl Pilot {
    /// Starts from a bank with a commanded magnitude on a side.
    #[must_use]
    pub fn new(bank: BankState, magnitude_rad: f64, side: f64) -> Self {
        Self { bank, magnitude_rad, side, aligning: false, turn: None }
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
        let after = steering.excess(b, self.side);
        if after <= 0.0 {
            return None;
        }
        let before = min(steering.excess(a, self.side), 0.0);
        self.side = -self.side;
        Some(min(before / (before - after) + REVERSAL_DELAY_S / step_s, 1.0))
    }
}

impl Steering<'_> {
    /// By how much the target lies outside the threshold on the side away from the lift, m; negative inside.
    #[inline(never)] // twice in a step
    fn excess(&self, node: &Node, side: f64) -> f64 {
        let [x, y, z, vx, vy, vz] = node.state;
        let (hx, hy, hz) = (vy * z - vz * y, vz * x - vx * z, vx * y - vy * x);
        let [tx, ty, tz] = self.target_p.to_array();
        // sin χ, to the right; the arc is longer than its sine by less than a metre at 60 km.
        let offset = (hx * tx + hy * ty + hz * tz) / sqrt(hx * hx + hy * hy + hz * hz);
        -side * offset * self.radius_m - lateral::threshold_m(node.speed_mps, self.guidance)
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
