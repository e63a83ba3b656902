//! Heading alignment: below the switch speed the bank steers the ground track to the target.
//!
//! P4 eq. 5–7 as corrected in `doc/equations.md`, by feedback linearisation: with the bearing error δ = ψ_d − ψ,
//!
//! ```text
//! sinσ = (V cosγ / L) [ψ'_d + k₁ δ − (V/r) cosγ sinψ tanφ − Ω₀]
//! ```
//!
//! Ω₀, the turn that Coriolis force and J2 make without lift, is an addition to the paper. The motion of the bearing
//! and the convergence of the meridians are taken together: ψ'_d − (V/r) cosγ sinψ tanφ = (V cosγ/r) sinδ cot S
//! for a fixed target at the range angle S. Near the target the bearing swings wildly, so the desired heading is
//! frozen there, and also once the target no longer lies ahead.

use crate::frames::{PlanetFixed, Vec3};
use crate::link::parameters::GuidanceParameters;
use crate::math::fun::{asin, atan2, sin, sqrt};
use crate::math::num::{clamp, wrap_angle};
use crate::model::OnboardModel;
use crate::model::entry::{Environment, cartesian_rates};

use super::course::Course;

/// Lift acceleration below which no bank turns the track, m/s².
const MIN_LIFT_MPS2: f64 = 1e-6;

/// Heading alignment: remembers the desired heading once it is frozen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Alignment {
    frozen_heading_rad: Option<f64>,
}

/// Where the vehicle is, for one alignment command.
#[derive(Clone, Copy, Debug)]
pub struct AlignmentState<'a> {
    /// Position, planet-fixed, m.
    pub r_p: &'a Vec3<PlanetFixed>,
    /// Planet-relative velocity, planet-fixed axes, m/s.
    pub v_p: &'a Vec3<PlanetFixed>,
    /// Direction of the target, planet-fixed unit vector.
    pub target_p: &'a Vec3<PlanetFixed>,
    /// Density over that of the onboard model, from navigation.
    pub density_ratio: f64,
}

impl Alignment {
    /// No heading frozen.
    pub const NEW: Self = Self { frozen_heading_rad: None };

    /// The bank that aligns the heading, rad, within ± `alignment_max_bank_rad`; `None` in vertical flight or without air.
    pub fn command(
        &mut self,
        state: &AlignmentState<'_>,
        model: &OnboardModel,
        guidance: &GuidanceParameters,
    ) -> Option<f64> {
        let course = Course::new(state.r_p, state.v_p)?;
        let turn_radps = self.wanted_turn_radps(&course, state.target_p, model, guidance)?;
        let lift_mps2 = lift_mps2(state, model);
        if !(lift_mps2 > MIN_LIFT_MPS2 && turn_radps.is_finite()) {
            return None;
        }
        let free_turn_radps = free_turn_radps(&course, state, model);
        let limit = sin(guidance.alignment_max_bank_rad);
        let sin_bank = course.ground_speed_mps * (turn_radps - free_turn_radps) / lift_mps2;
        Some(asin(clamp(sin_bank, -limit, limit)))
    }

    /// Wanted turn of the track against the great circle it flies, rad/s, positive to the right.
    fn wanted_turn_radps(
        &mut self,
        course: &Course,
        target_p: &Vec3<PlanetFixed>,
        model: &OnboardModel,
        guidance: &GuidanceParameters,
    ) -> Option<f64> {
        let (ahead, right, up) = (target_p.dot(&course.ahead), target_p.dot(&course.right), target_p.dot(&course.up));
        let heading = Heading::new(course)?;
        let range_m = course.range_m(target_p, model.planet.radius_m);
        if self.frozen_heading_rad.is_none() && (range_m < guidance.alignment_freeze_range_m || ahead <= 0.0) {
            let bearing_error = if ahead > 0.0 { atan2(right, ahead) } else { 0.0 };
            self.frozen_heading_rad = Some(heading.psi_rad + bearing_error);
        }
        let per_radius = course.ground_speed_mps / course.radius_m;
        Some(match self.frozen_heading_rad {
            Some(desired) => {
                let bearing_error = wrap_angle(desired - heading.psi_rad);
                guidance.alignment_gain_ps * bearing_error - per_radius * heading.convergence
            }
            None => {
                let bearing_error = atan2(right, ahead);
                guidance.alignment_gain_ps * bearing_error + per_radius * right * up / (ahead * ahead + right * right)
            }
        })
    }
}

/// Heading and convergence of the meridians at the vehicle.
struct Heading {
    /// ψ, rad, clockwise from north.
    psi_rad: f64,
    /// sinψ tanφ.
    convergence: f64,
}

impl Heading {
    /// `None` at a pole.
    fn new(course: &Course) -> Option<Self> {
        let east = Vec3::<PlanetFixed>::new(0.0, 0.0, 1.0).cross(&course.up).unit()?;
        let north = course.up.cross(&east);
        let (sine, cosine) = (course.ahead.dot(&east), course.ahead.dot(&north));
        let (sin_lat, up) = (course.up.z(), &course.up);
        let cos_lat = sqrt(up.x() * up.x() + up.y() * up.y());
        Some(Self { psi_rad: atan2(sine, cosine), convergence: sine * sin_lat / cos_lat })
    }
}

/// Lift acceleration that the onboard model expects in the air that navigation found, m/s².
fn lift_mps2(state: &AlignmentState<'_>, model: &OnboardModel) -> f64 {
    let (altitude_m, speed_mps) = (state.r_p.norm() - model.planet.radius_m, state.v_p.norm());
    let (_, lift_coefficient) = model.drag_and_lift_coefficients(altitude_m, speed_mps);
    let pressure = 0.5 * model.atmosphere.density(altitude_m) * state.density_ratio * speed_mps * speed_mps;
    pressure * lift_coefficient * model.vehicle.reference_area_m2 / model.vehicle.mass_kg
}

/// Turn of the track with the lift straight up, rad/s: Coriolis, centrifugal and J2 accelerations to the right.
fn free_turn_radps(course: &Course, state: &AlignmentState<'_>, model: &OnboardModel) -> f64 {
    let ([x, y, z], [vx, vy, vz]) = (state.r_p.to_array(), state.v_p.to_array());
    let [_, _, _, ax, ay, az] = cartesian_rates(model, &[x, y, z, vx, vy, vz], 1.0, 0.0);
    Vec3::<PlanetFixed>::new(ax, ay, az).dot(&course.right) / course.ground_speed_mps
}
