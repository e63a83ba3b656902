//! The columns of `runs.parquet`: outcome, inputs read back from the truth, bank history.

use hil_sim::case::Case;
use hil_sim::readback::read_back;
use hil_sim::scenario::Scenario;

use super::observer::Flown;
use super::table::{Cell, Heading, Kind, Row};
use crate::record::{DeployState, ScenarioFacts};

/// Begins the name of a column that holds an input.
pub const INPUT: &str = "input_";
/// Begins and ends the name of a column that holds the bank at a speed.
pub const BANK: (&str, &str) = ("bank_deg_at_", "_mps");
/// Spacing of the speeds at which the bank is kept, m/s.
const BANK_SPACING_MPS: f64 = 200.0;
/// Misses of the same run flown again: with its density known on board, and with ideal navigation on top of that.
pub const SPLIT: [&str; 2] = ["miss_known_density_m", "miss_known_density_ideal_navigation_m"];

type Column = (&'static str, Kind, fn(&Flown) -> Cell);

fn at_deploy(flown: &Flown, value: fn(&DeployState) -> f64) -> Cell {
    flown.deploy.as_ref().map(value).into()
}

/// What is said of every flight.
const FLOWN: &[Column] = &[
    ("success", Kind::Flag, |f| f.reason.is_none().into()),
    ("outcome", Kind::Word, |f| Some(f.outcome.to_owned()).into()),
    ("reason", Kind::Word, |f| f.reason.clone().into()),
    ("miss_m", Kind::Number, |f| f.miss_m.into()),
    ("downrange_error_m", Kind::Number, |f| f.downrange_error_m.into()),
    ("crossrange_error_m", Kind::Number, |f| f.crossrange_error_m.into()),
    ("deploy_time_s", Kind::Number, |f| at_deploy(f, |d| d.time_s)),
    ("deploy_altitude_m", Kind::Number, |f| at_deploy(f, |d| d.altitude_m)),
    ("deploy_speed_mps", Kind::Number, |f| at_deploy(f, |d| d.speed_mps)),
    ("deploy_mach", Kind::Number, |f| at_deploy(f, |d| d.mach)),
    ("deploy_dynamic_pressure_pa", Kind::Number, |f| at_deploy(f, |d| d.dynamic_pressure_pa)),
    ("deploy_longitude_deg", Kind::Number, |f| at_deploy(f, |d| d.longitude_deg)),
    ("deploy_latitude_deg", Kind::Number, |f| at_deploy(f, |d| d.latitude_deg)),
    ("deploy_cause", Kind::Word, |f| f.deploy_cause.map(str::to_owned).into()),
    ("peak_load_g", Kind::Number, |f| f.peak.load_g.into()),
    ("peak_dynamic_pressure_pa", Kind::Number, |f| f.peak.dynamic_pressure_pa.into()),
    ("peak_heat_flux_wpm2", Kind::Number, |f| f.peak.heat_flux_wpm2.into()),
    ("reversals", Kind::Count, |f| f.reversals.into()),
    ("cycles", Kind::Count, |f| f.work.cycles.into()),
    ("predictions_mean", Kind::Number, |f| f.work.mean_predictions().into()),
    ("predictions_max", Kind::Count, |f| f.work.max_predictions.into()),
    ("evaluations_mean", Kind::Number, |f| f.work.mean_evaluations().into()),
    ("evaluations_max", Kind::Count, |f| f.work.max_evaluations.into()),
    ("unreachable_events", Kind::Count, |f| f.unreachable_events.into()),
    ("unreachable_at_end", Kind::Flag, |f| f.unreachable_at_end.into()),
    ("unreachable_predicted_miss_m", Kind::Number, |f| f.unreachable_m.into()),
    ("navigation_position_error_m", Kind::Number, |f| f.position_error_m.into()),
    ("navigation_velocity_error_mps", Kind::Number, |f| f.velocity_error_mps.into()),
    ("nees_mean", Kind::Number, |f| f.nees_mean.into()),
    ("packets_rejected", Kind::Count, |f| f.rejected.into()),
    ("frames", Kind::Count, |f| f.frames.into()),
    ("output_hash", Kind::Word, |f| f.output_hash.clone().into()),
];

/// One flight of a run, and its repetitions with less to contend with.
#[derive(Clone, Debug, PartialEq)]
pub struct RunResult {
    /// Number of the run.
    pub run: u64,
    /// The flight.
    pub flown: Flown,
    /// Misses of the same run flown again, in the order of [`SPLIT`].
    pub split: [Option<f64>; 2],
    /// What it flew.
    pub inputs: Vec<f64>,
}

/// The table of a scenario: which columns there are and how a run fills them.
#[derive(Clone, Debug)]
pub struct Columns {
    nominal: Case,
    inputs: Vec<&'static str>,
    /// Speeds at which the bank is kept, m/s, descending.
    pub grid_mps: Vec<f64>,
}

impl Columns {
    /// The columns of a scenario.
    #[must_use]
    pub fn of(scenario: &Scenario, facts: &ScenarioFacts) -> Self {
        let nominal = Case::draw(scenario, 0, 0, true);
        let inputs = read_back(&nominal, &nominal).into_iter().map(|(name, _)| name).collect();
        let entry_mps = nominal.entry.planet_relative(0.0, &nominal.world.planet).speed_mps;
        let (top, bottom) = (entry_mps / BANK_SPACING_MPS, facts.deploy.speed_mps / BANK_SPACING_MPS);
        let steps = ((bottom.ceil() as i64)..=(top.floor() as i64)).rev();
        Self { nominal, inputs, grid_mps: steps.map(|k| k as f64 * BANK_SPACING_MPS).collect() }
    }

    /// What a case flies, in the order of the input columns.
    #[must_use]
    pub fn inputs(&self, case: &Case) -> Vec<f64> {
        read_back(case, &self.nominal).into_iter().map(|(_, value)| value).collect()
    }

    /// Names and kinds.
    #[must_use]
    pub fn headings(&self) -> Vec<Heading> {
        let mut headings = vec![Heading::new("run", Kind::Count)];
        headings.extend(FLOWN.iter().map(|(name, kind, _)| Heading::new(*name, *kind)));
        headings.extend(SPLIT.map(|name| Heading::new(name, Kind::Number)));
        headings.extend(self.inputs.iter().map(|name| Heading::new(format!("{INPUT}{name}"), Kind::Number)));
        let bank = |mps: &f64| Heading::new(format!("{}{mps:.0}{}", BANK.0, BANK.1), Kind::Number);
        headings.extend(self.grid_mps.iter().map(bank));
        headings
    }

    /// The row of a run.
    #[must_use]
    pub fn row(&self, result: &RunResult) -> Row {
        let mut row = vec![Cell::Count(Some(result.run.cast_signed()))];
        row.extend(FLOWN.iter().map(|(_, _, cell)| cell(&result.flown)));
        row.extend(result.split.map(Cell::Number));
        row.extend(result.inputs.iter().map(|value| Cell::from(*value)));
        row.extend(result.flown.bank_deg.iter().map(|bank| Cell::Number(*bank)));
        row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_a_cell_of_the_right_kind_under_every_heading() {
        let scenario = Scenario::builtin("msl").unwrap();
        let columns = Columns::of(&scenario, &ScenarioFacts::of(&scenario));
        let case = Case::draw(&scenario, 1, 4, false);
        let flown = Flown { bank_deg: vec![None; columns.grid_mps.len()], ..Flown::default() };
        let row = columns.row(&RunResult { run: 4, flown, split: [None; 2], inputs: columns.inputs(&case) });
        let headings = columns.headings();
        assert_eq!(row.len(), headings.len());
        for (cell, heading) in row.iter().zip(&headings) {
            let kind = match cell {
                Cell::Number(_) => Kind::Number,
                Cell::Count(_) => Kind::Count,
                Cell::Flag(_) => Kind::Flag,
                Cell::Word(_) => Kind::Word,
            };
            assert_eq!(kind, heading.kind, "{}", heading.name);
        }
        let mut names: Vec<_> = headings.iter().map(|h| &h.name).collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), headings.len(), "a name occurs twice");
        assert!(columns.grid_mps.first() == Some(&5400.0) && columns.grid_mps.last() == Some(&600.0));
    }
}
