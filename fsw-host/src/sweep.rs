//! `sweep FIELD=a:b:n`: one field of a scenario varied over a range, with a table and a plot.

use std::fmt::Write as _;

use hil_sim::case::Case;
use hil_sim::scenario::{Scenario, ScenarioError};
use hil_sim::session::Conductor;
use indicatif::ProgressBar;
use maud::html;
use rayon::prelude::*;
use serde::Serialize;

use crate::campaign::columns::RunResult;
use crate::campaign::engine::Engine;
use crate::campaign::flight::Flyer;
use crate::campaign::progress::bar_over;
use crate::campaign::report::document;
use crate::campaign::statistics::{Percentile, Share, percentile, quantile, wilson};
use crate::campaign::summary::ascending;
use crate::cli::SweepArgs;
use crate::error::HostError;
use crate::output::{print, print_json};
use crate::report::{Axis, Figure, Ink, Mark, Panel, PlotError, Point};
use crate::runfolder::{is_special, write_whole};

/// Smaller misses are drawn as this one, km.
const LEAST_KM: f64 = 1e-3;
/// Most values of a field.
const MOST_VALUES: u32 = 1_000;

/// The values of a field.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    field: String,
    from: f64,
    to: f64,
    count: u32,
}

impl std::str::FromStr for Range {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let bad = || {
            format!(
                "expected FIELD=FROM:TO:COUNT with 2 to {MOST_VALUES} values, for example entry.speed_mps=5400:5600:5"
            )
        };
        let (field, range) = text.split_once('=').ok_or_else(bad)?;
        let parts: Vec<&str> = range.split(':').collect();
        let [from, to, count] = parts.as_slice() else { return Err(bad()) };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(bad);
        let count = count.trim().parse::<u32>().ok().filter(|n| (2..=MOST_VALUES).contains(n)).ok_or_else(bad)?;
        if field.trim().is_empty() {
            return Err(bad());
        }
        Ok(Self { field: field.trim().to_owned(), from: number(from)?, to: number(to)?, count })
    }
}

impl Range {
    fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let step = (self.to - self.from) / f64::from(self.count - 1);
        (0..self.count).map(move |k| if k + 1 == self.count { self.to } else { self.from + f64::from(k) * step })
    }
}

/// What one value gives.
#[derive(Clone, Debug, Serialize)]
pub struct Outcome {
    /// The value of the field.
    pub value: f64,
    /// Miss of the undispersed flight, m.
    pub nominal_miss_m: Option<f64>,
    /// Median miss of the dispersed flights, m, with bounds.
    pub p50_m: Option<Percentile>,
    /// 90 %.
    pub p90_m: Option<Percentile>,
    /// Largest.
    pub max_m: Option<f64>,
    /// Deployed inside the box, percent.
    pub success_pct: Option<Share>,
    /// Median deploy altitude, m.
    pub altitude_m: Option<f64>,
    /// Largest sensed load, g.
    pub peak_load_g: Option<f64>,
    /// Flights called unreachable to the end by the flight software.
    pub unreachable: u64,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or a page that cannot be written.
pub fn run(args: &SweepArgs) -> Result<bool, HostError> {
    if let Some(out) = &args.out
        && out.exists()
        && !args.force
        && !is_special(out)
    {
        return Err(HostError::FileExists(out.clone()));
    }
    // Every value is checked before the first flight.
    let scenarios = args.range.values().map(|value| scenario(args, value)).collect::<Result<Vec<_>, _>>()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs.map_or(0, std::num::NonZeroUsize::get)).build();
    let pool = pool.map_err(|e| HostError::Option(format!("the threads cannot be started: {e}")))?;
    let flights = (args.runs + 1) * scenarios.len() as u64;
    let bar = bar_over(flights, !args.common.quiet && !args.common.json);
    let fly = |(value, scenario): (f64, &Scenario)| pool.install(|| point(args, value, scenario, &bar));
    let points = args.range.values().zip(&scenarios).map(fly).collect::<Result<Vec<_>, _>>();
    bar.finish_and_clear();
    let points = points?;
    if let Some(out) = &args.out {
        let page = page(args, &points).map_err(|e| HostError::Option(e.to_string()))?;
        write_whole(out, |file| std::io::Write::write_all(file, page.as_bytes()))?;
    }
    if args.common.json {
        print_json(&points)?;
    } else if !args.common.quiet {
        print(&text(args, &points))?;
        print(&match &args.out {
            Some(out) => format!("  plot    {}\n", out.display()),
            None => "  plot    with --out FILE.html\n".to_owned(),
        })?;
    }
    Ok(true)
}

