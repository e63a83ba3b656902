//! Modes `segmented` and `segmented-table`: predictions that end early, at the next of P4's three waypoints.
//!
//! * `segmented`, as P4 §4.1 prints it: each waypoint in turn is the target, and a prediction ends at its speed.
//! * `segmented-table`: the speed of the waypoint only cuts the prediction; the target stays the target, and the range
//!   that is left at the cut comes from a table: a second-order polynomial in altitude, flight-path angle and cosine
//!   of the bank there, linear in the logarithm of the density, clamped to the box it was fitted in.

use crate::frames::{PlanetFixed, Vec3, surface_point};
use crate::math::fun::asin;
use crate::math::num::{clamp, max};

use super::predictor::State;
use super::tables::{REMAINDER_TERMS, SEGMENTS, Segment};

/// The segment flown: index of the waypoint ahead, the number of waypoints when only the target is left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segments {
    next: u8,
}

impl Segments {
    /// At the start of the first segment.
    pub const NEW: Self = Self { next: 0 };

    /// The segment flown; `None` on the way to the target.
    #[must_use]
    pub fn flown(&self) -> Option<&'static Segment> {
        SEGMENTS.get(usize::from(self.next))
    }

    /// Leaves the waypoints that lie behind or whose speed has been passed.
    pub fn advance(&mut self, state: &State, speed_mps: f64) {
        for segment in SEGMENTS.iter().skip(usize::from(self.next)) {
            if speed_mps > f64::from(segment.speed_mps) && is_ahead(state, &segment.direction_p()) {
                return;
            }
            self.next = self.next.saturating_add(1);
        }
    }
}

fn is_ahead(&[x, y, z, vx, vy, vz]: &State, target_p: &Vec3<PlanetFixed>) -> bool {
    let (r, v) = (Vec3::<PlanetFixed>::new(x, y, z), Vec3::<PlanetFixed>::new(vx, vy, vz));
    let up = r * (1.0 / max(r.norm(), 1.0));
    target_p.dot(&(v - up * up.dot(&v))) > 0.0
}

impl Segment {
    /// Direction of the waypoint, planet-fixed unit vector.
    #[must_use]
    pub fn direction_p(&self) -> Vec3<PlanetFixed> {
        surface_point(f64::from(self.longitude_rad), f64::from(self.latitude_rad))
    }

    /// Range still flown from the state in which a prediction was cut, m, with this cosine of the bank in air of this
    /// density over that of the onboard model.
    #[must_use]
    pub fn remainder_m(&self, state: &State, reference_radius_m: f64, cos_bank: f64, log_density: f64) -> f64 {
        let &[x, y, z, vx, vy, vz] = state;
        let (r, v) = (Vec3::<PlanetFixed>::new(x, y, z), Vec3::<PlanetFixed>::new(vx, vy, vz));
        let radius_m = r.norm();
        let sine = r.dot(&v) / max(radius_m * v.norm(), 1.0);
        let point = [radius_m - reference_radius_m, asin(clamp(sine, -1.0, 1.0)), cos_bank, log_density];
        self.polynomial(point)
    }

    fn polynomial(&self, point: [f64; 4]) -> f64 {
        let mut scaled = [0.0; 4];
        for ((s, p), (centre, reach)) in scaled.iter_mut().zip(&point).zip(&self.validity) {
            *s = clamp((p - f64::from(*centre)) / f64::from(*reach), -1.0, 1.0);
        }
        let terms = terms(scaled);
        terms.iter().zip(&self.coefficients).fold(0.0, |sum, (t, c)| sum + t * f64::from(*c))
    }
}

