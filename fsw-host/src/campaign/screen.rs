//! The summary of a campaign on the terminal.

use std::fmt::Write as _;
use std::path::Path;

use console::style;

use super::statistics::Share;
use super::summary::{Distribution, Spread, Summary};

/// Width of the rules of the screen.
const WIDTH: usize = 78;

/// The whole screen as text; colours only where the terminal has them.
#[must_use]
pub fn summary(s: &Summary, folder: &Path) -> String {
    let mut out = String::new();
    headline(&mut out, s);
    misses(&mut out, s);
    split(&mut out, s);
    spreads(&mut out, s);
    guidance(&mut out, s);
    worst(&mut out, s);
    rule(&mut out, "");
    if let Some(rate) = s.runs_per_s {
        let _ = writeln!(out, "  wall    {:.1} s, {rate:.1} runs a second", s.wall_s);
    }
    let _ = writeln!(out, "  report  {}", style(folder.join(super::folder::REPORT).display()).cyan().bold());
    out
}

fn rule(out: &mut String, title: &str) {
    let head = if title.is_empty() { String::new() } else { format!("── {title} ") };
    let tail = "─".repeat(WIDTH.saturating_sub(head.chars().count()));
    let _ = writeln!(out, "{}", style(format!("{head}{tail}")).blue());
}

/// A share with its bounds.
#[must_use]
pub fn share(share: &Share) -> String {
    format!("{:6.2} %  [{:.2} … {:.2}]", share.value, share.low, share.high)
}

fn headline(out: &mut String, s: &Summary) {
    let last = (s.first + s.runs).saturating_sub(1);
    let _ = writeln!(out, "\n{}  seed {} runs {} to {last}", style(&s.scenario).bold(), s.seed, s.first);
    if let Some(success) = &s.success_pct {
        let _ = writeln!(out, "  {} deployed inside the box", share(success));
    }
    let ends: Vec<_> = s.outcomes.iter().map(|(word, count)| format!("{count} {word}")).collect();
    let _ = writeln!(out, "  {}", ends.join(", "));
}

fn misses(out: &mut String, s: &Summary) {
    rule(out, "miss, with 95 % bounds");
    for (ring, within) in s.within_pct.rings() {
        if let Some(within) = within {
            let _ = writeln!(out, "  within {ring:<6} {}", share(&within));
        }
    }
    let _ =
        writeln!(out, "{}", style("                     50 %      90 %      99 %    99.9 %       max      mean").dim());
    distribution(out, "miss", s.miss_m.as_ref(), 1e-3, "km");
    distribution(out, "navigation", s.navigation_position_error_m.as_ref(), 1.0, "m");
    distribution(out, "navigation", s.navigation_velocity_error_mps.as_ref(), 1.0, "m/s");
    unreachable(out, s);
}

fn unreachable(out: &mut String, s: &Summary) {
    let u = &s.unreachable;
    if u.ever == 0 {
        return;
    }
    let missed = u
        .miss_m
        .map_or_else(String::new, |m| format!(", which missed by {:.3} to {:.3} km", m.min * 1e-3, m.max * 1e-3));
    let (ever, to_end) = (u.ever, u.at_end);
    let _ = writeln!(out, "  called unreachable by the flight software: {ever} runs, {to_end} to the end{missed}");
    if let Some(within) = u.others_within_pct.km2_5 {
        let _ = writeln!(out, "  the others within 2.5 km: {}", share(&within));
    }
}

fn distribution(out: &mut String, name: &str, d: Option<&Distribution>, scale: f64, unit: &str) {
    // Ideal navigation has no errors to show.
    let Some(d) = d.filter(|d| d.max > 0.0) else { return };
    let of = |v: f64| format!("{:>10.3}", v * scale);
    let cells = [d.p50, d.p90, d.p99, d.p999, d.max, d.mean].map(of).concat();
    let _ = writeln!(out, "  {name:<10} {unit:<4}{cells}");
    let bound = |b: Option<f64>| b.map_or_else(|| "–".to_owned(), |v| format!("{:.3}", v * scale));
    let range = |[low, high]: [Option<f64>; 2]| format!("{} … {}", bound(low), bound(high));
    let text = format!("50 % [{}], 99 % [{}]", range(d.bounds.p50), range(d.bounds.p99));
    let _ = writeln!(out, "                 {}", style(text).dim());
}