fn scenario(args: &SweepArgs, value: f64) -> Result<Scenario, HostError> {
    let resolve = |value: String| {
        let set = format!("{}={value}", args.range.field);
        let sets: Vec<String> = args.common.set.iter().cloned().chain([set]).collect();
        Scenario::resolve(&args.scenario, &args.selection.sets(&sets))
    };
    // Debug form: 5400.0, not 5400, which would be an integer in TOML; a field that counts wants that one.
    let scenario = resolve(format!("{value:?}"));
    let scenario = match scenario {
        Err(_) if value.fract() == 0.0 => resolve(format!("{value:.0}")).or(scenario)?,
        other => other?,
    };
    let place = format!("{} with {} = {value}", args.scenario, args.range.field);
    scenario.check_reach().map_err(|e| ScenarioError { message: format!("{place}: {e}") })?;
    Conductor::new(&scenario, args.seed, 0, true).map_err(|e| HostError::Option(format!("{place}: {e}")))?;
    Ok(scenario)
}

fn point(args: &SweepArgs, value: f64, scenario: &Scenario, bar: &ProgressBar) -> Result<Outcome, HostError> {
    let engine = Engine::new(scenario, args.seed, 0);
    let nominal = Case::draw(scenario, args.seed, 0, true);
    let nominal = Flyer::default().fly(scenario, &engine.facts, &nominal, &[])?;
    bar.inc(1);
    let results: Vec<RunResult> = (0..args.runs)
        .into_par_iter()
        .map_init(Flyer::default, |flyer, run| engine.fly(flyer, run).inspect(|_| bar.inc(1)))
        .collect::<Result<_, _>>()?;
    let of = |value: fn(&RunResult) -> Option<f64>| ascending(&results.iter().filter_map(value).collect::<Vec<_>>());
    let misses = of(|r| r.flown.miss_m);
    let hits = results.iter().filter(|r| r.flown.reason.is_none()).count() as u64;
    Ok(Outcome {
        value,
        nominal_miss_m: nominal.miss_m,
        p50_m: percentile(&misses, 0.5),
        p90_m: percentile(&misses, 0.9),
        max_m: misses.last().copied(),
        success_pct: wilson(hits, results.len() as u64),
        altitude_m: quantile(&of(|r| r.flown.deploy.map(|d| d.altitude_m)), 0.5),
        peak_load_g: of(|r| Some(r.flown.peak.load_g)).last().copied(),
        unreachable: results.iter().filter(|r| r.flown.unreachable_at_end).count() as u64,
    })
}

fn text(args: &SweepArgs, points: &[Outcome]) -> String {
    let mut out = String::new();
    let _ = writeln!(out, "\n{}: {} over {} runs of seed {}", args.scenario, args.range.field, args.runs, args.seed);
    let head = "         value   nominal, m     50 %, m     90 %, m      max, m   in the box, %   altitude, km   load, g   unreachable";
    let _ = writeln!(out, "{head}");
    let of = |v: Option<f64>, digits: usize| v.map_or_else(|| "–".to_owned(), |v| format!("{v:.digits$}"));
    for p in points {
        let cells =
            [of(p.nominal_miss_m, 0), of(p.p50_m.map(|p| p.value), 0), of(p.p90_m.map(|p| p.value), 0), of(p.max_m, 0)];
        let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
        let (share, altitude) = (of(p.success_pct.map(|s| s.value), 1), of(p.altitude_m.map(|m| m * 1e-3), 2));
        let load = of(p.peak_load_g, 2);
        let _ =
            writeln!(out, "  {:>12}{cells}{share:>16}{altitude:>15}{load:>10}{:>14}", short(p.value), p.unreachable);
    }
    out
}

