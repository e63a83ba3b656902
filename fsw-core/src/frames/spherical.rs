//! Planet-relative spherical state, great-circle geometry and the step between inertial and rotating axes.

use core::f64::consts::PI;

use super::{Axes, Body, Inertial, LocalNed, PlanetFixed, Rot, Vec3};
use crate::math::fun::{asin, atan2, cos, sin_cos, sqrt};
use crate::math::num::{clamp, wrap_angle};
use crate::time::MissionTime;

/// Planet-relative state in the project's convention: heading clockwise from north, path angle positive up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PlanetRelative {
    /// Distance from the planet's centre, m.
    pub radius_m: f64,
    /// Longitude, rad, positive east.
    pub longitude_rad: f64,
    /// Planetocentric latitude, rad, positive north.
    pub latitude_rad: f64,
    /// Speed relative to the rotating planet, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, rad, positive up.
    pub flight_path_angle_rad: f64,
    /// Heading, rad, clockwise from north.
    pub heading_rad: f64,
}

impl PlanetRelative {
    /// The spherical state of a position and a planet-relative velocity, both in planet-fixed axes.
    /// At a pole or at rest the undefined angles are zero.
    #[must_use]
    pub fn from_cartesian(r_p: &Vec3<PlanetFixed>, v_p: &Vec3<PlanetFixed>) -> Self {
        let radius_m = r_p.norm();
        let speed_mps = v_p.norm();
        let latitude_rad = if radius_m > 0.0 { asin(clamp(r_p.z() / radius_m, -1.0, 1.0)) } else { 0.0 };
        let longitude_rad = atan2(r_p.y(), r_p.x());
        let v_n = ned_from_planet_fixed(longitude_rad, latitude_rad).apply(v_p);
        let horizontal = sqrt(v_n.x() * v_n.x() + v_n.y() * v_n.y());
        Self {
            radius_m,
            longitude_rad,
            latitude_rad,
            speed_mps,
            flight_path_angle_rad: atan2(-v_n.z(), horizontal),
            heading_rad: atan2(v_n.y(), v_n.x()),
        }
    }

    /// Position and planet-relative velocity in planet-fixed axes.
    #[must_use]
    pub fn to_cartesian(&self) -> (Vec3<PlanetFixed>, Vec3<PlanetFixed>) {
        let r_p = surface_point(self.longitude_rad, self.latitude_rad) * self.radius_m;
        let (sin_gamma, cos_gamma) = sin_cos(self.flight_path_angle_rad);
        let (sin_psi, cos_psi) = sin_cos(self.heading_rad);
        let v_n = Vec3::<LocalNed>::new(cos_gamma * cos_psi, cos_gamma * sin_psi, -sin_gamma) * self.speed_mps;
        (r_p, ned_from_planet_fixed(self.longitude_rad, self.latitude_rad).inverse().apply(&v_n))
    }
}

/// Unit vector to a point of the sphere, planet-fixed axes.
#[must_use]
pub fn surface_point(longitude_rad: f64, latitude_rad: f64) -> Vec3<PlanetFixed> {
    let (sin_lon, cos_lon) = sin_cos(longitude_rad);
    let (sin_lat, cos_lat) = sin_cos(latitude_rad);
    Vec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat)
}

/// Rotation from planet-fixed axes to north-east-down at a point.
#[must_use]
pub fn ned_from_planet_fixed(longitude_rad: f64, latitude_rad: f64) -> Rot<PlanetFixed, LocalNed> {
    // About z by the longitude, then about the new y (west of east...) by −(latitude + 90°).
    let (s, c) = sin_cos(-0.5 * (latitude_rad + 0.5 * PI));
    let about_y = Rot::<PlanetFixed, LocalNed>::from_quaternion([c, 0.0, -s, 0.0]).unwrap_or_else(Rot::identity);
    Rot::<PlanetFixed, PlanetFixed>::about_z(longitude_rad).then(&about_y)
}

