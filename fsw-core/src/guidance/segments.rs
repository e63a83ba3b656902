//! Modes `segmented` and `segmented-table`: predictions that end early, at the next of P4's three waypoints.
//!
//! * `segmented`, as P4 §4.1 prints it: range is flown to each waypoint in turn, and a prediction ends at its speed. The
//!   lateral logic looks at the target all the way: §3.1 counts crossrange from the arc to the deploy point, §3.3 steers to it.
//! * `segmented-table`: the speed of the waypoint only cuts the prediction; the target stays the target, and the range
//!   that is left at the cut comes from a table: a second-order polynomial in altitude, flight-path angle and cosine
//!   of the bank there, linear in the logarithm of the density, clamped to the box it was fitted in. Where the onboard
//!   model is too far from the one that the table was made with, predictions are not cut.

use crate::frames::{PlanetFixed, Vec3, surface_point};
use crate::math::fun::{asin, ln};
use crate::math::num::{abs, clamp, max};
use crate::model::OnboardModel;

use super::air::Adapted;
use super::context::HYPERSONIC_MACH;
use super::predictor::State;
use super::tables::{MADE_WITH, REMAINDER_TERMS, SEGMENTS, Segment};

/// Largest distance of the onboard model from that of the table, as a logarithm: of the drag at one speed, at each of the
/// altitudes of [`MADE_WITH`], and of lift over drag. A third of the reach in density, the rest being for what is learned.
const MAX_LOG_RATIO: f64 = 0.1;
/// The same of the speed at which the parachute fires, m/s.
const MAX_TRIGGER_SPEED_MPS: f64 = 10.0;
/// A prediction that ended this much above the speed of its cut was not cut, m/s.
const CUT_MARGIN_MPS: f64 = 1.0;

/// The segment flown: index of the waypoint ahead, the number of waypoints when only the target is left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Segments {
    next: u8,
}