/// The terms of the polynomial at a point scaled to ±1: altitude, flight-path angle, cosine of the bank, log-density.
#[must_use]
pub fn terms([h, gamma, u, rho]: [f64; 4]) -> [f64; REMAINDER_TERMS] {
    [1.0, h, gamma, u, h * h, h * gamma, h * u, gamma * gamma, gamma * u, u * u, rho, rho * h, rho * u]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::frames::PlanetRelative;
    use crate::guidance::air::{Adapted, AirProfile};
    use crate::guidance::predictor::{Prediction, Stop};
    use crate::model::OnboardModel;

    /// Flies from the cut to the trigger with the predictor: the great circle flown, m.
    fn flown_m(segment: &Segment, [h, gamma, u, rho]: [f64; 4]) -> f64 {
        let c = Config::DEFAULT;
        let still = crate::planet::Planet { rotation_radps: 0.0, j2: 0.0, ..c.planet };
        let model = OnboardModel::new(still, &c.vehicle, &[], &c.atmosphere, &[]).unwrap();
        let (r, v) = PlanetRelative {
            radius_m: still.radius_m + h,
            speed_mps: f64::from(segment.speed_mps),
            flight_path_angle_rad: gamma,
            heading_rad: 1.5,
            ..PlanetRelative::default()
        }
        .to_cartesian();
        let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
        let mut air = AirProfile::NONE;
        air.set_constant(&model, rho.exp());
        let flown = Adapted { model: &model, air: &air };
        let stop = Stop { speed_mps: 450.0, radius_m: still.radius_m, horizon_s: 900.0 };
        let state = [x, y, z, vx, vy, vz];
        let mut prediction = Prediction::held(&flown, &state, u, (1.0 - u * u).sqrt());
        for _ in 0..1000 {
            if prediction.step(&flown, 1.0, &stop, None) {
                let end = prediction.end();
                let ahead = r + v * 1000.0;
                return end.beyond_along_arc_rad(&state, &ahead.unit().unwrap()).unwrap() * still.radius_m
                    + crate::frames::great_circle_rad(&r, &ahead) * still.radius_m;
            }
        }
        panic!("no end");
    }

    #[test]
    fn the_table_is_what_the_predictor_flies_near_the_centre_and_holds_beyond_its_box() {
        for segment in &SEGMENTS {
            let at = |share: [f64; 4]| {
                let mut point = [0.0; 4];
                for k in 0..4 {
                    let (centre, reach) = segment.validity[k];
                    point[k] = f64::from(centre) + share[k] * f64::from(reach);
                }
                point
            };
            for share in [[0.0; 4], [0.4, 0.0, 0.2, 0.0], [0.0, -0.4, 0.0, 0.3], [-0.3, 0.3, -0.3, -0.3]] {
                let (table, flown) = (segment.polynomial(at(share)), flown_m(segment, at(share)));
                // Second order over banks of 10° to 110°: a few per cent of the range that is left.
                assert!((table - flown).abs() < 0.08 * flown, "{share:?}: {table} against {flown}");
            }
            assert_eq!(segment.polynomial(at([1.0, 1.0, 1.0, 1.0])), segment.polynomial(at([3.0, 2.0, 9.0, 5.0])));
        }
    }

    #[test]
    fn a_waypoint_ends_when_it_lies_behind_or_its_speed_has_been_passed() {
        let (r, v) = PlanetRelative {
            radius_m: 3.45e6,
            longitude_rad: crate::units::rad(-85.0),
            latitude_rad: crate::units::rad(-43.4),
            speed_mps: 5500.0,
            heading_rad: 1.5,
            ..PlanetRelative::default()
        }
        .to_cartesian();
        let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
        let state = [x, y, z, vx, vy, vz];
        let mut segments = Segments::NEW;
        segments.advance(&state, 6000.0);
        assert_eq!(segments.flown(), Some(&SEGMENTS[0]));
        segments.advance(&state, f64::from(SEGMENTS[1].speed_mps) - 1.0);
        assert_eq!(segments.flown(), Some(&SEGMENTS[2]));
        let beyond = [x, y, z, -vx, -vy, -vz];
        segments.advance(&beyond, 6000.0);
        assert_eq!(segments.flown(), None);
    }
}
