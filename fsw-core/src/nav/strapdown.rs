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
        Self::none()
    }
}

impl Nominal {
    /// At rest in the centre of the planet, before the start.
    #[must_use]
    pub const fn none() -> Self {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planet::MARS;

    /// No gravity, no rotation: the kinematics alone.
    const NOWHERE: Planet = Planet { radius_m: 1.0, mu_m3ps2: 0.0, rotation_radps: 0.0, j2: 0.0 };
    const DT: f64 = 0.02;

    fn far_away() -> Nominal {
        Nominal { r_i: Vec3::new(4e6, 0.0, 0.0), ..Nominal::default() }
    }

    #[test]
    fn a_steady_turn_under_thrust_is_exact_to_third_order() {
        // Constant body rate and specific force: v(t) = ∫ exp([ω×]t) f dt in closed form about z.
        let (rate, force, n) = (0.35, 90.0, 500);
        let (mut state, mut strapdown) = (far_away(), Strapdown::new());
        let frame =
            Increments { delta_v_b: Vec3::new(force * DT, 0.0, 0.0), delta_theta_b: Vec3::new(0.0, 0.0, rate * DT) };
        for _ in 0..n {
            strapdown.advance(&mut state, &frame, DT, &NOWHERE);
        }
        let angle = rate * DT * f64::from(n);
        let v = Vec3::new(angle.sin(), 1.0 - angle.cos(), 0.0) * (force / rate);
        // The neglected term is θ³/24·Δv a frame: 1.5e-8·1.8·500 = 1.3e-5 m/s at most.
        assert!((state.v_i - v).norm() < 1.4e-5, "{:?}", state.v_i - v);
        let turned = state.attitude_bi.apply(&Vec3::new(1.0, 0.0, 0.0));
        assert!((turned - Vec3::new(angle.cos(), angle.sin(), 0.0)).norm() < 1e-12);
    }

    #[test]
    fn coning_motion_leaves_no_drift() {
        // The x axis goes round a cone of half angle θ: q(t) = cos θ/2 + sin θ/2 (y cos Ωt + z sin Ωt). A unit that handed over
        // the integral of its rate would drift by Ω(1 − cos θ); the rotation vector of the frame does not.
        let (theta, omega): (f64, f64) = (0.05, 40.0);
        let attitude = |t: f64| {
            let (s, c) = (0.5 * theta).sin_cos();
            Rot::<Body, Inertial>::from_quaternion([c, 0.0, s * (omega * t).cos(), s * (omega * t).sin()]).unwrap()
        };
        let (mut state, mut strapdown) = (Nominal { attitude_bi: attitude(0.0), ..far_away() }, Strapdown::new());
        for k in 0..1000 {
            let (t0, t1) = (f64::from(k) * DT, f64::from(k + 1) * DT);
            let turn = attitude(t1).then(&attitude(t0).inverse());
            let vector = turn.rotation_vector();
            let frame = Increments { delta_v_b: Vec3::zero(), delta_theta_b: Vec3::from_components(vector) };
            strapdown.advance(&mut state, &frame, DT, &NOWHERE);
        }
        let error = state.attitude_bi.then(&attitude(1000.0 * DT).inverse()).rotation_vector();
        assert!(Vec3::<Body>::from_components(error).norm() < 1e-11);
    }

    #[test]
    fn sculling_motion_rectifies_as_it_should() {
        // Rotation θ sin Ωt about x and force f sin Ωt along y: mean acceleration of about θf/2 along z.
        let (theta, force, omega): (f64, f64, f64) = (0.01, 20.0, 12.0);
        let (mut state, mut strapdown) = (far_away(), Strapdown::new());
        let n = 1000;
        for k in 0..n {
            let (t0, t1) = (f64::from(k) * DT, f64::from(k + 1) * DT);
            let frame = Increments {
                delta_v_b: Vec3::new(0.0, force / omega * ((omega * t0).cos() - (omega * t1).cos()), 0.0),
                delta_theta_b: Vec3::new(theta * ((omega * t1).sin() - (omega * t0).sin()), 0.0, 0.0),
            };
            strapdown.advance(&mut state, &frame, DT, &NOWHERE);
        }
        // Simpson over fine steps.
        let rate = |t: f64| force * (omega * t).sin() * (theta * (omega * t).sin()).sin();
        let fine = 20 * n;
        let h = DT / 20.0;
        let exact: f64 = (0..fine)
            .map(|k| f64::from(k) * h)
            .map(|t| h / 6.0 * (rate(t) + 4.0 * rate(t + 0.5 * h) + rate(t + h)))
            .sum();
        assert!((exact - 0.5 * theta * force * DT * f64::from(n)).abs() < 0.02);
        // 1.2e-4 of the rectified 2 m/s is left at this frequency; without the sculling term 5e-3 of it would be.
        assert!((state.v_i.z() - exact).abs() < 1e-3, "{} {exact}", state.v_i.z());
    }

    #[test]
    fn free_fall_follows_the_two_body_orbit_with_j2() {
        let mut state = Nominal {
            r_i: Vec3::new(2.2e6, -1.4e6, -2.4e6),
            v_i: Vec3::new(2500.0, 3900.0, -1100.0),
            ..Nominal::default()
        };
        let mut orbit = crate::model::orbiter::OrbiterState::new(state.r_i.to_array(), state.v_i.to_array());
        let mut strapdown = Strapdown::new();
        for _ in 0..15_000 {
            strapdown.advance(&mut state, &Increments::default(), DT, &MARS);
        }
        let (r, v) = orbit.at(&MARS, crate::time::MissionTime(300_000_000)).unwrap();
        // Trapezoid of position: dt²/12 of the change of acceleration, grown over 300 s.
        assert!((state.r_i - r).norm() < 0.01, "{}", (state.r_i - r).norm());
        assert!((state.v_i - v).norm() < 1e-4, "{}", (state.v_i - v).norm());
    }
}
