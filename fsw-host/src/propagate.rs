//! `propagate`: an open-loop entry of the truth at constant bank, to CSV and to a final state.

use std::io::{self, Write};
use std::str::FromStr;

use fsw_core::units::{deg, rad};
use hil_sim::case::Case;
use hil_sim::propagate::{Flight, Sample, Until};
use hil_sim::scenario::Scenario;
use serde::Serialize;

use crate::cli::PropagateArgs;
use crate::error::HostError;
use crate::output::{print_json, written};
use crate::runfolder::write_whole;

/// Columns of the CSV.
const COLUMNS: [&str; 13] = [
    "time_s",
    "longitude_deg",
    "latitude_deg",
    "altitude_m",
    "speed_mps",
    "flight_path_angle_deg",
    "heading_deg",
    "range_m",
    "load_g",
    "dynamic_pressure_pa",
    "heat_flux_wpm2",
    "density_kgpm3",
    "mach",
];

/// The final state and the peaks, as `--json` prints them.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The stop was reached, neither the ground nor the time limit before it.
    pub reached: bool,
    /// Time, s.
    pub time_s: f64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Planetocentric latitude, deg.
    pub latitude_deg: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Flight-path angle, deg.
    pub flight_path_angle_deg: f64,
    /// Heading, deg, clockwise from north.
    pub heading_deg: f64,
    /// Great-circle distance from the entry point at the reference radius, m.
    pub range_m: f64,
    /// Largest values along the path.
    pub peak: Peaks,
}

/// Largest values and their times.
#[derive(Clone, Debug, Serialize)]
pub struct Peaks {
    /// Sensed load, g.
    pub load_g: f64,
    /// Its time, s.
    pub load_time_s: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
    /// Its time, s.
    pub dynamic_pressure_time_s: f64,
    /// Heat flux, W/m².
    pub heat_flux_wpm2: f64,
    /// Its time, s.
    pub heat_flux_time_s: f64,
}

/// Runs the command; true when the stop was reached.
///
/// # Errors
/// Bad input.
pub fn run(args: &PropagateArgs) -> Result<bool, HostError> {
    let until = args.until.parse::<StopAt>().map_err(HostError::Option)?.0;
    if !(-360.0..=360.0).contains(&args.bank) {
        return Err(HostError::Option(format!("--bank is {} deg; allowed is -360 to 360", args.bank)));
    }
    if !(0.02..=1e6).contains(&args.every) {
        return Err(HostError::Option(format!("--every is {} s; allowed is 0.02 to 1000000", args.every)));
    }
    if let Some(out) = args.out.as_deref() {
        if out.is_dir() {
            return Err(HostError::NotAFile(out.to_owned()));
        }
        if out.is_file() && !args.force {
            return Err(HostError::FileExists(out.to_owned()));
        }
    }
    let scenario = Scenario::resolve(&args.scenario, &args.common.set)?;
    let flight = fly(&scenario, rad(args.bank), until, args.every);
    let outcome = Outcome::of(&flight);
    write_samples(args, &flight)?;
    if args.common.json {
        print_json(&outcome)?;
    }
    if !args.common.quiet && !args.common.json {
        eprintln!("{}", outcome.sentence());
    }
    if !flight.reached {
        eprintln!(
            "aeroshell: the stop {} was not reached within {} s and above the ground",
            args.until, scenario.time_limit_s
        );
    }
    Ok(flight.reached)
}

/// The nominal open-loop flight of a scenario: no dispersions, the bank held exactly.
#[must_use]
pub fn fly(scenario: &Scenario, bank_rad: f64, until: Until, every_s: f64) -> Flight {
    let case = Case::draw(scenario, 0, 0, true);
    hil_sim::propagate::propagate(&case.world, &case.entry, bank_rad, until, scenario.time_limit_s, every_s)
}

fn write_samples(args: &PropagateArgs, flight: &Flight) -> Result<(), HostError> {
    match &args.out {
        Some(path) => write_whole(path, |out| write_csv(&flight.samples, out)),
        None if args.common.json || args.common.quiet => Ok(()),
        None => written(write_csv(&flight.samples, &mut io::stdout().lock())),
    }
}

