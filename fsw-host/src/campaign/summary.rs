//! From the table of all runs to the figures of `summary.json`.

use std::io;

use serde::{Deserialize, Serialize};

use super::folder::Identity;
use super::statistics::{Percentile, Share, mean, percentile, quantile, wilson};
use super::table::{Cell, Reader};
use crate::record::ScenarioFacts;

/// Distances within which runs are counted, km.
const RINGS_KM: [(f64, &str); 4] = [(1.0, "1km"), (2.0, "2km"), (5.0, "5km"), (10.0, "10km")];

/// Content of `summary.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What was flown.
    pub scenario: String,
    /// Seed.
    pub seed: u64,
    /// First run.
    pub first: u64,
    /// Runs asked for.
    pub runs: u64,
    /// Runs that ended with a parachute.
    pub completed: u64,
    /// Runs deployed inside the box.
    pub success_pct: Option<Share>,
    /// Runs by their end.
    pub outcomes: Vec<(String, u64)>,
    /// Great-circle miss of the completed runs, m.
    pub miss_m: Option<Distribution>,
    /// Share of all runs that deployed within a distance of the target.
    pub within_pct: Within,
    /// What the flight software said of the target.
    pub unreachable: Unreachable,
    /// Error of the navigation at the end, m.
    pub navigation_position_error_m: Option<Distribution>,
    /// The same of velocity, m/s.
    pub navigation_velocity_error_mps: Option<Distribution>,
    /// Mean normalised estimation error squared.
    pub nees_mean: Option<f64>,
    /// Conditions at deployment.
    pub deploy: Deploy,
    /// Largest values along the paths.
    pub peak: Peaks,
    /// Runs beyond a limit of the scenario.
    pub violations: Violations,
    /// Bank reversals.
    pub reversals: Option<Spread>,
    /// Work of guidance.
    pub guidance: Guidance,
    /// Shares of the miss.
    pub split: Option<Split>,
    /// Worst completed runs.
    pub worst: Vec<Worst>,
    /// Runs that did not end with a parachute inside the box, at most as many as are named.
    pub failed: Vec<Worst>,
    /// Wall time of this sitting, s.
    pub wall_s: f64,
    /// Runs flown in it per second of wall time; none when nothing was left to fly.
    pub runs_per_s: Option<f64>,
}

/// Percentiles of a quantity, each with its bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Median.
    pub p50: f64,
    /// 90 %.
    pub p90: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
    /// 99.9 %.
    pub p999: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// 95 % bounds of the percentiles above.
    pub bounds: Bounds,
}

/// 95 % bounds of percentiles by order statistics: [lower, upper], none where the sample is too small for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bounds {
    /// Median.
    pub p50: [Option<f64>; 2],
    /// 90 %.
    pub p90: [Option<f64>; 2],
    /// 95 %.
    pub p95: [Option<f64>; 2],
    /// 99 %.
    pub p99: [Option<f64>; 2],
    /// 99.9 %.
    pub p999: [Option<f64>; 2],
}

/// Smallest, largest, mean and the middle 98 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Smallest.
    pub min: f64,
    /// 1 %.
    pub p01: f64,
    /// Median.
    pub p50: f64,
    /// 99 %.
    pub p99: f64,
    /// Largest.
    pub max: f64,
    /// Mean.
    pub mean: f64,
}

/// Shares of all runs, and of those that the flight software did not call unreachable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// One kilometre.
    #[serde(rename = "1km")]
    pub km1: Option<Share>,
    /// Two kilometres.
    #[serde(rename = "2km")]
    pub km2: Option<Share>,
    /// Five kilometres.
    #[serde(rename = "5km")]
    pub km5: Option<Share>,
    /// Ten kilometres.
    #[serde(rename = "10km")]
    pub km10: Option<Share>,
}

/// Verdicts of the flight software on its target.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Unreachable {
    /// Runs in which it said at some time that the target is out of reach.
    pub ever: u64,
    /// Runs in which that was its last word before heading alignment.
    pub at_end: u64,
    /// Shares within a distance of the runs in which it was not its last word.
    pub others_within_pct: Within,
    /// Miss of those runs, m.
    pub others_miss_m: Option<Distribution>,
    /// Largest miss of those runs with the number of the run.
    pub others_worst: Option<(u64, f64)>,
}

/// Conditions at deployment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Deploy {
    /// Time, s.
    pub time_s: Option<Spread>,
    /// Altitude, m.
    pub altitude_m: Option<Spread>,
    /// Planet-relative speed, m/s.
    pub speed_mps: Option<Spread>,
    /// Air-relative Mach number.
    pub mach: Option<Spread>,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: Option<Spread>,
}

