//! The entry corridor: flight-path angles from which some constant bank ends at the target's distance, inside the deploy
//! box and within the limits of load, heat flux and dynamic pressure.

use std::f64::consts::PI;

use fsw_core::planet::STANDARD_GRAVITY_MPS2;
use fsw_core::units::{deg, rad};
use hil_sim::case::Case;
use hil_sim::dynamics::Motion;
use hil_sim::scenario::Scenario;
use rayon::prelude::*;
use serde::Serialize;

use super::flight::{Course, Reached};
use crate::record::{Peak, ScenarioFacts};

/// Entry flight-path angles about the nominal one: their reach, deg, and their number on either side.
const REACH_DEG: f64 = 3.0;
const STEPS: i32 = 30;
/// Halvings of the range of banks; the last one moves the end of the path by metres.
const HALVINGS: u32 = 18;

/// The corridor at one entry flight-path angle.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Slice {
    /// Entry flight-path angle, deg.
    pub flight_path_angle_deg: f64,
    /// Full lift up; none when it skips out or is still flying at the time limit.
    pub lift_up: Option<Reached>,
    /// Full lift down.
    pub lift_down: Option<Reached>,
    /// The bank to the target; none when it lies beyond lift up or before lift down.
    pub to_target: Option<Aimed>,
    /// That bank ends inside the altitudes of the deploy box and keeps the limits.
    pub open: bool,
}

/// A constant bank that ends at the target's distance.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Aimed {
    /// The bank, deg.
    pub bank_deg: f64,
    /// Where and how it ends.
    pub reached: Reached,
}

/// The corridor of a scenario.
#[must_use]
pub fn of(scenario: &Scenario, facts: &ScenarioFacts) -> Vec<Slice> {
    let slice = |k: i32| {
        let off_deg = REACH_DEG * f64::from(k) / f64::from(STEPS);
        let mut case = Case::draw(scenario, 0, 0, true);
        let planet = case.world.planet;
        let mut state = case.entry.planet_relative(0.0, &planet);
        state.flight_path_angle_rad += rad(off_deg);
        case.entry = Motion::at_epoch(&state, &planet);
        let course = Course { world: &case.world, facts, time_limit_s: scenario.time_limit_s };
        let (lift_up, lift_down) = (course.fly(&case.entry, |_| 0.0), course.fly(&case.entry, |_| PI));
        // Lift up that skips out reaches any distance.
        let lies_between =
            lift_up.is_none_or(|r| r.downrange_m >= 0.0) && lift_down.is_some_and(|r| r.downrange_m <= 0.0);
        let to_target = lies_between.then(|| aim(&course, &case.entry)).flatten();
        let box_m = facts.deploy.min_altitude_m..=facts.deploy.max_altitude_m;
        let open = to_target.is_some_and(|a| box_m.contains(&a.reached.altitude_m) && is_kept(facts, &a.reached.peak));
        Slice { flight_path_angle_deg: deg(state.flight_path_angle_rad), lift_up, lift_down, to_target, open }
    };
    (-STEPS..=STEPS).into_par_iter().map(slice).collect()
}

/// The bank to the target between lift up, which leads beyond it, and lift down, which leads before it.
fn aim(course: &Course<'_>, entry: &Motion) -> Option<Aimed> {
    let (mut beyond_rad, mut before_rad) = (0.0, PI);
    for _ in 0..HALVINGS {
        let bank_rad = 0.5 * (beyond_rad + before_rad);
        if course.fly(entry, |_| bank_rad).is_none_or(|r| r.downrange_m >= 0.0) {
            beyond_rad = bank_rad;
        } else {
            before_rad = bank_rad;
        }
    }
    course.fly(entry, |_| before_rad).map(|reached| Aimed { bank_deg: deg(before_rad), reached })
}

fn is_kept(facts: &ScenarioFacts, peak: &Peak) -> bool {
    let limits = &facts.constraints;
    peak.load_g * STANDARD_GRAVITY_MPS2 <= limits.load_mps2
        && peak.heat_flux_wpm2 <= limits.heat_flux_wpm2
        && peak.dynamic_pressure_pa <= limits.dynamic_pressure_pa
}

/// The open part of the corridor, deg.
#[must_use]
pub fn open_range(corridor: &[Slice]) -> Option<(f64, f64)> {
    let open = || corridor.iter().filter(|slice| slice.open).map(|slice| slice.flight_path_angle_deg);
    open().next().zip(open().next_back())
}
