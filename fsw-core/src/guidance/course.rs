//! Where the vehicle is heading: axes along and across its ground track, and the target as seen in them.

use crate::frames::{PlanetFixed, Vec3, great_circle_rad};
use crate::math::fun::asin;
use crate::math::num::clamp;

/// Unit vectors at the vehicle, planet-fixed axes, and the horizontal speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    /// Away from the planet's centre.
    pub up: Vec3<PlanetFixed>,
    /// Along the ground track.
    pub ahead: Vec3<PlanetFixed>,
    /// To the right of the ground track.
    pub right: Vec3<PlanetFixed>,
    /// Distance from the planet's centre, m.
    pub radius_m: f64,
    /// Horizontal part of the planet-relative velocity, V cosγ, m/s.
    pub ground_speed_mps: f64,
}

impl Course {
    /// The course of a position and a planet-relative velocity; `None` in vertical flight or for a state that is not finite.
    #[must_use]
    pub fn new(r_p: &Vec3<PlanetFixed>, v_p: &Vec3<PlanetFixed>) -> Option<Self> {
        let up = r_p.unit()?;
        let ground_velocity = *v_p - up * up.dot(v_p);
        let ahead = ground_velocity.unit()?;
        Some(Self {
            up,
            ahead,
            right: ahead.cross(&up),
            radius_m: r_p.norm(),
            ground_speed_mps: ground_velocity.norm(),
        })
    }

    /// Heading offset χ = asin(sin S · sin Δψ)·R of the target (unit vector), m: positive when it lies to the right.
    ///
    /// P4 §3.3, with S the range angle and Δψ the bearing of the target against the heading; sin S · sin Δψ is the
    /// component of the target's direction to the right, so no angle needs computing. Not the crossrange of the reports.
    #[must_use]
    pub fn heading_offset_m(&self, target_p: &Vec3<PlanetFixed>, reference_radius_m: f64) -> f64 {
        asin(clamp(target_p.dot(&self.right), -1.0, 1.0)) * reference_radius_m
    }

    /// Great-circle range to the target (unit vector) at the reference radius, m.
    #[must_use]
    pub fn range_m(&self, target_p: &Vec3<PlanetFixed>, reference_radius_m: f64) -> f64 {
        great_circle_rad(&self.up, target_p) * reference_radius_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{PlanetRelative, initial_azimuth_rad, surface_point};
    use crate::math::num::wrap_angle;
    use crate::planet::MARS;
    use crate::units::rad;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_vector_form_of_the_heading_offset_is_that_of_the_paper(
            lon in -170.0..170.0f64, lat in -70.0..70.0f64, psi in -180.0..180.0f64, gamma in -60.0..30.0f64,
            dlon in -20.0..20.0f64, dlat in -15.0..15.0f64,
        ) {
            let state = PlanetRelative {
                radius_m: 3.43e6, longitude_rad: rad(lon), latitude_rad: rad(lat), speed_mps: 2e3,
                flight_path_angle_rad: rad(gamma), heading_rad: rad(psi),
            };
            let (r, v) = state.to_cartesian();
            let target = surface_point(rad(lon + dlon), rad(lat + dlat));
            let course = Course::new(&r, &v).unwrap();
            let bearing = wrap_angle(initial_azimuth_rad(&r, &target) - state.heading_rad);
            let range = great_circle_rad(&r, &target);
            let paper = (range.sin() * bearing.sin()).asin() * MARS.radius_m;
            // 1e-9 rad of rounding at the reference radius.
            prop_assert!((course.heading_offset_m(&target, MARS.radius_m) - paper).abs() < 4e-3);
            prop_assert!((course.ground_speed_mps - 2e3 * rad(gamma).cos()).abs() < 1e-8);
        }
    }

    #[test]
    fn vertical_flight_has_no_course() {
        let up = Vec3::new(3.4e6, 0.0, 0.0);
        assert_eq!(Course::new(&up, &Vec3::new(-300.0, 0.0, 0.0)), None);
        assert_eq!(Course::new(&Vec3::new(f64::NAN, 0.0, 0.0), &Vec3::new(0.0, 1.0, 0.0)), None);
    }
}