/// Largest values along the paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Peaks {
    /// Sensed load, g.
    pub load_g: Option<Spread>,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: Option<Spread>,
    /// Heat flux, W/m².
    pub heat_flux_wpm2: Option<Spread>,
}

/// Runs beyond a limit of the scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Violations {
    /// Sensed load.
    pub load: u64,
    /// Dynamic pressure.
    pub dynamic_pressure: u64,
    /// Heat flux.
    pub heat_flux: u64,
    /// Deployed outside the altitudes of the box.
    pub deploy_altitude: u64,
    /// Deployed outside its Mach numbers.
    pub deploy_mach: u64,
    /// Deployed outside its dynamic pressures.
    pub deploy_dynamic_pressure: u64,
}

/// Work of guidance over the cycles that predicted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Guidance {
    /// Mean predictor calls a cycle.
    pub predictions_per_cycle: Option<f64>,
    /// Most in any cycle.
    pub max_predictions: i64,
    /// Mean evaluations of the equations of motion a cycle.
    pub evaluations_per_cycle: Option<f64>,
    /// Most in any cycle.
    pub max_evaluations: i64,
}

/// The miss and what is left of it: root mean squares over the runs that were flown again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Split {
    /// Runs that were flown again.
    pub runs: u64,
    /// Miss as flown, m.
    pub flown_m: f64,
    /// With the density known on board, m.
    pub known_density_m: f64,
    /// With known density and ideal navigation, m.
    pub ideal_navigation_m: f64,
    /// Share of the mean squared miss that goes when the density is known, percent; below zero when the miss grew.
    pub atmosphere_pct: f64,
    /// Share that goes with ideal navigation too, percent.
    pub navigation_pct: f64,
    /// Share that is left, percent.
    pub guidance_pct: f64,
}

/// A run that deserves a look.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Number of the run.
    pub run: u64,
    /// Miss, m.
    pub miss_m: Option<f64>,
    /// Why it is no success.
    pub reason: Option<String>,
    /// The flight software's last word was that the target is out of reach.
    pub unreachable: bool,
    /// The command that flies it again.
    pub command: String,
}

/// Runs named in a list.
const NAMED: usize = 10;

/// The table with its columns at hand.
pub struct Runs {
    reader: Reader,
}

impl Runs {
    /// Of a table.
    #[must_use]
    pub fn new(reader: Reader) -> Self {
        Self { reader }
    }

    /// A column of numbers or counts; NaN where a cell is empty, and empty when there is no such column.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn numbers(&self, name: &str) -> io::Result<Vec<f64>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(as_number).collect())
    }

    /// A column of flags; false where a cell is empty.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn flags(&self, name: &str) -> io::Result<Vec<bool>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(|cell| cell == Cell::Flag(Some(true))).collect())
    }

    /// A column of words.
    ///
    /// # Errors
    /// The table cannot be read.
    pub fn words(&self, name: &str) -> io::Result<Vec<Option<String>>> {
        let cells = self.reader.column(name)?.unwrap_or_default();
        Ok(cells.into_iter().map(|cell| if let Cell::Word(word) = cell { word } else { None }).collect())
    }

    /// Names of the columns that begin with a prefix.
    pub fn names<'a>(&'a self, prefix: &'a str) -> impl Iterator<Item = &'a str> {
        self.reader.headings().iter().map(|heading| heading.name.as_str()).filter(move |name| name.starts_with(prefix))
    }

    /// Number of rows.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.reader.rows()
    }
}

fn as_number(cell: Cell) -> f64 {
    match cell {
        Cell::Number(Some(value)) => value,
        Cell::Count(Some(value)) => value as f64,
        _ => f64::NAN,
    }
}

/// The values that are there, ascending.
#[must_use]
pub fn ascending(values: &[f64]) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

impl Distribution {
    /// Of values in any order, gaps left out.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = ascending(values);
        let of = |q| percentile(&sorted, q);
        let pair = |p: Percentile| [p.low, p.high];
        let (p50, p90, p95, p99, p999) = (of(0.5)?, of(0.9)?, of(0.95)?, of(0.99)?, of(0.999)?);
        Some(Self {
            p50: p50.value,
            p90: p90.value,
            p95: p95.value,
            p99: p99.value,
            p999: p999.value,
            max: sorted.last().copied()?,
            mean: mean(&sorted)?,
            bounds: Bounds { p50: pair(p50), p90: pair(p90), p95: pair(p95), p99: pair(p99), p999: pair(p999) },
        })
    }
}

impl Spread {
    /// Of values in any order, gaps left out.
    #[must_use]
    pub fn of(values: &[f64]) -> Option<Self> {
        let sorted = ascending(values);
        Some(Self {
            min: sorted.first().copied()?,
            p01: quantile(&sorted, 0.01)?,
            p50: quantile(&sorted, 0.5)?,
            p99: quantile(&sorted, 0.99)?,
            max: sorted.last().copied()?,
            mean: mean(&sorted)?,
        })
    }
}

