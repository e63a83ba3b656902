//! Whether the target of a scenario is anywhere near what its vehicle can reach.
//!
//! Two open-loop flights bracket the range: lift up all the way and lift down all the way, to the floor altitude. Only
//! what lies far outside is refused; a target somewhat out of reach is a flight worth flying, and the flight software
//! says so itself.

use core::f64::consts::PI;

use fsw_core::frames::{great_circle_rad, initial_azimuth_rad, surface_point};
use fsw_core::units::{deg, rad};

use crate::angle::wrap_rad;
use crate::case::Case;
use crate::propagate::{Until, propagate};
use crate::scenario::{Scenario, ScenarioError};

/// The bracket is widened by this fraction of itself: winds, dispersions and banks in between.
const MARGIN: f64 = 0.25;
/// Largest angle between the entry heading and the way to the target, deg. A capsule turns by a few degrees.
const MAX_OFF_HEADING_DEG: f64 = 30.0;

impl Scenario {
    /// Refuses a target that no flight of this vehicle could come near. For flights to a target; an open-loop
    /// propagation has none.
    ///
    /// # Errors
    /// The sentence, with the distance and what can be reached.
    pub fn check_reach(&self) -> Result<(), ScenarioError> {
        let case = Case::draw(self, 0, 0, true);
        let planet = case.world.planet;
        let start = self.entry.planet_relative(&planet);
        let from = surface_point(start.longitude_rad, start.latitude_rad);
        let to = surface_point(rad(self.target.longitude_deg), rad(self.target.latitude_deg));
        let distance_km = planet.radius_m * great_circle_rad(&from, &to) * 1e-3;
        let refuse = |why: String| Err(ScenarioError { message: format!("target: out of reach: {why}") });

        let off_deg = deg(wrap_rad(initial_azimuth_rad(&from, &to) - start.heading_rad)).abs();
        if off_deg > MAX_OFF_HEADING_DEG {
            return refuse(format!(
                "it lies {off_deg:.0} degrees off the entry heading, where at most {MAX_OFF_HEADING_DEG} can be flown"
            ));
        }
        let range_km = |bank_rad: f64| {
            let stop = Until::AltitudeM(self.deploy.floor_altitude_km * 1e3);
            let flight = propagate(&case.world, &case.entry, bank_rad, stop, self.time_limit_s, self.time_limit_s);
            (flight.reached, flight.end.range_m * 1e-3)
        };
        let (comes_down, farthest_km) = range_km(0.0);
        let (dives, nearest_km) = range_km(PI);
        let (low, high) = (nearest_km * (1.0 - MARGIN), farthest_km * (1.0 + MARGIN));
        // A flight that skips out with its lift up can be made as long as one likes.
        if distance_km < low || (comes_down && distance_km > high) {
            let reached = match (dives, comes_down) {
                (true, true) => format!("reaches {nearest_km:.0} to {farthest_km:.0} km"),
                (true, false) => format!("reaches {nearest_km:.0} km and more"),
                (false, _) => format!("is not down after {nearest_km:.0} km and {} s", self.time_limit_s),
            };
            return refuse(format!("it lies {distance_km:.0} km from the entry point, and this entry {reached}"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(sets: &[&str]) -> Result<(), String> {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        Scenario::resolve("msl", &sets).unwrap().check_reach().map_err(|e| e.message)
    }

    #[test]
    fn every_builtin_target_is_within_reach() {
        for name in Scenario::builtin_names() {
            assert_eq!(Scenario::builtin(name).unwrap().check_reach(), Ok(()));
        }
    }

    #[test]
    fn a_target_far_beyond_short_of_or_behind_the_entry_is_refused_with_the_reason() {
        let far = check(&["target.longitude_deg=10"]).unwrap_err();
        assert!(far.starts_with("target: out of reach: it lies ") && far.contains(" off the entry heading"), "{far}");
        let beyond = check(&["target.longitude_deg=-40", "target.latitude_deg=-35"]).unwrap_err();
        assert!(beyond.contains(" km from the entry point, and this entry reaches "), "{beyond}");
        let short = check(&["target.longitude_deg=-87", "target.latitude_deg=-43.6"]).unwrap_err();
        assert!(short.contains(" km from the entry point, and this entry reaches "), "{short}");
        let climbing = check(&["entry.flight_path_angle_deg=5"]).unwrap_err();
        assert!(climbing.contains("this entry is not down after ") && climbing.ends_with(" 1000 s"), "{climbing}");
        assert!(check(&["target.longitude_deg=-100"]).unwrap_err().contains(" off the entry heading"));
    }
}
