//! One flight of a campaign: truth, whole link and flight computer as in `fly`, without a recording.
//!
//! Every packet is encoded, checked and decoded once in each direction; what `fly` hears from a tap on the line, the
//! observer takes from the truth itself. Flights with ideal navigation, which are not about the link, hand the same
//! packets over as values: see [`super::direct`].

use fsw_core::executive::{Executive, FlightComputer};
use hil_sim::case::Case;
use hil_sim::scenario::Scenario;
use hil_sim::session::{self, Conductor, Plan};
use hil_sim::truth::Truth;

use super::direct;
use super::observer::{Flown, Observer};
use crate::ends::BUILD_ID;
use crate::error::HostError;
use crate::record::{End, ScenarioFacts};

/// Exchanges in a row in which neither end says anything before the flight counts as dead.
const MAX_SILENT_EXCHANGES: u32 = 1_000;

/// Room for flights, one after the other.
pub struct Flyer {
    executive: Box<Executive>,
    computer: Box<FlightComputer>,
    up: Vec<u8>,
    down: Vec<u8>,
}

impl Default for Flyer {
    fn default() -> Self {
        Self {
            executive: Box::new(Executive::new()),
            computer: Box::new(FlightComputer::new(BUILD_ID)),
            up: Vec::with_capacity(4_096),
            down: Vec::with_capacity(4_096),
        }
    }
}

impl Flyer {
    /// Flies a case of a scenario.
    ///
    /// # Errors
    /// The flight software cannot be told the scenario.
    pub fn fly(
        &mut self,
        scenario: &Scenario,
        facts: &ScenarioFacts,
        case: &Case,
        grid_mps: &[f64],
    ) -> Result<Flown, HostError> {
        let noise = case.noise.stream("uplink faults");
        let plan = Plan { truth_tap: false, ..Plan::new(scenario, case.knowledge, noise) };
        let mut observer = Observer::new(facts, grid_mps);
        if direct::is_possible(scenario) {
            let mut truth = Truth::new(case);
            let end = direct::fly(&mut self.executive, &mut truth, &plan, &mut observer)?;
            return Ok(observer.finish(&end, &truth));
        }
        let mut conductor = Conductor::with_plant(Truth::new(case), plan)?;
        *self.computer = FlightComputer::new(BUILD_ID);
        let end = self.exchange(&mut conductor, &mut observer, scenario.time_limit_s);
        Ok(observer.finish(&end, conductor.plant()))
    }

    /// Carries bytes until the flight is over.
    fn exchange(&mut self, conductor: &mut Conductor, observer: &mut Observer<'_>, time_limit_s: f64) -> End {
        let (mut silent, mut frame) = (0, 0);
        loop {
            self.up.clear();
            conductor.transmit(&mut self.up);
            if self.up.is_empty() && conductor.finished().is_none() {
                conductor.timeout();
                conductor.transmit(&mut self.up);
            }
            if let Some(end) = conductor.finished() {
                return end_of(end);
            }
            let truth = conductor.plant();
            if truth.frame() != frame {
                frame = truth.frame();
                observer.frame(truth);
                if truth.altitude_m() <= 0.0 {
                    return End::Ground;
                }
                if truth.time().as_s() >= time_limit_s {
                    return End::TimeLimit;
                }
            }
            self.down.clear();
            let down = &mut self.down;
            self.computer.receive(&self.up, |bytes| down.extend_from_slice(bytes));
            conductor.receive_heard(&self.down, |packet, truth| observer.hear(packet, truth));
            if observer.deployed() {
                return End::Deployed;
            }
            silent = if self.up.is_empty() && self.down.is_empty() { silent + 1 } else { 0 };
            if silent > MAX_SILENT_EXCHANGES {
                return End::Failed("both ends of the link fell silent".into());
            }
        }
    }
}

fn end_of(end: &session::End) -> End {
    match end {
        session::End::Deployed => End::Deployed,
        session::End::Ground => End::Ground,
        session::End::TimeLimit => End::TimeLimit,
        session::End::Failed(error) => End::Failed(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::columns::Columns;

    #[test]
    fn a_run_of_a_campaign_is_the_flight_that_fly_flies() {
        // The fault sends the second flight with ideal navigation over the link, and strikes nothing.
        let fault = "fault=[{kind=\"dropout\",target=\"uplink\",start_s=900.0,duration_s=1.0}]";
        for (name, sets) in [("msl", vec![]), ("msl-ideal", vec![]), ("msl-ideal", vec![fault.to_owned()])] {
            let scenario = Scenario::resolve(name, &sets).unwrap();
            assert_eq!(direct::is_possible(&scenario), name == "msl-ideal" && sets.is_empty());
            let facts = ScenarioFacts::of(&scenario);
            let columns = Columns::of(&scenario, &facts);
            let case = Case::draw(&scenario, 6, 11, false);
            let flown = Flyer::default().fly(&scenario, &facts, &case, &columns.grid_mps).unwrap();
            let whole = crate::fly::fly_in_process(&scenario, 6, 11, false).unwrap().summary;
            assert_eq!((flown.miss_m, flown.deploy), (whole.miss_m, whole.deploy), "{name}");
            assert_eq!((flown.reversals, flown.frames), (whole.reversals, whole.frames), "{name}");
            assert_eq!(flown.work.max_evaluations, whole.corrector.max_integrations, "{name}");
            assert_eq!(flown.position_error_m, whole.navigation.position_error_m, "{name}");
            assert_eq!(flown.nees_mean, whole.navigation.nees_mean, "{name}");
            assert_eq!(flown.output_hash, Some(whole.output_hash), "{name}");
            assert_eq!((flown.reason, flown.outcome), (whole.reason, whole.outcome.as_str()), "{name}");
            // `fly` takes the load from differences of the velocity, a trapezoid over the frame.
            assert!((flown.peak.load_g - whole.peak.load_g).abs() < 1e-5, "{name}");
            assert!((flown.peak.heat_flux_wpm2 / whole.peak.heat_flux_wpm2 - 1.0).abs() < 1e-9, "{name}");
        }
    }
}