impl Within {
    /// Shares of `misses` (NaN for a run that did not deploy) among all of them.
    #[must_use]
    pub fn of(misses: &[f64]) -> Self {
        let share = |km: f64| {
            let hits = misses.iter().filter(|m| **m <= km * 1e3).count() as u64;
            wilson(hits, misses.len() as u64)
        };
        let [km1, km2, km5, km10] = RINGS_KM.map(|(km, _)| share(km));
        Self { km1, km2, km5, km10 }
    }

    /// The rings with their names, in order.
    #[must_use]
    pub fn rings(&self) -> [(&'static str, Option<Share>); 4] {
        let shares = [self.km1, self.km2, self.km5, self.km10];
        std::array::from_fn(|k| (RINGS_KM[k].1, shares[k]))
    }
}

/// The figures of a table.
///
/// # Errors
/// The table cannot be read.
pub fn summarise(runs: &Runs, identity: &Identity, facts: &ScenarioFacts) -> io::Result<Summary> {
    let misses = runs.numbers("miss_m")?;
    let numbers = runs.numbers("run")?;
    let success = runs.flags("success")?;
    let spread = |name: &str| runs.numbers(name).map(|values| Spread::of(&values));
    let position = runs.numbers("navigation_position_error_m")?;
    let velocity = runs.numbers("navigation_velocity_error_mps")?;
    Ok(Summary {
        scenario: identity.scenario.clone(),
        seed: identity.seed,
        first: identity.first,
        runs: identity.runs,
        completed: misses.iter().filter(|m| m.is_finite()).count() as u64,
        success_pct: wilson(success.iter().filter(|s| **s).count() as u64, success.len() as u64),
        outcomes: outcomes(&runs.words("outcome")?),
        miss_m: Distribution::of(&misses),
        within_pct: Within::of(&misses),
        unreachable: unreachable(runs, &numbers, &misses)?,
        navigation_position_error_m: Distribution::of(&position),
        navigation_velocity_error_mps: Distribution::of(&velocity),
        nees_mean: mean(&ascending(&runs.numbers("nees_mean")?)),
        deploy: Deploy {
            time_s: spread("deploy_time_s")?,
            altitude_m: spread("deploy_altitude_m")?,
            speed_mps: spread("deploy_speed_mps")?,
            mach: spread("deploy_mach")?,
            dynamic_pressure_pa: spread("deploy_dynamic_pressure_pa")?,
        },
        peak: Peaks {
            load_g: spread("peak_load_g")?,
            dynamic_pressure_pa: spread("peak_dynamic_pressure_pa")?,
            heat_flux_wpm2: spread("peak_heat_flux_wpm2")?,
        },
        violations: violations(runs, facts)?,
        reversals: spread("reversals")?,
        guidance: guidance(runs)?,
        split: split(runs, &misses)?,
        worst: worst(runs, identity, &numbers, &misses)?,
        failed: failed(runs, identity, &numbers, &success)?,
        wall_s: 0.0,
        runs_per_s: None,
    })
}

fn outcomes(words: &[Option<String>]) -> Vec<(String, u64)> {
    let mut counts = std::collections::BTreeMap::<&str, u64>::new();
    words.iter().flatten().for_each(|word| *counts.entry(word).or_default() += 1);
    counts.into_iter().map(|(word, count)| (word.to_owned(), count)).collect()
}

fn unreachable(runs: &Runs, numbers: &[f64], misses: &[f64]) -> io::Result<Unreachable> {
    let ever = runs.numbers("unreachable_events")?.iter().filter(|n| **n > 0.0).count() as u64;
    let at_end = runs.flags("unreachable_at_end")?;
    let others: Vec<(f64, f64)> = numbers
        .iter()
        .zip(misses)
        .zip(&at_end)
        .filter_map(|((run, miss), unreachable)| (!unreachable).then_some((*run, *miss)))
        .collect();
    let missed: Vec<f64> = others.iter().map(|(_, miss)| *miss).collect();
    let worst = others.iter().filter(|(_, m)| m.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1));
    Ok(Unreachable {
        ever,
        at_end: at_end.iter().filter(|u| **u).count() as u64,
        others_within_pct: Within::of(&missed),
        others_miss_m: Distribution::of(&missed),
        others_worst: worst.map(|(run, miss)| (*run as u64, *miss)),
    })
}

