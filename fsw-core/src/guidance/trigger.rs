//! Parachute trigger: ((trigger OR lowest altitude of the box) AND deploy limits) OR altitude below the floor.
//!
//! Which limits of the deploy box hold a trigger back? Those that falling on heals: the upper limits of altitude, Mach
//! number and dynamic pressure (a canopy opened above them may fail; the vehicle slows and sinks out of them). The lower
//! limits do not: once speed, Mach or altitude is too low, every further second makes it worse, so the parachute fires
//! and the summary of the flight says that the box was missed. For the same reason a vehicle that sinks to the lowest altitude
//! of the box does not wait for its trigger: it opens there, inside the box. The floor fires whatever else holds.

use crate::frames::{PlanetFixed, Vec3};
use crate::link::packet::DeployCause;
use crate::link::parameters::{DeployParameters, TriggerKind};
use crate::math::num::{max, min};
use crate::model::OnboardModel;
use crate::model::loads::dynamic_pressure_pa;
use crate::nav::Estimate;

use super::GuidanceContext;
use super::{density, felt};

/// So far above the lowest altitude of the box the parachute opens at the latest, m: with an orbiter alone, navigation is
/// not sure of its altitude by about as much.
const BOX_FLOOR_MARGIN_M: f64 = 100.0;

/// Planet-relative speed at which the speed trigger is to be expected, m/s: its own, or, in cold air, the slower one at which
/// the Mach number no longer holds it back in the middle of the deploy box.
#[must_use]
#[inline(never)] // of use in a few places
pub fn expected_speed_mps(deploy: &DeployParameters, model: &OnboardModel) -> f64 {
    let altitude_m = 0.5 * (deploy.min_altitude_m + deploy.max_altitude_m);
    min(deploy.speed_mps, deploy.max_mach * model.atmosphere.speed_of_sound_mps(altitude_m))
}

/// What the trigger looks at, all of it estimated on board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriggerState {
    /// Position, planet-fixed, m.
    pub r_p: Vec3<PlanetFixed>,
    /// Planet-relative velocity, planet-fixed axes, m/s.
    pub v_p: Vec3<PlanetFixed>,
    /// Altitude over the reference sphere, m.
    pub altitude_m: f64,
    /// Mach number of the planet-relative speed.
    pub mach: f64,
    /// Dynamic pressure of the planet-relative speed, Pa.
    pub dynamic_pressure_pa: f64,
}

impl TriggerState {
    /// What the trigger looks at, from the estimate and the onboard model. The dynamic pressure is that felt: in thin air the
    /// modelled one would hold the parachute back until the floor.
    #[must_use]
    pub fn of(estimate: &Estimate, model: &OnboardModel) -> Self {
        let (altitude_m, speed_mps) = (estimate.altitude_m, estimate.speed_mps);
        let density_kgpm3 = model.atmosphere.density(altitude_m) * density::ratio(estimate);
        let mach = model.mach(altitude_m, speed_mps);
        let modelled_pa = dynamic_pressure_pa(density_kgpm3, speed_mps);
        let dynamic_pressure_pa = felt::dynamic_pressure_pa(estimate, model, mach, modelled_pa);
        Self { r_p: estimate.r_p, v_p: estimate.v_p, altitude_m, mach, dynamic_pressure_pa }
    }
}

/// Decides from the navigation estimate whether the parachute fires in this frame; see [`decide`].
#[must_use]
pub fn evaluate(estimate: &Estimate, context: &GuidanceContext<'_>) -> Option<DeployCause> {
    let deploy = context.deploy;
    let soon = estimate.altitude_m <= max(deploy.floor_altitude_m, deploy.min_altitude_m + BOX_FLOOR_MARGIN_M)
        || estimate.speed_mps <= max(deploy.speed_mps, deploy.window_max_speed_mps);
    // For most of the flight one look is enough. Written so that what is not a number is looked at closely.
    if !soon && estimate.altitude_m.is_finite() && estimate.speed_mps.is_finite() {
        return None;
    }
    let state = TriggerState::of(estimate, context.model);
    decide(&state, &context.target_p(), context.trigger, deploy)
}

