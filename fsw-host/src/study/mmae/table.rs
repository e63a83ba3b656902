//! Tables of the study, for terminal and page.

use fsw_study::mmae::bars::{Bar, TABLE_5};
use fsw_study::mmae::case::{CaseResult, FilterResult, Rmse};

use crate::report::number;

/// Columns.
pub const COLUMNS: usize = 16;
/// What is beyond it is told by its order of magnitude.
const HUGE: f64 = 99_999.5;

/// What the row of that name is.
pub const ATTAINED: &str = "Attained: errors on these very draws of the linear filter whose covariance is the bound; \
    others scatter with it.";

/// What the figures of the flight processor are.
pub const M7: &str = "M7: instructions of a step on the Cortex-M7, in EKFs too, as cargo xtask study-cost counted them for \
    the default settings and this rate, of a filter that stops up to that step; with others there is no figure.";

/// A row.
pub type Row = [String; COLUMNS];

/// Heads of the columns.
pub const HEADS: [&str; COLUMNS] = [
    "filter",
    "x m",
    "y m",
    "z m",
    "vx m/s",
    "vy m/s",
    "vz m/s",
    "3-D m",
    "3-D m/s",
    "NEES",
    "indef. %",
    "diverged",
    "failed",
    "EKFs",
    "M7 instr.",
    "M7 EKFs",
];

/// A figure, or a dash where there is none.
pub fn figure(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        "–".to_owned()
    } else if value.abs() > HUGE {
        format!("{value:.0e}")
    } else {
        number(value, decimals)
    }
}

/// What a case is.
pub fn title(case: &CaseResult) -> String {
    let name = match case.name {
        "fixed" => "One density, all else known (P3 Figs. 5 to 9)",
        "table5" => "P3's Monte Carlo (Figs. 10 and 11, Table 5)",
        "ranking" => "All filters on the same draws",
        "efficiency" => "The augmented filter against the bound",
        _ => "Density in waves, accelerometer biased",
    };
    format!("{name}: scenario {}, reading {:?} at {} Hz, {} runs", case.scenario, case.reading, case.rate_hz, case.runs)
}

fn row(name: &str, rmse: &Rmse, rest: [String; 7]) -> Row {
    let [x, y, z, vx, vy, vz] = rmse.axes;
    let [nees, indefinite, diverged, failed, cost, m7, m7_cost] = rest;
    [
        name.to_owned(),
        figure(x, 1),
        figure(y, 1),
        figure(z, 1),
        figure(vx, 4),
        figure(vy, 4),
        figure(vz, 4),
        figure(rmse.position_m, 1),
        figure(rmse.velocity_mps, 4),
        nees,
        indefinite,
        diverged,
        failed,
        cost,
        m7,
        m7_cost,
    ]
}

fn none() -> [String; 7] {
    std::array::from_fn(|_| "–".to_owned())
}

fn of_filter(filter: &FilterResult) -> Row {
    let rest = [
        figure(filter.nees.unwrap_or(f64::NAN), 2),
        figure(100.0 * filter.indefinite_share, 1),
        filter.diverged.to_string(),
        filter.failed.to_string(),
        figure(filter.ekfs.unwrap_or(f64::NAN), 2),
        filter.m7_instructions.map_or_else(|| "–".to_owned(), |count| number(count, 0)),
        figure(filter.m7_ekfs.unwrap_or(f64::NAN), 2),
    ];
    row(&filter.label, &filter.rmse, rest)
}

/// Heads, what the paper says, the bounds and what attains the first on the same draws, the filters.
pub fn rows(case: &CaseResult) -> Vec<Row> {
    let mut rows = vec![HEADS.map(str::to_owned)];
    if case.name == "table5" {
        let said = TABLE_5.get(case.scenario - 1).copied().unwrap_or([f64::NAN; 6]);
        rows.push(row("P3, Table 5", &Rmse::of_roots(said), none()));
    }
    if let Some(bound) = &case.bound {
        rows.push(row("bound", &bound.unknown_density, none()));
        rows.push(row("attained on these", &bound.attained, none()));
        rows.push(row("bound, density known", &bound.known_density, none()));
    }
    rows.extend(case.filters.iter().map(of_filter));
    rows
}

/// The figure of a bar.
pub fn bar_value(bar: &Bar) -> String {
    figure(bar.value.unwrap_or(f64::NAN), 3)
}

/// What is asked of it.
pub fn bar_limits(bar: &Bar) -> String {
    match (bar.low, bar.high) {
        (Some(low), Some(high)) => format!("{low} to {high}"),
        (None, Some(high)) => format!("at most {high}"),
        (Some(low), None) => format!("at least {low}"),
        (None, None) => String::new(),
    }
}

/// Deviation of a root mean square over three axes and `runs` runs, %: 1/√(2·runs) for one axis, the worst case.
pub fn uncertainty_pct(runs: u64) -> String {
    figure(100.0 / (2.0 * runs as f64).sqrt(), 1)
}

/// When and how filters stopped.
pub fn failures(case: &CaseResult) -> Vec<String> {
    let told = |filter: &FilterResult| {
        let failure = filter.failure.as_ref()?;
        Some(format!(
            "{}: {} of {} runs, {} s to {} s after entry: {}",
            filter.label,
            filter.failed,
            filter.runs,
            number(failure.first_s, 1),
            number(failure.last_s, 1),
            failure.words
        ))
    };
    case.filters.iter().filter_map(told).collect()
}
