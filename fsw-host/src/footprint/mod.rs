//! `footprint`: what a vehicle can reach from its entry, and how steep or shallow that entry may be.
//!
//! The rim is flown with constant bank, from full lift up over both sides to full lift down; the inside with one reversal
//! at some speed. The corridor is that of the entry flight-path angles from which the target is reached as it should be.

mod corridor;
mod flight;
mod page;

use std::fmt::Write as _;

use fsw_core::units::rad;
use hil_sim::case::Case;
use hil_sim::scenario::Scenario;
use rayon::prelude::*;
use serde::Serialize;

pub use corridor::{Aimed, Slice, open_range};
pub use flight::{Course, Reached};

use crate::cli::FootprintArgs;
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::record::ScenarioFacts;
use crate::runfolder::{is_special, write_whole};

/// Spacing of the banks of the rim, deg.
const RIM_DEG: i32 = 5;
/// Spacing of the banks of the inside, deg, and the speeds at which they change sides, as shares of the entry speed.
const INSIDE_DEG: i32 = 15;
const REVERSALS: [f64; 6] = [0.85, 0.7, 0.55, 0.4, 0.3, 0.2];

/// What can be reached.
#[derive(Clone, Debug, Serialize)]
pub struct Footprint {
    /// Scenario.
    pub scenario: String,
    /// Constant banks, deg, and where they lead; in order around the rim.
    pub rim: Vec<(f64, Option<Reached>)>,
    /// Where flights with one reversal lead.
    pub inside: Vec<Reached>,
    /// Whether the target lies within the rim.
    pub target_inside: bool,
    /// How far beyond the target full lift up leads, m.
    pub margin_beyond_m: Option<f64>,
    /// How far before the target full lift down leads, m.
    pub margin_before_m: Option<f64>,
    /// The corridor.
    pub corridor: Vec<Slice>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a page that cannot be written.
pub fn run(args: &FootprintArgs) -> Result<bool, HostError> {
    let scenario = Scenario::resolve(&args.scenario, &args.common.set)?;
    if let Some(out) = &args.out
        && out.exists()
        && !args.force
        && !is_special(out)
    {
        return Err(HostError::FileExists(out.clone()));
    }
    let facts = ScenarioFacts::of(&scenario);
    let footprint = of(&scenario, &facts);
    if let Some(out) = &args.out {
        let page = page::html(&footprint, &facts).map_err(|e| HostError::Option(e.to_string()))?;
        write_whole(out, |file| std::io::Write::write_all(file, page.as_bytes()))?;
    }
    if args.common.json {
        print_json(&footprint)?;
    } else if !args.common.quiet {
        print(&text(&footprint))?;
        print(&match &args.out {
            Some(out) => format!("  plots   {}\n", out.display()),
            None => "  plots   with --out FILE.html\n".to_owned(),
        })?;
    }
    Ok(true)
}

/// The footprint of a scenario's nominal entry.
#[must_use]
pub fn of(scenario: &Scenario, facts: &ScenarioFacts) -> Footprint {
    let case = Case::draw(scenario, 0, 0, true);
    let course = Course { world: &case.world, facts, time_limit_s: scenario.time_limit_s };
    let banks: Vec<i32> = (-180 / RIM_DEG..180 / RIM_DEG).map(|k| k * RIM_DEG).collect();
    let rim: Vec<(f64, Option<Reached>)> = banks
        .into_par_iter()
        .map(|bank| (f64::from(bank), course.fly(&case.entry, |_| rad(f64::from(bank)))))
        .collect();
    let entry_mps = case.entry.planet_relative(0.0, &case.world.planet).speed_mps;
    let histories: Vec<(f64, f64)> = (1..180 / INSIDE_DEG)
        .flat_map(|k| [k * INSIDE_DEG, -k * INSIDE_DEG])
        .flat_map(|bank| REVERSALS.map(|share| (rad(f64::from(bank)), share * entry_mps)))
        .collect();
    let inside = histories
        .into_par_iter()
        .filter_map(|(bank, at)| course.fly(&case.entry, |speed| if speed > at { bank } else { -bank }))
        .collect();
    let at = |bank: f64| rim.iter().find(|(b, _)| *b == bank).and_then(|(_, reached)| *reached);
    Footprint {
        scenario: scenario.name.clone(),
        target_inside: holds_target(&rim),
        margin_beyond_m: at(0.0).map(|r| r.downrange_m),
        margin_before_m: at(-180.0).map(|r| -r.downrange_m),
        inside,
        corridor: corridor::of(scenario, facts),
        rim,
    }
}

/// Whether the origin lies within the closed rim, by the number of crossings of a ray.
fn holds_target(rim: &[(f64, Option<Reached>)]) -> bool {
    let corners: Vec<(f64, f64)> = rim.iter().filter_map(|(_, r)| r.map(|r| (r.downrange_m, r.crossrange_m))).collect();
    let next = corners.iter().cycle().skip(1);
    let crossings = corners
        .iter()
        .zip(next)
        .filter(|((x0, y0), (x1, y1))| (*y0 > 0.0) != (*y1 > 0.0) && x0 + (x1 - x0) * (-y0) / (y1 - y0) > 0.0);
    crossings.count() % 2 == 1
}

fn text(footprint: &Footprint) -> String {
    let mut out = String::new();
    let inside = if footprint.target_inside { "inside" } else { "OUTSIDE" };
    let _ = writeln!(out, "\n{}: the target lies {inside} the footprint of constant banks", footprint.scenario);
    let km = |m: Option<f64>| m.map_or_else(|| "–".to_owned(), |m| format!("{:+.1}", m * 1e-3));
    let _ = writeln!(out, "  full lift up leads {} km beyond it", km(footprint.margin_beyond_m));
    let _ = writeln!(out, "  full lift down leads {} km before it", km(footprint.margin_before_m));
    let head = "\n   bank, deg   downrange, km   crossrange, km   altitude, km   peak load, g";
    let _ = writeln!(out, "{head}");
    for (bank, reached) in footprint.rim.iter().filter(|(bank, _)| bank % 15.0 == 0.0) {
        match reached {
            Some(r) => {
                let (down, cross, high) = (r.downrange_m * 1e-3, r.crossrange_m * 1e-3, r.altitude_m * 1e-3);
                let _ = writeln!(out, "  {bank:>10.0}{down:>16.2}{cross:>17.2}{high:>15.2}{:>15.2}", r.peak.load_g);
            }
            None => {
                let _ = writeln!(out, "  {bank:>10.0}   not down at the time limit");
            }
        }
    }
    match open_range(&footprint.corridor) {
        Some((low, high)) => {
            let _ = writeln!(out, "\n  entry corridor: flight-path angles from {low:.2} to {high:.2} deg");
        }
        None => {
            let _ = writeln!(out, "\n  entry corridor: closed");
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footprint(name: &str, sets: &[&str]) -> Footprint {
        let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
        let scenario = Scenario::resolve(name, &sets).unwrap();
        of(&scenario, &ScenarioFacts::of(&scenario))
    }

    #[test]
    fn the_default_target_lies_inside_with_room_on_all_sides() {
        let f = footprint("msl", &[]);
        assert!(f.target_inside);
        assert!(f.margin_beyond_m.unwrap() > 50e3 && f.margin_before_m.unwrap() > 50e3);
        let (low, high) = open_range(&f.corridor).unwrap();
        assert!(low < -14.15 && high > -14.15);
        // Shallower than the corridor the target is still in reach, but the parachute opens too low.
        let first_closed = f.corridor.iter().find(|slice| slice.flight_path_angle_deg > high).unwrap();
        assert!(first_closed.to_target.unwrap().reached.altitude_m < 5e3);
        for slice in f.corridor.iter().filter(|slice| slice.open) {
            assert!(slice.to_target.unwrap().reached.downrange_m.abs() < 200.0, "{slice:?}");
        }
        // Right banks lead to the right; one reversal leads back inside.
        let crossrange = |bank: f64| f.rim.iter().find(|(b, _)| *b == bank).unwrap().1.unwrap().crossrange_m;
        assert!(crossrange(60.0) > crossrange(-60.0) + 20e3);
        let widest = f.rim.iter().filter_map(|(_, r)| r.map(|r| r.crossrange_m.abs())).fold(0.0, f64::max);
        assert!(f.inside.iter().all(|r| r.crossrange_m.abs() < widest));
    }

    #[test]
    fn a_target_too_far_lies_outside() {
        assert!(!footprint("msl", &["target.longitude_deg=-66.0", "target.latitude_deg=-39.9"]).target_inside);
    }

    #[test]
    fn a_constant_bank_ends_where_the_open_loop_propagation_ends() {
        let scenario = Scenario::builtin("msl").unwrap();
        let (facts, case) = (ScenarioFacts::of(&scenario), Case::draw(&scenario, 0, 0, true));
        let course = Course { world: &case.world, facts: &facts, time_limit_s: scenario.time_limit_s };
        let reached = course.fly(&case.entry, |_| rad(42.0)).unwrap();
        let stop = hil_sim::propagate::Until::SpeedMps(facts.deploy.speed_mps);
        let exact = hil_sim::propagate::propagate(&case.world, &case.entry, rad(42.0), stop, 1000.0, 1000.0).end;
        assert!((reached.time_s - exact.time_s).abs() < 2e-3, "{} {}", reached.time_s, exact.time_s);
        assert!((reached.altitude_m - exact.altitude_m).abs() < 1.0);
    }
}