/// Rotation from inertial to planet-fixed axes at `now`.
#[must_use]
pub fn planet_fixed_from_inertial(now: MissionTime, rotation_radps: f64) -> Rot<Inertial, PlanetFixed> {
    Rot::about_z(rotation_radps * now.as_s())
}

/// Inertial position and velocity to planet-fixed position and planet-relative velocity.
///
/// The transport term is here and nowhere else: v_p = R (v_i − ω × r_i).
#[must_use]
pub fn planet_relative_from_inertial(
    r_i: &Vec3<Inertial>,
    v_i: &Vec3<Inertial>,
    now: MissionTime,
    rotation_radps: f64,
) -> (Vec3<PlanetFixed>, Vec3<PlanetFixed>) {
    let to_fixed = planet_fixed_from_inertial(now, rotation_radps);
    let omega = Vec3::<Inertial>::new(0.0, 0.0, rotation_radps);
    (to_fixed.apply(r_i), to_fixed.apply(&(*v_i - omega.cross(r_i))))
}

/// Planet-fixed position and planet-relative velocity to inertial ones; inverse of [`planet_relative_from_inertial`].
#[must_use]
pub fn inertial_from_planet_relative(
    r_p: &Vec3<PlanetFixed>,
    v_p: &Vec3<PlanetFixed>,
    now: MissionTime,
    rotation_radps: f64,
) -> (Vec3<Inertial>, Vec3<Inertial>) {
    let to_inertial = planet_fixed_from_inertial(now, rotation_radps).inverse();
    let omega = Vec3::<PlanetFixed>::new(0.0, 0.0, rotation_radps);
    (to_inertial.apply(r_p), to_inertial.apply(&(*v_p + omega.cross(r_p))))
}

/// Central angle between two directions, rad in [0, π]; accurate for near and far points alike.
#[must_use]
pub fn great_circle_rad<F: Axes>(a: &Vec3<F>, b: &Vec3<F>) -> f64 {
    atan2(a.cross(b).norm(), a.dot(b))
}

/// Azimuth, clockwise from north, of the great circle that leaves `from` towards `to` (directions, planet-fixed).
#[must_use]
pub fn initial_azimuth_rad(from: &Vec3<PlanetFixed>, to: &Vec3<PlanetFixed>) -> f64 {
    let north = Vec3::<PlanetFixed>::new(0.0, 0.0, 1.0);
    let east = north.cross(from);
    let east_part = east.dot(to) * from.norm();
    let north_part = from.cross(&east).dot(to);
    wrap_angle(atan2(east_part, north_part))
}

/// Bank angle of an attitude about a velocity: 0 lift up, positive lift to the right. Axes `F` may be inertial or
/// planet-fixed; `velocity` is the planet- or air-relative one. `None` when position, velocity or attitude give no plane.
///
/// At zero sideslip the body y axis is normal to the velocity: y_b = right·cosσ − up·sinσ.
#[must_use]
pub fn bank_from_attitude<F: Axes>(attitude_bf: &Rot<Body, F>, position: &Vec3<F>, velocity: &Vec3<F>) -> Option<f64> {
    let forward = velocity.unit()?;
    let up_raw = *position - forward * forward.dot(position);
    let up = up_raw.unit()?;
    let right = forward.cross(&up);
    let y_b = attitude_bf.apply(&Vec3::new(0.0, 1.0, 0.0));
    let (sine, cosine) = (-y_b.dot(&up), y_b.dot(&right));
    if sine * sine + cosine * cosine < 1e-6 { None } else { Some(atan2(sine, cosine)) }
}

