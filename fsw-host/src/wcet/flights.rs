//! The hard flights: what the cost of the flight software is measured on.

use std::path::Path;

use fsw_core::link::parameters::{GuidanceMode, MAX_AERO_ROWS, MAX_ATMOSPHERE_ROWS};
use hil_sim::scenario::Scenario;

use crate::error::HostError;
use crate::recorder::FlightId;

/// One flight of the set.
#[derive(Clone, Debug)]
pub struct HardFlight {
    /// Its name in the table.
    pub name: String,
    /// What is flown.
    pub scenario: Scenario,
    /// Which draw of its dispersions.
    pub id: FlightId,
    /// What its predictions fly.
    pub predicts: Predicts,
}

/// What predictions fly: the cost of an evaluation of the equations of motion is stated for each apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Predicts {
    /// The default models (exponential air, constant coefficients), a rehearsal of the flight: mode `aeroshell`.
    Rehearsed,
    /// The default models, a held bank: the other modes.
    Held,
    /// Tables of air and coefficients, in any mode.
    InTables,
}

impl Predicts {
    fn of(scenario: &Scenario) -> Self {
        let onboard = &scenario.onboard;
        if onboard.atmosphere.rows.is_some() || onboard.vehicle.aero_table.is_some() {
            Self::InTables
        } else if scenario.guidance.mode == GuidanceMode::Aeroshell {
            Self::Rehearsed
        } else {
            Self::Held
        }
    }
}

impl HardFlight {
    /// A flight of a scenario with fields set, without dispersions.
    ///
    /// # Errors
    /// The scenario is wrong.
    pub fn new(name: &str, scenario: &str, sets: &[&str]) -> Result<Self, HostError> {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        Ok(Self::of(name, Scenario::resolve(scenario, &sets)?))
    }

    /// A flight of a resolved scenario, without dispersions.
    #[must_use]
    pub fn of(name: &str, scenario: Scenario) -> Self {
        let predicts = Predicts::of(&scenario);
        Self { name: name.to_owned(), scenario, id: FlightId { seed: 1, run: 0, nominal: true }, predicts }
    }

    /// The same with the dispersions of a seed.
    #[must_use]
    pub fn dispersed(mut self, seed: u64) -> Self {
        self.id = FlightId { seed, run: 0, nominal: false };
        self
    }
}

/// Three beacons beside the orbiter: as many radio sources as the interface allows, in view for most of the flight.
pub(super) const SOURCES: &str = "beacon=[{name=\"a\",longitude_deg=-73.26,latitude_deg=-41.03,altitude_km=0},\
     {name=\"b\",longitude_deg=-80.0,latitude_deg=-43.0,altitude_km=0},\
     {name=\"c\",longitude_deg=-86.0,latitude_deg=-44.0,altitude_km=0}]";
/// Highest row of the tabulated air, km: above the entry.
const HIGHEST_ROW_KM: f64 = 130.0;
pub(super) const NO_BLACKOUT: &str = "sensors.radio.blackout={above_speed_mps=10000,below_altitude_km=0}";

/// Air and coefficients as tables of the largest size that the flight software holds, sampled from the default models.
fn tables() -> [String; 2] {
    let air = |k: usize| {
        let altitude_km = HIGHEST_ROW_KM * k as f64 / (MAX_ATMOSPHERE_ROWS - 1) as f64;
        format!("[{altitude_km},{:e}]", 0.0158 * (-altitude_km / 9.354).exp())
    };
    let aero = |k: usize| format!("[{k},1.45,0.348]");
    let rows = |count: usize, row: &dyn Fn(usize) -> String| (0..count).map(row).collect::<Vec<_>>().join(",");
    [
        format!("onboard.atmosphere={{kind=\"table\",rows=[{}]}}", rows(MAX_ATMOSPHERE_ROWS, &air)),
        format!("onboard.vehicle.aero_table=[{}]", rows(MAX_AERO_ROWS, &aero)),
    ]
}

/// The worst input that a search has found so far, kept as a regression flight.
const WORST_FRAME: &str = include_str!("../../../tests/cases/worst-frame.toml");

/// A fault as a field to set.
pub(super) fn fault(kind: &str, target: &str, start_s: f64, duration_s: f64, parameters: &str) -> String {
    format!(
        "{{kind=\"{kind}\",target=\"{target}\",start_s={start_s},duration_s={duration_s},parameters={{{parameters}}}}}"
    )
}