impl Segments {
    /// At the start of the first segment.
    pub const NEW: Self = Self { next: 0 };
    /// Only the target is left.
    #[allow(clippy::cast_possible_truncation)] // three
    pub const PASSED: Self = Self { next: SEGMENTS.len() as u8 };

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

/// Whether the table holds for the onboard model and the speed at which the parachute fires.
#[must_use]
#[inline(never)] // once a second
pub fn table_holds(model: &OnboardModel, trigger_speed_mps: f64) -> bool {
    let (drag, lift) = model.aero.coefficients(HYPERSONIC_MACH);
    let is_near = |value: f64, made_with: f32| abs(ln(value / f64::from(made_with))) <= MAX_LOG_RATIO;
    abs(trigger_speed_mps - f64::from(MADE_WITH.trigger_speed_mps)) <= MAX_TRIGGER_SPEED_MPS
        && is_near(lift / drag, MADE_WITH.lift_to_drag)
        && MADE_WITH.drag.iter().all(|[altitude_m, drag_pm]| {
            let density_kgpm3 = model.atmosphere.density(f64::from(*altitude_m));
            is_near(model.constants().half_area_per_mass_m2pkg * drag * density_kgpm3, *drag_pm)
        })
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

    /// Range still flown from the state in which a prediction at this cosine of the bank ended, m: none where it was not
    /// the speed that ended it.
    #[must_use]
    #[inline(never)] // once in a prediction
    pub fn remainder_m(&self, state: &State, flown: &Adapted<'_>, cos_bank: f64) -> f64 {
        let &[x, y, z, vx, vy, vz] = state;
        let (r, v) = (Vec3::<PlanetFixed>::new(x, y, z), Vec3::<PlanetFixed>::new(vx, vy, vz));
        let (radius_m, speed_mps) = (r.norm(), v.norm());
        if speed_mps > f64::from(self.speed_mps) + CUT_MARGIN_MPS {
            return 0.0;
        }
        let path_angle_rad = asin(clamp(r.dot(&v) / max(radius_m * speed_mps, 1.0), -1.0, 1.0));
        let model = flown.model;
        let (drag, lift) = model.aero.coefficients(HYPERSONIC_MACH);
        let [_, [altitude_m, made_with_pm], _] = MADE_WITH.drag;
        let drag_pm =
            model.constants().half_area_per_mass_m2pkg * drag * flown.air.density_kgpm3(f64::from(altitude_m));
        // What carries is the upward part of the lift.
        let lift_ratio = lift / drag * flown.air.lift_to_drag() / f64::from(MADE_WITH.lift_to_drag);
        self.polynomial([
            radius_m - model.planet.radius_m,
            path_angle_rad,
            cos_bank * lift_ratio,
            ln(drag_pm / f64::from(made_with_pm)),
        ])
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
    use crate::guidance::air::AirProfile;
    use crate::guidance::predictor::{Prediction, Stop};
    use crate::model::parameters::{AtmosphereParameters, VehicleParameters};

    /// The onboard model that the tables were made with.
    fn model() -> OnboardModel {
        let c = Config::DEFAULT;
        let still = crate::planet::Planet { rotation_radps: 0.0, j2: 0.0, ..c.planet };
        OnboardModel::new(still, &c.vehicle, &[], &c.atmosphere, &[]).unwrap()
    }

    /// At a cut: this altitude and flight-path angle, at the speed of the segment and so much more.
    fn at_cut(segment: &Segment, altitude_m: f64, gamma: f64, faster_mps: f64) -> State {
        let (r, v) = PlanetRelative {
            radius_m: model().planet.radius_m + altitude_m,
            speed_mps: f64::from(segment.speed_mps) + faster_mps,
            flight_path_angle_rad: gamma,
            heading_rad: 1.5,
            ..PlanetRelative::default()
        }
        .to_cartesian();
        let ([x, y, z], [vx, vy, vz]) = (r.to_array(), v.to_array());
        [x, y, z, vx, vy, vz]
    }

    /// Flies from the cut to the trigger with the predictor: the great circle flown, m.
    fn flown_m(segment: &Segment, [h, gamma, u, rho]: [f64; 4]) -> f64 {
        let model = model();
        let still = model.planet;
        let state = at_cut(segment, h, gamma, 0.0);
        let [x, y, z, vx, vy, vz] = state;
        let (r, v) = (Vec3::<PlanetFixed>::new(x, y, z), Vec3::<PlanetFixed>::new(vx, vy, vz));
        let mut air = AirProfile::NONE;
        air.set_constant(&model, rho.exp());
        let flown = Adapted { model: &model, air: &air };
        let stop = Stop { speed_mps: 450.0, radius_m: still.radius_m, horizon_s: 900.0 };
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
    fn beyond_its_box_each_coordinate_of_the_table_holds_its_edge_and_inside_it_does_not() {
        let model = model();
        for segment in &SEGMENTS {
            let [(h, h_reach), (gamma, gamma_reach), (u, u_reach), (_, rho_reach)] =
                segment.validity.map(|(centre, reach)| (f64::from(centre), f64::from(reach)));
            let remainder_m = |share: [f64; 4]| {
                let [dh, dgamma, du, drho] = share;
                let mut air = AirProfile::NONE;
                air.set_constant(&model, (drho * rho_reach).exp());
                let state = at_cut(segment, h + dh * h_reach, gamma + dgamma * gamma_reach, 0.0);
                segment.remainder_m(&state, &Adapted { model: &model, air: &air }, u + du * u_reach)
            };
            for coordinate in 0..4 {
                let at = |share: f64| {
                    let mut shares = [0.0; 4];
                    shares[coordinate] = share;
                    remainder_m(shares)
                };
                for side in [-1.0, 1.0] {
                    assert!((at(side * 1.5) - at(side)).abs() < 2.0, "coordinate {coordinate}, side {side}");
                    assert!((at(side) - at(side * 0.7)).abs() > 100.0, "coordinate {coordinate}, side {side}");
                }
            }
        }
    }

    #[test]
    fn a_prediction_that_its_speed_did_not_end_has_no_remainder() {
        let model = model();
        let air = AirProfile::nominal(&model);
        for segment in &SEGMENTS {
            let h = f64::from(segment.validity[0].0);
            let remainder_m = |faster_mps| {
                let state = at_cut(segment, h, -0.1, faster_mps);
                segment.remainder_m(&state, &Adapted { model: &model, air: &air }, 0.7)
            };
            assert!(remainder_m(0.0) > 50e3 && remainder_m(-5.0) > 50e3);
            assert_eq!(remainder_m(2.0), 0.0);
        }
    }

    #[test]
    fn the_table_holds_for_models_near_its_own_and_for_no_other() {
        let c = Config::DEFAULT;
        let of = |vehicle: VehicleParameters, air: AtmosphereParameters, trigger_mps: f64| {
            table_holds(&OnboardModel::new(c.planet, &vehicle, &[], &air, &[]).unwrap(), trigger_mps)
        };
        let (vehicle, air) = (c.vehicle, c.atmosphere);
        assert!(of(vehicle, air, 450.0));
        assert!(of(VehicleParameters { mass_kg: 1.05 * vehicle.mass_kg, ..vehicle }, air, 455.0));
        assert!(!of(vehicle, air, 430.0), "another trigger");
        assert!(!of(VehicleParameters { mass_kg: 1500.0, ..vehicle }, air, 450.0), "a light vehicle");
        let lift = VehicleParameters { lift_to_drag: 0.40, ..vehicle };
        assert!(!of(lift, air, 450.0), "more lift");
        assert!(!of(vehicle, AtmosphereParameters { scale_height_m: 7500.0, ..air }, 450.0), "thinner air above");
        assert!(!of(vehicle, air, f64::NAN));
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