fn violations(runs: &Runs, facts: &ScenarioFacts) -> io::Result<Violations> {
    let (limits, deploy) = (&facts.constraints, &facts.deploy);
    let beyond = |name: &str, low: f64, high: f64| {
        let values = runs.numbers(name)?;
        io::Result::Ok(values.iter().filter(|v| v.is_finite() && !(low..=high).contains(*v)).count() as u64)
    };
    Ok(Violations {
        load: beyond("peak_load_g", 0.0, limits.load_mps2 / fsw_core::planet::STANDARD_GRAVITY_MPS2)?,
        dynamic_pressure: beyond("peak_dynamic_pressure_pa", 0.0, limits.dynamic_pressure_pa)?,
        heat_flux: beyond("peak_heat_flux_wpm2", 0.0, limits.heat_flux_wpm2)?,
        deploy_altitude: beyond("deploy_altitude_m", deploy.min_altitude_m, deploy.max_altitude_m)?,
        deploy_mach: beyond("deploy_mach", deploy.min_mach, deploy.max_mach)?,
        deploy_dynamic_pressure: beyond(
            "deploy_dynamic_pressure_pa",
            deploy.min_dynamic_pressure_pa,
            deploy.max_dynamic_pressure_pa,
        )?,
    })
}

/// Means over all cycles of all runs: each run counts with its number of cycles.
fn guidance(runs: &Runs) -> io::Result<Guidance> {
    let cycles = runs.numbers("cycles")?;
    let weighted = |name: &str| {
        let values = runs.numbers(name)?;
        let known = || values.iter().zip(&cycles).filter(|(value, _)| value.is_finite());
        let (sum, weight) = known().fold((0.0, 0.0), |(sum, weight), (v, n)| (sum + v * n, weight + n));
        io::Result::Ok((weight > 0.0).then_some(sum / weight))
    };
    let most = |name: &str| runs.numbers(name).map(|values| ascending(&values).last().map_or(0, |v| *v as i64));
    Ok(Guidance {
        predictions_per_cycle: weighted("predictions_mean")?,
        max_predictions: most("predictions_max")?,
        evaluations_per_cycle: weighted("evaluations_mean")?,
        max_evaluations: most("evaluations_max")?,
    })
}

fn split(runs: &Runs, misses: &[f64]) -> io::Result<Option<Split>> {
    let (known, ideal) = (runs.numbers(super::columns::SPLIT[0])?, runs.numbers(super::columns::SPLIT[1])?);
    let all: Vec<[f64; 3]> = misses
        .iter()
        .zip(known.iter().zip(&ideal))
        .map(|(flown, (known, ideal))| [*flown, *known, *ideal])
        .filter(|misses| misses.iter().all(|m| m.is_finite()))
        .collect();
    if all.is_empty() {
        return Ok(None);
    }
    let square = |at: usize| all.iter().map(|misses| misses[at] * misses[at]).sum::<f64>() / all.len() as f64;
    let (flown, known, ideal) = (square(0), square(1), square(2));
    let pct = |part: f64| if flown > 0.0 { 100.0 * part / flown } else { 0.0 };
    Ok(Some(Split {
        runs: all.len() as u64,
        flown_m: flown.sqrt(),
        known_density_m: known.sqrt(),
        ideal_navigation_m: ideal.sqrt(),
        atmosphere_pct: pct(flown - known),
        navigation_pct: pct(known - ideal),
        guidance_pct: pct(ideal),
    }))
}

fn worst(runs: &Runs, identity: &Identity, numbers: &[f64], misses: &[f64]) -> io::Result<Vec<Worst>> {
    let mut order: Vec<usize> = (0..misses.len()).filter(|k| misses[*k].is_finite()).collect();
    order.sort_by(|a, b| misses[*b].total_cmp(&misses[*a]).then(a.cmp(b)));
    order.truncate(NAMED);
    named(runs, identity, numbers, &order)
}

fn failed(runs: &Runs, identity: &Identity, numbers: &[f64], success: &[bool]) -> io::Result<Vec<Worst>> {
    let order: Vec<usize> = (0..success.len()).filter(|k| !success[*k]).take(NAMED).collect();
    named(runs, identity, numbers, &order)
}

fn named(runs: &Runs, identity: &Identity, numbers: &[f64], order: &[usize]) -> io::Result<Vec<Worst>> {
    let (misses, reasons) = (runs.numbers("miss_m")?, runs.words("reason")?);
    let unreachable = runs.flags("unreachable_at_end")?;
    let of = |k: &usize| {
        let run = numbers.get(*k).map_or(0, |run| *run as u64);
        Worst {
            run,
            miss_m: misses.get(*k).copied().filter(|m| m.is_finite()),
            reason: reasons.get(*k).cloned().flatten(),
            unreachable: unreachable.get(*k).copied().unwrap_or(false),
            command: identity.refly(run),
        }
    };
    Ok(order.iter().map(of).collect())
}