/// Decides whether the parachute fires now. `target_p` is the direction of the target, planet-fixed.
///
/// * Speed trigger: planet-relative speed at or below `speed_mps`.
/// * Range trigger: the component of the vector to the target along the ground velocity has reached zero and the speed
///   is at or below `window_max_speed_mps`; above the window it waits, at `window_min_speed_mps` it fires wherever it is.
///
/// A state that is not finite fires nothing: neither trigger nor floor can be read from it. An estimate that is merely
/// doubtful is still used, because a parachute that never opens loses the vehicle for certain.
#[must_use]
pub fn decide(
    state: &TriggerState,
    target_p: &Vec3<PlanetFixed>,
    kind: TriggerKind,
    deploy: &DeployParameters,
) -> Option<DeployCause> {
    if !(state.r_p.is_finite() && state.v_p.is_finite() && state.altitude_m.is_finite()) {
        return None;
    }
    if state.altitude_m <= deploy.floor_altitude_m {
        return Some(DeployCause::Floor);
    }
    let held_back = state.altitude_m > deploy.max_altitude_m
        || state.mach > deploy.max_mach
        || state.dynamic_pressure_pa > deploy.max_dynamic_pressure_pa;
    if held_back {
        None
    } else if let Some(cause) = triggered(state, target_p, kind, deploy) {
        Some(cause)
    } else {
        (state.altitude_m <= deploy.min_altitude_m + BOX_FLOOR_MARGIN_M).then_some(DeployCause::BoxFloor)
    }
}

/// The trigger alone, without limits.
fn triggered(
    state: &TriggerState,
    target_p: &Vec3<PlanetFixed>,
    kind: TriggerKind,
    deploy: &DeployParameters,
) -> Option<DeployCause> {
    let speed = state.v_p.norm();
    match kind {
        TriggerKind::Speed => (speed <= deploy.speed_mps).then_some(DeployCause::Trigger),
        TriggerKind::Range if speed <= deploy.window_min_speed_mps => Some(DeployCause::MinimumSpeed),
        TriggerKind::Range => {
            let abeam = speed <= deploy.window_max_speed_mps && is_abeam(&state.r_p, &state.v_p, target_p);
            abeam.then_some(DeployCause::Trigger)
        }
    }
}

