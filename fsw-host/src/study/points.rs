//! Where every run deployed, from the table of its campaign, and as CSV.

use std::io::{self, Write};

use super::Mode;
use crate::campaign::summary::Runs;

/// One run; NaN where it did not deploy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeployPoint {
    /// Number of the run.
    pub run: u64,
    /// Longitude, deg.
    pub longitude_deg: f64,
    /// Planetocentric latitude, deg.
    pub latitude_deg: f64,
    /// Altitude, m.
    pub altitude_m: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// Great-circle miss, m.
    pub miss_m: f64,
    /// Its part along the arc, m, positive beyond the target.
    pub downrange_error_m: f64,
    /// Its part across the arc, m, positive to the right.
    pub crossrange_error_m: f64,
    /// Bank reversals commanded.
    pub reversals: f64,
    /// Guidance cycles that predicted.
    pub cycles: f64,
    /// Evaluations of the equations of motion in a cycle, mean.
    pub evaluations_per_cycle: f64,
}

impl DeployPoint {
    fn values(&self) -> [f64; 10] {
        [
            self.longitude_deg,
            self.latitude_deg,
            self.altitude_m,
            self.speed_mps,
            self.miss_m,
            self.downrange_error_m,
            self.crossrange_error_m,
            self.reversals,
            self.cycles,
            self.evaluations_per_cycle,
        ]
    }
}

/// Columns of the table of runs, in the order of [`DeployPoint`].
const COLUMNS: [&str; 10] = [
    "deploy_longitude_deg",
    "deploy_latitude_deg",
    "deploy_altitude_m",
    "deploy_speed_mps",
    "miss_m",
    "downrange_error_m",
    "crossrange_error_m",
    "reversals",
    "cycles",
    "evaluations_mean",
];

/// The points of a campaign, in the order of its runs.
///
/// # Errors
/// The table cannot be read.
pub fn of(runs: &Runs) -> io::Result<Vec<DeployPoint>> {
    let numbers = runs.numbers("run")?;
    let columns = COLUMNS.iter().map(|name| runs.numbers(name)).collect::<io::Result<Vec<_>>>()?;
    let point = |(at, run): (usize, &f64)| {
        let value = |column: usize| columns.get(column).and_then(|c| c.get(at)).copied().unwrap_or(f64::NAN);
        DeployPoint {
            run: *run as u64,
            longitude_deg: value(0),
            latitude_deg: value(1),
            altitude_m: value(2),
            speed_mps: value(3),
            miss_m: value(4),
            downrange_error_m: value(5),
            crossrange_error_m: value(6),
            reversals: value(7),
            cycles: value(8),
            evaluations_per_cycle: value(9),
        }
    };
    Ok(numbers.iter().enumerate().map(point).collect())
}

/// Writes the points of all modes; an empty cell where a run did not deploy.
///
/// # Errors
/// They cannot be written.
pub fn write_csv<'a>(
    modes: impl IntoIterator<Item = (Mode, &'a [DeployPoint])>,
    out: &mut impl Write,
) -> io::Result<()> {
    writeln!(out, "mode,run,{}", COLUMNS.join(","))?;
    for (mode, points) in modes {
        for point in points {
            let cell = |value: &f64| if value.is_finite() { value.to_string() } else { String::new() };
            let cells: Vec<String> = point.values().iter().map(cell).collect();
            writeln!(out, "{},{},{}", mode.name(), point.run, cells.join(","))?;
        }
    }
    Ok(())
}
