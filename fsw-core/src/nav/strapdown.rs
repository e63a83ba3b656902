//! Strapdown integration of attitude, velocity and position in inertial axes from the increments of one frame.
//!
//! The unit hands over the rotation of a frame as a rotation vector (`doc/icd.md`): its coning is integrated already, so the
//! quaternion takes it as it is, and a coning term added here would count it twice. The velocity increment is the integral of
//! the specific force in turning axes; bringing it to the axes of the frame's start takes the rotation within the frame to second
//! order (a bank turn of 20°/s at 9 g would lose 4 mm/s in 5 s without it) and the two-sample sculling term, in which the
//! increments of the frame before stand in for the slope within this one (Savage 1998, part 2).

use crate::frames::{Body, Inertial, Rot, Vec3};
use crate::model::gravity;
use crate::planet::Planet;

/// Increments of one frame after compensation: what ideal sensors would have accumulated in turning body axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Increments {
    /// ∫ specific force dt, m/s.
    pub delta_v_b: Vec3<Body>,
    /// Rotation over the frame as a rotation vector: body axes at its end seen from those at its start, rad.
    pub delta_theta_b: Vec3<Body>,
}

/// Nominal state of the navigator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nominal {
    /// Inertial position, m.
    pub r_i: Vec3<Inertial>,
    /// Inertial velocity, m/s.
    pub v_i: Vec3<Inertial>,
    /// Attitude, body → inertial.
    pub attitude_bi: Rot<Body, Inertial>,
}

impl Default for Nominal {
    fn default() -> Self {
        Self { r_i: Vec3::zero(), v_i: Vec3::zero(), attitude_bi: Rot::identity() }
    }
}

impl Nominal {
    /// True when every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.r_i.is_finite() && self.v_i.is_finite() && self.attitude_bi.quaternion().iter().all(|c| c.is_finite())
    }
}

/// What one step did, for the filter's transition and for the bank rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepRecord {
    /// Velocity increment of the specific force, inertial axes, m/s.
    pub delta_v_i: Vec3<Inertial>,
    /// Mean inertial acceleration over the step, m/s².
    pub acceleration_i: Vec3<Inertial>,
}

/// The strapdown integrator: remembers the increments of the frame before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Strapdown {
    before: Option<Increments>,
}

impl Strapdown {
    /// An integrator that has seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self { before: None }
    }

    /// The increments of the last frame, if any.
    #[must_use]
    pub fn last(&self) -> Option<Increments> {
        self.before
    }

    /// Advances `state` by the increments of one frame of length `dt_s`.
    pub fn advance(&mut self, state: &mut Nominal, now: &Increments, dt_s: f64, planet: &Planet) -> StepRecord {
        let before = self.before.unwrap_or(*now);
        self.before = Some(*now);

        let delta_v_i = state.attitude_bi.apply(&rotated_increment(now, &before));
        // Gravity at the middle of the step: the error of a step is below dt³·|dg/dt| ≈ 1e-9 m/s.
        let middle = state.r_i + state.v_i * (0.5 * dt_s) + delta_v_i * (0.125 * dt_s);
        let g = Vec3::<Inertial>::from_array(gravity::acceleration(planet, &middle.to_array()));
        let delta_total = delta_v_i + g * dt_s;

        state.r_i += state.v_i * dt_s + delta_total * (0.5 * dt_s);
        state.v_i += delta_total;
        let turn = Rot::<Body, Body>::from_rotation_vector(now.delta_theta_b.components());
        state.attitude_bi = turn.then(&state.attitude_bi).normalised();
        StepRecord { delta_v_i, acceleration_i: delta_total * (1.0 / dt_s) }
    }
}

/// Velocity increment in the body axes of the frame's start:
/// Δv + ½Δθ×Δv + Δθ×(Δθ×Δv)/6 + (Δθ₋₁×Δv + Δv₋₁×Δθ)/12.
fn rotated_increment(now: &Increments, before: &Increments) -> Vec3<Body> {
    let (theta, dv) = (&now.delta_theta_b, &now.delta_v_b);
    let once = theta.cross(dv);
    let twice = theta.cross(&once);
    let sculling = before.delta_theta_b.cross(dv) + before.delta_v_b.cross(theta);
    *dv + once * 0.5 + twice * (1.0 / 6.0) + sculling * (1.0 / 12.0)
}