fn split(out: &mut String, s: &Summary) {
    let Some(split) = &s.split else { return };
    rule(out, "where the miss comes from");
    let _ = writeln!(
        out,
        "  atmosphere {:.0} %, navigation {:.0} %, guidance and vehicle {:.0} % of the mean squared miss ({} runs)",
        split.atmosphere_pct, split.navigation_pct, split.guidance_pct, split.runs
    );
    if let Some(b) = split.bounds {
        let range = |[low, high]: [f64; 2]| format!("{low:.0} … {high:.0}");
        let (air, navigation, guidance) = (range(b.atmosphere_pct), range(b.navigation_pct), range(b.guidance_pct));
        let text = format!("95 % bounds [{air}], [{navigation}], [{guidance}]");
        let _ = writeln!(out, "  {}", style(text).dim());
    }
    let _ = writeln!(
        out,
        "  root mean square {:.0} m as flown, {:.0} m with known density, {:.0} m with ideal navigation too",
        split.flown_m, split.known_density_m, split.ideal_navigation_m
    );
}

fn spreads(out: &mut String, s: &Summary) {
    rule(out, "deployment and peaks");
    let _ = writeln!(out, "{}", style("                            min       1 %      50 %      99 %       max").dim());
    let d = &s.deploy;
    spread(out, "altitude, km", d.altitude_m.as_ref(), 1e-3, 2);
    spread(out, "speed, m/s", d.speed_mps.as_ref(), 1.0, 1);
    spread(out, "Mach number", d.mach.as_ref(), 1.0, 2);
    spread(out, "dynamic pressure, Pa", d.dynamic_pressure_pa.as_ref(), 1.0, 0);
    spread(out, "peak load, g", s.peak.load_g.as_ref(), 1.0, 2);
    spread(out, "peak heat flux, kW/m²", s.peak.heat_flux_wpm2.as_ref(), 1e-3, 0);
    spread(out, "peak pressure, kPa", s.peak.dynamic_pressure_pa.as_ref(), 1e-3, 2);
    let v = &s.violations;
    let limits = [
        ("load", v.load),
        ("heat flux", v.heat_flux),
        ("dynamic pressure", v.dynamic_pressure),
        ("deploy altitude", v.deploy_altitude),
        ("deploy Mach number", v.deploy_mach),
        ("deploy dynamic pressure", v.deploy_dynamic_pressure),
    ];
    let broken: Vec<_> = limits.iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{n} {name}")).collect();
    if !broken.is_empty() {
        let _ = writeln!(out, "  {}", style(format!("beyond a limit: {}", broken.join(", "))).red().bold());
    }
}

fn spread(out: &mut String, name: &str, spread: Option<&Spread>, scale: f64, digits: usize) {
    let Some(s) = spread else { return };
    let cells = [s.min, s.p01, s.p50, s.p99, s.max].map(|v| format!("{:>10.digits$}", v * scale)).concat();
    let _ = writeln!(out, "  {name:<22}{cells}");
}

fn guidance(out: &mut String, s: &Summary) {
    rule(out, "guidance");
    let g = &s.guidance;
    if let (Some(predictions), Some(evaluations)) = (g.predictions_per_cycle, g.evaluations_per_cycle) {
        let _ = writeln!(
            out,
            "  a cycle   {predictions:.2} predictions, most {}; {evaluations:.0} evaluations, most {}",
            g.max_predictions, g.max_evaluations
        );
    }
    if let Some(reversals) = &s.reversals {
        let _ = writeln!(out, "  reversals {:.2} a flight, most {:.0}", reversals.mean, reversals.max);
    }
}

fn worst(out: &mut String, s: &Summary) {
    if s.worst.is_empty() {
        return;
    }
    rule(out, "worst runs");
    for run in &s.worst {
        let miss = run.miss_m.map_or_else(String::new, |m| format!("{:.3} km", m * 1e-3));
        let _ = writeln!(out, "  {miss:>10}   {}", run.command);
    }
}