fn write_csv(samples: &[Sample], out: &mut impl Write) -> io::Result<()> {
    writeln!(out, "{}", COLUMNS.join(","))?;
    for sample in samples {
        let cells = cells(sample).map(|value| value.to_string());
        writeln!(out, "{}", cells.join(","))?;
    }
    Ok(())
}

fn cells(s: &Sample) -> [f64; COLUMNS.len()] {
    [
        s.time_s,
        deg(s.state.longitude_rad),
        deg(s.state.latitude_rad),
        s.altitude_m,
        s.state.speed_mps,
        deg(s.state.flight_path_angle_rad),
        deg(s.state.heading_rad),
        s.range_m,
        s.load_g,
        s.dynamic_pressure_pa,
        s.heat_flux_wpm2,
        s.density_kgpm3,
        s.mach,
    ]
}

impl Outcome {
    /// What the end of a flight says.
    #[must_use]
    pub fn of(flight: &Flight) -> Self {
        let (end, peaks) = (&flight.end, &flight.peaks);
        Self {
            reached: flight.reached,
            time_s: end.time_s,
            longitude_deg: deg(end.state.longitude_rad),
            latitude_deg: deg(end.state.latitude_rad),
            altitude_m: end.altitude_m,
            speed_mps: end.state.speed_mps,
            flight_path_angle_deg: deg(end.state.flight_path_angle_rad),
            heading_deg: deg(end.state.heading_rad),
            range_m: end.range_m,
            peak: Peaks {
                load_g: peaks.load_g.value,
                load_time_s: peaks.load_g.time_s,
                dynamic_pressure_pa: peaks.dynamic_pressure_pa.value,
                dynamic_pressure_time_s: peaks.dynamic_pressure_pa.time_s,
                heat_flux_wpm2: peaks.heat_flux_wpm2.value,
                heat_flux_time_s: peaks.heat_flux_wpm2.time_s,
            },
        }
    }

    fn sentence(&self) -> String {
        format!(
            "{:.3} s: {:.3} km, {:.2} m/s, {:.4}° longitude, {:.4}° latitude, {:.3} km flown; peaks {:.2} g at {:.1} s, \
             {:.0} Pa, {:.0} kW/m²",
            self.time_s,
            self.altitude_m * 1e-3,
            self.speed_mps,
            self.longitude_deg,
            self.latitude_deg,
            self.range_m * 1e-3,
            self.peak.load_g,
            self.peak.load_time_s,
            self.peak.dynamic_pressure_pa,
            self.peak.heat_flux_wpm2 * 1e-3
        )
    }
}

/// A stop as the command line says it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopAt(pub Until);

impl FromStr for StopAt {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (quantity, value) = text.split_once('=').unwrap_or((text, ""));
        let number = value.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let bounded = |low: f64, high: f64| {
            number
                .filter(|v| (low..=high).contains(v))
                .ok_or_else(|| format!("--until {quantity}={value}: the value must be a number from {low} to {high}"))
        };
        match quantity.trim() {
            "altitude_km" => Ok(Self(Until::AltitudeM(bounded(-100.0, 100_000.0)? * 1e3))),
            "speed_mps" => Ok(Self(Until::SpeedMps(bounded(0.0, 100_000.0)?))),
            "time_s" => Ok(Self(Until::TimeS(bounded(0.0, 4_000.0)?))),
            "range_km" => Ok(Self(Until::RangeM(bounded(0.0, 100_000.0)? * 1e3))),
            other => Err(format!(
                "--until knows no quantity \"{other}\"; it takes altitude_km=, speed_mps=, time_s= or range_km="
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_are_read_with_their_unit_and_range() {
        assert_eq!("altitude_km=10".parse(), Ok(StopAt(Until::AltitudeM(10_000.0))));
        assert_eq!("range_km=745.7".parse(), Ok(StopAt(Until::RangeM(745_700.0))));
        for bad in ["altitude_km", "altitude_km=", "speed_mps=nan", "time_s=-1", "height=3", ""] {
            assert!(bad.parse::<StopAt>().is_err(), "{bad}");
        }
    }
}