fn faults(list: &[String]) -> String {
    format!("fault=[{}]", list.join(","))
}

fn noisy_line() -> String {
    faults(&[fault("bit-flips", "uplink", 0.0, 1000.0, "per_packet=0.05")])
}

/// Beside every source: the largest tables, and a line that spoils packets.
pub(super) fn everything_at_once() -> [String; 3] {
    let [air, aero] = tables();
    [air, aero, noisy_line()]
}

/// The whole set, in the order of the table.
///
/// # Errors
/// A scenario of it is wrong.
pub fn hard_flights() -> Result<Vec<HardFlight>, HostError> {
    let [air, aero] = tables();
    let sensor_faults = faults(&[
        fault("bias", "accelerometer", 60.0, 20.0, "value=3.0"),
        fault("stuck", "gyro", 90.0, 5.0, ""),
        fault("failed", "imu", 110.0, 3.0, ""),
        fault("stuck", "pressure", 120.0, 30.0, ""),
        fault("bias", "radio", 20.0, 40.0, "value=5000.0"),
    ]);
    let gaps = faults(&[
        fault("dropout", "uplink", 60.0, 0.1, ""),
        fault("dropout", "uplink", 80.0, 0.2, ""),
        fault("dropout", "uplink", 120.0, 0.4, ""),
        fault("dropout", "uplink", 150.0, 2.0, ""),
        fault("dropout", "imu", 170.0, 0.5, ""),
    ]);
    let noisy = noisy_line();
    let flooded = faults(&[
        fault("duplicate", "uplink", 40.0, 20.0, "copies=3"),
        fault("duplicate", "uplink", 80.0, 5.0, "copies=60"),
        fault("garbage", "uplink", 110.0, 5.0, "bytes=1843,piece=1"),
        fault("garbage", "uplink", 120.0, 5.0, "bytes=1843,piece=250"),
        fault("garbage", "uplink", 130.0, 5.0, "bytes=1843,piece=2000"),
    ]);
    let bursts = faults(&[
        fault("hold", "uplink", 60.0, 0.1, ""),
        fault("hold", "uplink", 80.0, 0.3, ""),
        fault("hold", "uplink", 120.0, 1.0, ""),
        fault("hold", "uplink", 160.0, 4.0, ""),
    ]);
    let every = ["sensors.pressure.min_dynamic_pressure_pa=0", SOURCES, NO_BLACKOUT];
    let hard = [every.as_slice(), &[air.as_str(), aero.as_str(), noisy.as_str()]].concat();
    let new = HardFlight::new;
    Ok(vec![
        new("nominal", "msl", &[])?,
        new("seed 1", "msl", &[])?.dispersed(1),
        new("seed 2", "msl", &["dispersions.winds=true"])?.dispersed(2),
        new("seed 3", "msl-beacon", &["dispersions.winds=true"])?.dispersed(3),
        new("seed 4", "paper-exp40", &[])?.dispersed(4),
        new("range trigger", "msl", &["deploy.trigger=range"])?,
        new("dead reckoning", "msl", &["navigation.filter=dead-reckoning"])?,
        new("ideal navigation", "msl-ideal", &[])?,
        new("paper", "msl", &["guidance.mode=paper"])?.dispersed(8),
        new("every source", "msl", &every)?,
        new("sensor faults", "msl", &[&sensor_faults])?.dispersed(5),
        new("gaps", "msl", &[&gaps])?,
        new("bursts after gaps", "msl", &[&bursts])?,
        new("flooded line", "msl", &[&flooded])?,
        new("noisy line", "msl", &[&noisy])?.dispersed(6),
        new("steep", "msl", &["entry.flight_path_angle_deg=-17.5"])?,
        new("shallow", "msl", &["entry.flight_path_angle_deg=-11.5", "time_limit_s=500"])?,
        new("tables", "msl", &[&air, &aero])?,
        new("everything at once", "msl", &hard)?.dispersed(7),
        HardFlight::of("worst found", Scenario::from_text("worst-frame", WORST_FRAME, Path::new(""), &[])?),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hard_flight_resolves_under_a_name_of_its_own() {
        let flights = hard_flights().unwrap();
        let mut names: Vec<_> = flights.iter().map(|flight| flight.name.clone()).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), flights.len());
        let count = |predicts| flights.iter().filter(|flight| flight.predicts == predicts).count();
        assert_eq!((count(Predicts::Held), count(Predicts::InTables)), (1, 2));
    }
}