/// Without the digits that adding up leaves behind.
fn short(value: f64) -> f64 {
    if value == 0.0 { 0.0 } else { format!("{value:.9e}").parse().unwrap_or(value) }
}

fn page(args: &SweepArgs, points: &[Outcome]) -> Result<String, PlotError> {
    let curve = |of: &dyn Fn(&Outcome) -> Option<f64>| -> Vec<Point> {
        points.iter().map(|p| (p.value, of(p).unwrap_or(f64::NAN))).collect()
    };
    let log = |m: f64| (m * 1e-3).max(LEAST_KM).log10();
    let band = points.iter().filter_map(|p| p.p50_m.and_then(|m| Some((p.value, log(m.low?), log(m.high?))))).collect();
    let misses = Panel::new(Axis::fit("").silent(), Axis::fit("miss, km").decades(), 260)
        .band(band, Ink::Blue)
        .line(curve(&|p| p.p50_m.map(|m| log(m.value))), Ink::Blue)
        .line(curve(&|p| p.p90_m.map(|m| log(m.value))), Ink::Orange)
        .line(curve(&|p| p.max_m.map(log)), Ink::Vermillion)
        .line(curve(&|p| p.nominal_miss_m.map(log)), Ink::Green);
    let inside = points.iter().filter_map(|p| p.success_pct.map(|s| (p.value, s.low, s.high))).collect();
    let success = Panel::new(Axis::fit("").silent(), Axis::fixed("in the box, %", 0.0, 100.0), 150)
        .band(inside, Ink::Blue)
        .line(curve(&|p| p.success_pct.map(|s| s.value)), Ink::Blue);
    let altitude = Panel::new(Axis::fit("").silent(), Axis::fit("deploy altitude, km"), 160)
        .line(curve(&|p| p.altitude_m.map(|m| m * 1e-3)), Ink::Blue);
    let load = Panel::new(Axis::fit(args.range.field.clone()), Axis::fit("largest load, g"), 190)
        .line(curve(&|p| p.peak_load_g), Ink::Vermillion);
    let figure = Figure {
        title: "One field varied",
        caption: format!(
            "{} runs at each of {} values of {}: miss, share deployed inside the box with 95 % bounds, median deploy \
             altitude, largest load.",
            args.runs,
            points.len(),
            args.range.field
        ),
        legend: vec![
            (Mark::Line, Ink::Blue, "median, 95 % bounds".into()),
            (Mark::Line, Ink::Orange, "90 %".into()),
            (Mark::Line, Ink::Vermillion, "largest".into()),
            (Mark::Line, Ink::Green, "undispersed".into()),
        ],
        panels: vec![misses, success, altitude, load],
        missing: "No run deployed.",
    };
    let figure = figure.render()?;
    let body = html! {
        header { p.kicker { "Aeroshell sweep" } h1 { (args.scenario) ": " (args.range.field) } }
        section { div.wide { (figure) } }
        section { h2 { "Table" } pre { (text(args, points)) } }
    };
    Ok(document("Aeroshell sweep", &body))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_has_both_its_ends() {
        let range: Range = "entry.speed_mps=5400:5600:5".parse().unwrap();
        assert_eq!(range.values().collect::<Vec<_>>(), [5400.0, 5450.0, 5500.0, 5550.0, 5600.0]);
        let falling: Range = "a.b=1:-0.5:4".parse().unwrap();
        assert_eq!(falling.values().last(), Some(-0.5));
        assert_eq!(short(0.1 + 0.2), 0.3);
    }

    #[test]
    fn what_is_no_range_is_refused() {
        for bad in
            ["", "a", "a=1", "a=1:2", "a=1:2:1", "a=1:2:0", "a=1:2:x", "a=1:nan:3", "=1:2:3", "a=1:2:3:4", "a=1:2:-3"]
        {
            assert!(bad.parse::<Range>().is_err(), "{bad}");
        }
    }
}