/// Great-circle distance split along and across the arc from `start` to `target` (all directions): downrange of
/// `point` beyond `target` (positive beyond) and crossrange (positive right of the arc), both rad.
#[must_use]
pub fn along_and_across_rad(
    start: &Vec3<PlanetFixed>,
    target: &Vec3<PlanetFixed>,
    point: &Vec3<PlanetFixed>,
) -> Option<(f64, f64)> {
    let normal = start.cross(target).unit()?;
    let point = point.unit()?;
    let target = target.unit()?;
    // `normal` points to the left of the arc.
    let across = -asin(clamp(normal.dot(&point), -1.0, 1.0));
    let ahead = normal.cross(&target);
    let along = atan2(point.dot(&ahead), point.dot(&target));
    if cos(across) < 1e-9 { None } else { Some((along, across)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planet::MARS;
    use crate::units::rad;
    use proptest::prelude::*;

    fn state() -> impl Strategy<Value = PlanetRelative> {
        (3.2e6..4.0e6f64, -179.0..179.0f64, -88.0..88.0f64, 10.0..8000.0f64, -88.0..88.0f64, -179.0..179.0f64).prop_map(
            |(radius_m, lon, lat, speed_mps, gamma, psi)| PlanetRelative {
                radius_m,
                longitude_rad: rad(lon),
                latitude_rad: rad(lat),
                speed_mps,
                flight_path_angle_rad: rad(gamma),
                heading_rad: rad(psi),
            },
        )
    }

    proptest! {
        #[test]
        fn spherical_and_cartesian_states_round_trip(s in state()) {
            let (r, v) = s.to_cartesian();
            let t = PlanetRelative::from_cartesian(&r, &v);
            prop_assert!((t.radius_m - s.radius_m).abs() < 1e-8);
            prop_assert!((t.speed_mps - s.speed_mps).abs() < 1e-9);
            for (a, b) in [(t.longitude_rad, s.longitude_rad), (t.latitude_rad, s.latitude_rad),
                           (t.flight_path_angle_rad, s.flight_path_angle_rad), (t.heading_rad, s.heading_rad)] {
                prop_assert!(wrap_angle(a - b).abs() < 1e-10, "{} {}", a, b);
            }
        }

        #[test]
        fn inertial_and_planet_relative_states_round_trip(s in state(), t in 0u32..1_000_000_000) {
            let (r, v) = s.to_cartesian();
            let now = MissionTime(t);
            let (ri, vi) = inertial_from_planet_relative(&r, &v, now, MARS.rotation_radps);
            let (r2, v2) = planet_relative_from_inertial(&ri, &vi, now, MARS.rotation_radps);
            prop_assert!((r2 - r).norm() < 1e-8 && (v2 - v).norm() < 1e-10);
        }
    }

    #[test]
    fn east_is_a_heading_of_ninety_degrees() {
        let north_pole_side = surface_point(0.0, 0.1);
        let east = surface_point(0.1, 0.0);
        let here = surface_point(0.0, 0.0);
        assert!((initial_azimuth_rad(&here, &east) - rad(90.0)).abs() < 1e-12);
        assert!(initial_azimuth_rad(&here, &north_pole_side).abs() < 1e-12);
    }

    #[test]
    fn a_point_south_of_an_eastward_arc_is_to_the_right() {
        let (start, target) = (surface_point(0.0, 0.0), surface_point(0.2, 0.0));
        let (along, across) = along_and_across_rad(&start, &target, &surface_point(0.25, -0.01)).unwrap();
        assert!((along - 0.05).abs() < 1e-12 && (across - 0.01).abs() < 1e-12);
    }

    #[test]
    fn bank_is_positive_when_the_right_side_is_down() {
        // Flying east at the equator, longitude 0: forward = y, up = x, right = −z (south).
        let (r, v) = (Vec3::<PlanetFixed>::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0));
        for bank in [-2.0, -0.3, 0.0, 0.7, 3.0f64] {
            let (s, c) = (bank.sin(), bank.cos());
            let y_b = Vec3::new(-s, 0.0, -c);
            let z_b = Vec3::new(-c, 0.0, s);
            let attitude = Rot::<Body, PlanetFixed>::from_columns(&v, &y_b, &z_b).unwrap();
            assert!((bank_from_attitude(&attitude, &r, &v).unwrap() - bank).abs() < 1e-12);
        }
    }
}
