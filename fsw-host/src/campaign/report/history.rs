//! The bank over the flights as a fan, the work of guidance, the errors of navigation.

use super::super::columns::BANK;
use super::super::statistics::quantile;
use super::super::summary::ascending;
use super::conditions::bars;
use super::misses::curve_of;
use super::{CampaignReportError, Material};
use crate::report::{Axis, Figure, Ink, Mark, Panel, Point};

/// Runs drawn one by one.
const SINGLE: usize = 25;

/// Bank fans, guidance, navigation.
pub fn figures(material: &Material<'_>) -> Result<Vec<Figure>, CampaignReportError> {
    let mut figures = vec![fan(material)?, work(material)?];
    figures.extend(navigation(material)?);
    Ok(figures)
}

/// The banks at every speed of the grid.
fn banks(material: &Material<'_>) -> Result<Vec<(f64, Vec<f64>)>, CampaignReportError> {
    let names: Vec<String> = material.runs.names(BANK.0).map(str::to_owned).collect();
    let mut banks = Vec::new();
    for name in names {
        let speed = name.trim_start_matches(BANK.0).trim_end_matches(BANK.1).parse::<f64>();
        if let Ok(speed_mps) = speed {
            banks.push((speed_mps, material.runs.numbers(&name)?));
        }
    }
    Ok(banks)
}

fn fan(material: &Material<'_>) -> Result<Figure, CampaignReportError> {
    let banks = banks(material)?;
    let magnitude: Vec<(f64, Vec<f64>)> = banks
        .iter()
        .map(|(speed, values)| (-speed, ascending(&values.iter().map(|b| b.abs()).collect::<Vec<_>>())))
        .collect();
    let at = |q: f64| magnitude.iter().map(move |(x, sorted)| (*x, quantile(sorted, q).unwrap_or(f64::NAN)));
    let band = |low: f64, high: f64| at(low).zip(at(high)).map(|((x, l), (_, h))| (x, l, h)).collect::<Vec<_>>();
    let x = |label: &str| Axis::fit(label).negated();
    let spread = Panel::new(x("").silent(), Axis::fit("bank magnitude, deg").every(30.0).including(0.0), 240)
        .band(band(0.01, 0.99), Ink::Blue)
        .band(band(0.25, 0.75), Ink::Blue)
        .line(at(0.5).collect(), Ink::Blue);
    let run = |k: usize| -> Vec<Point> {
        banks.iter().map(|(speed, values)| (-speed, values.get(k).copied().unwrap_or(f64::NAN))).collect()
    };
    let count = banks.first().map_or(0, |(_, values)| values.len());
    let signed = Panel::new(x("planet-relative speed, m/s"), Axis::fit("bank, deg").symmetric().every(45.0), 260);
    let signed = (0..count.min(SINGLE)).fold(signed, |panel, k| panel.thin(run(k), Ink::Orange));
    Ok(Figure {
        title: "Bank fans",
        caption: format!(
            "Above the magnitude of the bank against the falling speed: median, middle half and middle 98 % of the \
             runs. Below the first {} runs one by one with their reversals.",
            count.min(SINGLE)
        ),
        legend: vec![
            (Mark::Line, Ink::Blue, "median".into()),
            (Mark::Band, Ink::Blue, "50 % and 98 %".into()),
            (Mark::Line, Ink::Orange, "a run".into()),
        ],
        panels: vec![spread, signed],
        missing: "No run was flown.",
    })
}

fn work(material: &Material<'_>) -> Result<Figure, CampaignReportError> {
    let panel = |name: &str, label: &str, count: Option<usize>| -> Result<Panel, CampaignReportError> {
        let values = material.runs.numbers(name)?;
        let most = ascending(&values).last().copied().unwrap_or(0.0) as usize + 1;
        let panel = Panel::new(Axis::fit(label).including(0.0), Axis::fit("% of the runs").including(0.0), 180);
        Ok(match count {
            Some(count) => bars(panel, &values, count),
            // Whole numbers: a bar each.
            None => (0..most).fold(panel, |panel, whole| {
                let hits = values.iter().filter(|v| **v == whole as f64).count();
                let (share, x) = (100.0 * hits as f64 / values.len().max(1) as f64, whole as f64);
                let corners = vec![(x - 0.4, 0.0), (x + 0.4, 0.0), (x + 0.4, share), (x - 0.4, share)];
                panel.with(crate::report::Layer::Area { corners, ink: Ink::Orange, opacity: 0.75 })
            }),
        })
    };
    Ok(Figure {
        title: "Work of guidance",
        caption:
            "Bank reversals of a flight; evaluations of the equations of motion in a guidance cycle, mean and most \
                  of each flight."
                .into(),
        legend: vec![(Mark::Band, Ink::Orange, "runs".into())],
        panels: vec![
            panel("reversals", "bank reversals", None)?,
            panel("evaluations_mean", "mean evaluations a cycle", Some(40))?,
            panel("evaluations_max", "most evaluations in a cycle", Some(40))?,
        ],
        missing: "No run was flown.",
    })
}

fn navigation(material: &Material<'_>) -> Result<Option<Figure>, CampaignReportError> {
    let position = ascending(&material.runs.numbers("navigation_position_error_m")?);
    // Ideal navigation has no errors to show.
    if position.last().is_none_or(|largest| *largest <= 0.0) {
        return Ok(None);
    }
    let velocity = ascending(&material.runs.numbers("navigation_velocity_error_mps")?);
    // The curve takes km and gives the logarithm: these axes are linear.
    let curve = |sorted: &[f64]| -> Vec<Point> {
        curve_of(sorted, sorted.len()).into_iter().map(|(x, y)| (10f64.powf(x), y)).collect()
    };
    let panel = |label: &str, sorted: &[f64]| {
        let y = Axis::fixed("within, % of the runs", 0.0, 100.0);
        Panel::new(Axis::fit(label).including(0.0), y, 210).line(curve(sorted), Ink::Blue)
    };
    Ok(Some(Figure {
        title: "Errors of navigation at deployment",
        caption: "Estimate against truth at the last epoch before deployment.".into(),
        legend: vec![(Mark::Line, Ink::Blue, "runs".into())],
        panels: vec![panel("position error, m", &position), panel("velocity error, m/s", &velocity)],
        missing: "",
    }))
}