/// True when the target no longer lies ahead: its direction has no forward component along the ground velocity.
fn is_abeam(r_p: &Vec3<PlanetFixed>, v_p: &Vec3<PlanetFixed>, target_p: &Vec3<PlanetFixed>) -> bool {
    let Some(up) = r_p.unit() else { return false };
    let ground_velocity = *v_p - up * up.dot(v_p);
    target_p.dot(&ground_velocity) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{PlanetRelative, surface_point};
    use crate::units::rad;

    const DEPLOY: DeployParameters = DeployParameters {
        speed_mps: 450.0,
        window_min_speed_mps: 400.0,
        window_max_speed_mps: 500.0,
        floor_altitude_m: 4e3,
        min_altitude_m: 5e3,
        max_altitude_m: 13e3,
        min_mach: 1.1,
        max_mach: 2.2,
        min_dynamic_pressure_pa: 300.0,
        max_dynamic_pressure_pa: 900.0,
    };

    #[test]
    fn in_cold_air_the_speed_to_expect_is_that_of_the_mach_limit() {
        let config = crate::config::Config::DEFAULT;
        let model = OnboardModel::new(config.planet, &config.vehicle, &[], &config.atmosphere, &[]).unwrap();
        assert_eq!(expected_speed_mps(&DEPLOY, &model), 450.0);
        let cold = DeployParameters { max_mach: 1.8, ..DEPLOY };
        let expected = expected_speed_mps(&cold, &model);
        assert!(expected < 450.0 && (model.mach(9e3, expected) - 1.8).abs() < 1e-12, "{expected}");
    }

    /// Flying east at the equator, the target `ahead_m` further east.
    fn state(speed_mps: f64, ahead_m: f64) -> (TriggerState, Vec3<PlanetFixed>) {
        let (r_p, v_p) = PlanetRelative {
            radius_m: 3_405_200.0,
            speed_mps,
            flight_path_angle_rad: rad(-25.0),
            heading_rad: rad(90.0),
            ..PlanetRelative::default()
        }
        .to_cartesian();
        let target = surface_point(ahead_m / 3_397_200.0, 0.0);
        (TriggerState { r_p, v_p, altitude_m: 8e3, mach: 1.9, dynamic_pressure_pa: 600.0 }, target)
    }

    fn fires(kind: TriggerKind, s: &(TriggerState, Vec3<PlanetFixed>)) -> Option<DeployCause> {
        decide(&s.0, &s.1, kind, &DEPLOY)
    }

    #[test]
    fn the_speed_trigger_fires_at_its_speed() {
        assert_eq!(fires(TriggerKind::Speed, &state(450.1, 1e3)), None);
        assert_eq!(fires(TriggerKind::Speed, &state(449.99, 1e3)), Some(DeployCause::Trigger));
    }

    #[test]
    fn the_range_trigger_fires_abeam_of_the_target_inside_its_window() {
        assert_eq!(fires(TriggerKind::Range, &state(450.0, 10.0)), None);
        assert_eq!(fires(TriggerKind::Range, &state(450.0, -10.0)), Some(DeployCause::Trigger));
        assert_eq!(fires(TriggerKind::Range, &state(510.0, -10.0)), None);
        assert_eq!(fires(TriggerKind::Range, &state(400.0, 5e3)), Some(DeployCause::MinimumSpeed));
    }

    #[test]
    fn upper_limits_hold_the_trigger_back_and_lower_limits_do_not() {
        let (s, target) = state(440.0, 0.0);
        let with = |change: fn(&mut TriggerState)| {
            let mut changed = s;
            change(&mut changed);
            decide(&changed, &target, TriggerKind::Speed, &DEPLOY)
        };
        assert_eq!(with(|s| s.altitude_m = 13.1e3), None);
        assert_eq!(with(|s| s.mach = 2.3), None);
        assert_eq!(with(|s| s.dynamic_pressure_pa = 901.0), None);
        for fired in [with(|s| s.altitude_m = 4.5e3), with(|s| s.mach = 1.0), with(|s| s.dynamic_pressure_pa = 250.0)] {
            assert_eq!(fired, Some(DeployCause::Trigger));
        }
    }

    #[test]
    fn at_the_lowest_altitude_of_the_box_the_parachute_opens_if_the_limits_allow_it() {
        let (s, target) = state(455.0, 2e3);
        for kind in [TriggerKind::Speed, TriggerKind::Range] {
            let at = |altitude_m, mach| decide(&TriggerState { altitude_m, mach, ..s }, &target, kind, &DEPLOY);
            assert_eq!(at(5.101e3, 2.15), None);
            assert_eq!(at(5.1e3, 2.15), Some(DeployCause::BoxFloor));
            assert_eq!(at(4.8e3, 2.25), None);
        }
    }

    #[test]
    fn the_floor_fires_whatever_the_speed_and_limits() {
        let (mut s, target) = state(1200.0, 50e3);
        s.altitude_m = 3.9e3;
        s.mach = 5.0;
        s.dynamic_pressure_pa = 5e3;
        for kind in [TriggerKind::Speed, TriggerKind::Range] {
            assert_eq!(decide(&s, &target, kind, &DEPLOY), Some(DeployCause::Floor));
        }
    }

    #[test]
    fn a_state_that_is_not_finite_fires_nothing() {
        let (mut s, target) = state(300.0, 0.0);
        s.altitude_m = f64::NAN;
        assert_eq!(decide(&s, &target, TriggerKind::Speed, &DEPLOY), None);
        // An unreadable Mach number or pressure cannot hold the parachute back.
        s.altitude_m = 8e3;
        s.mach = f64::NAN;
        assert_eq!(decide(&s, &target, TriggerKind::Speed, &DEPLOY), Some(DeployCause::Trigger));
    }
}
