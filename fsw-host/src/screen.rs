//! The summary screen at the end of a flight.

use std::fmt::Write as _;
use std::path::Path;

use console::{Style, style};
use fsw_core::planet::STANDARD_GRAVITY_MPS2;

use crate::record::{FlightRecord, LinkCounters, Summary};

/// Width of the rules of the screen.
const WIDTH: usize = 78;

/// The whole screen as text; colours only where the terminal has them.
#[must_use]
pub fn summary(record: &FlightRecord, folder: Option<&Path>) -> String {
    let mut out = String::new();
    let s = &record.summary;
    headline(&mut out, s);
    timeline(&mut out, s);
    deployment(&mut out, record);
    peaks(&mut out, record);
    navigation(&mut out, s);
    guidance_and_link(&mut out, record);
    computer(&mut out, record);
    rule(&mut out, "");
    let _ = writeln!(out, "  hash    {}", style(&s.output_hash).dim());
    let _ = writeln!(out, "  wall    {:.3} s for {} frames", s.wall_s, s.frames);
    if let Some(folder) = folder {
        let _ = writeln!(out, "  report  {}", style(folder.join("report.html").display()).cyan().bold());
    }
    out
}

fn rule(out: &mut String, title: &str) {
    let head = if title.is_empty() { String::new() } else { format!("── {title} ") };
    let tail = "─".repeat(WIDTH.saturating_sub(head.chars().count()));
    let _ = writeln!(out, "{}", style(format!("{head}{tail}")).blue());
}

fn headline(out: &mut String, s: &Summary) {
    let what = if s.nominal { "nominal".to_owned() } else { format!("seed {} run {}", s.seed, s.run) };
    let (mark, verdict) = if s.success {
        (style("●").green(), style("PARACHUTE DEPLOYED INSIDE THE BOX".to_owned()).green().bold())
    } else {
        let reason = s.reason.clone().unwrap_or_else(|| s.outcome.clone());
        (style("●").red(), style(format!("FAILED: {reason}")).red().bold())
    };
    let _ = writeln!(out, "\n{mark} {}  {what}  {verdict}", style(&s.scenario).bold());
    if let (Some(miss), Some(down), Some(cross)) = (s.miss_m, s.downrange_error_m, s.crossrange_error_m) {
        let _ = writeln!(
            out,
            "  {} from the target   downrange {:+.3} km   crossrange {:+.3} km",
            style(format!("{:.3} km", miss * 1e-3)).bold(),
            down * 1e-3,
            cross * 1e-3
        );
    }
}

fn timeline(out: &mut String, s: &Summary) {
    rule(out, "timeline");
    let _ = writeln!(out, "{}", style("        time      altitude         speed   event").dim());
    for m in &s.timeline {
        let _ = writeln!(
            out,
            "  {:8.2} s  {:8.3} km  {:8.1} m/s   {}",
            m.time_s,
            m.altitude_m * 1e-3,
            m.speed_mps,
            m.event
        );
    }
}

/// One value with its allowed range, green inside and red outside.
fn against(value: f64, low: f64, high: f64, digits: usize, unit: &str) -> String {
    let colour = if (low..=high).contains(&value) { Style::new().green() } else { Style::new().red().bold() };
    let value = colour.apply_to(format!("{value:>9.digits$}"));
    let unit = format!("{unit:<5}");
    format!("{value} {unit} {}", style(format!("[{} … {}]", short(low), short(high))).dim())
}

/// A limit without the digits that conversions leave behind.
fn short(limit: f64) -> f64 {
    (limit * 1e6).round() / 1e6
}

fn deployment(out: &mut String, record: &FlightRecord) {
    let Some(d) = record.summary.deploy else { return };
    let limits = &record.facts.deploy;
    rule(out, "deployment");
    let altitude = against(d.altitude_m * 1e-3, limits.min_altitude_m * 1e-3, limits.max_altitude_m * 1e-3, 3, "km");
    let pressure =
        against(d.dynamic_pressure_pa, limits.min_dynamic_pressure_pa, limits.max_dynamic_pressure_pa, 1, "Pa");
    let _ = writeln!(out, "  altitude          {altitude}");
    let _ = writeln!(out, "  Mach number       {}", against(d.mach, limits.min_mach, limits.max_mach, 3, ""));
    let _ = writeln!(out, "  dynamic pressure  {pressure}");
    let _ = writeln!(
        out,
        "  speed             {:>9.2} m/s at {:.4}° longitude, {:.4}° latitude",
        d.speed_mps, d.longitude_deg, d.latitude_deg
    );
}

fn peaks(out: &mut String, record: &FlightRecord) {
    let (p, limits) = (&record.summary.peak, &record.facts.constraints);
    rule(out, "peaks");
    let line = |name: &str, value: f64, limit: f64, unit: &str, digits: usize| {
        format!("  {name:<17} {}", against(value, 0.0, limit, digits, unit))
    };
    let _ = writeln!(out, "{}", line("sensed load", p.load_g, limits.load_mps2 / STANDARD_GRAVITY_MPS2, "g", 2));
    let _ = writeln!(out, "{}", line("heat flux", p.heat_flux_wpm2 * 1e-3, limits.heat_flux_wpm2 * 1e-3, "kW/m²", 1));
    let _ = writeln!(
        out,
        "{}",
        line("dynamic pressure", p.dynamic_pressure_pa * 1e-3, limits.dynamic_pressure_pa * 1e-3, "kPa", 2)
    );
}

fn navigation(out: &mut String, s: &Summary) {
    let n = &s.navigation;
    let (Some(position), Some(velocity)) = (n.position_error_m, n.velocity_error_mps) else { return };
    rule(out, "navigation");
    let _ = writeln!(out, "  error at the end  {position:>9.1} m    {velocity:.3} m/s");
    for (name, position, velocity) in [
        ("1σ of the filter", n.position_sigma_m, n.velocity_sigma_mps),
        ("Cramér–Rao bound", n.position_bound_m, n.velocity_bound_mps),
    ] {
        if let (Some(position), Some(velocity)) = (position, velocity) {
            let _ = writeln!(out, "  {name:<17} {position:>9.1} m    {velocity:.3} m/s");
        }
    }
    if let (Some(nees), Some(share)) = (n.nees_mean, n.inside_95_share) {
        let _ = writeln!(
            out,
            "  consistency       {nees:>9.2} mean NEES of 6, {:.0} % of epochs in the 95 % band",
            share * 100.0
        );
    }
    let kinds = [
        ("pressure", n.used.pressure, n.gated.pressure, n.nis_mean.pressure),
        ("range", n.used.range, n.gated.range, n.nis_mean.range),
        ("range-rate", n.used.range_rate, n.gated.range_rate, n.nis_mean.range_rate),
    ];
    for (name, used, gated, nis) in kinds {
        if let Some(nis) = nis {
            let _ = writeln!(out, "  {name:<17} {used:>9} used, {gated} gated, mean squared innovation {nis:.2} of 1");
        }
    }
}

fn guidance_and_link(out: &mut String, record: &FlightRecord) {
    let s = &record.summary;
    rule(out, "guidance and link");
    let _ = writeln!(
        out,
        "  corrector         {:>9.2} iterations a cycle, most {}; most evaluations {} of {}",
        s.corrector.mean_iterations, s.corrector.max_iterations, s.corrector.max_integrations, s.corrector.bound
    );
    let _ = writeln!(out, "  bank reversals    {:>9}", s.reversals);
    let _ = writeln!(
        out,
        "  link              {:>9} packets accepted, {}; {:.0} kB up, {:.0} kB down",
        s.link.rejected.accepted,
        rejects(&s.link),
        s.link.uplink_bytes as f64 * 1e-3,
        s.link.downlink_bytes as f64 * 1e-3
    );
}

/// Where the flight software ran, what it cost there and how the clock was kept.
fn computer(out: &mut String, record: &FlightRecord) {
    let s = &record.summary;
    rule(out, "flight computer");
    let image = s
        .computer
        .image_sha256
        .as_ref()
        .map_or_else(String::new, |hash| format!(", image {}", hash.get(..12).unwrap_or(hash)));
    let _ = writeln!(out, "  place             {}{}", s.computer.place, style(image).dim());
    if !record.frame_cost_us.is_empty() {
        let mean = record.frame_cost_us.iter().map(|c| f64::from(*c)).sum::<f64>() / record.frame_cost_us.len() as f64;
        let worst = record.frame_cost_us.iter().copied().fold(0.0, f32::max);
        let _ = writeln!(out, "  frame cost        {mean:>9.1} µs mean, {worst:.0} µs worst");
    } else if let Some(cost) = &s.cost {
        let (max, budget) = (f64::from(cost.frame.max), f64::from(cost.frame.budget.unwrap_or_default()));
        let _ = writeln!(out, "  worst frame       {} {}", against(max, 0.0, budget, 0, ""), cost.unit);
        let over = cost.slots.iter().filter(|slot| slot.budget.is_some_and(|budget| slot.max > budget));
        for slot in over {
            let text = format!("{} took {} of {}", slot.name, slot.max, slot.budget.unwrap_or_default());
            let _ = writeln!(out, "  over budget       {}", style(text).red().bold());
        }
        let stack = cost.stack_high_water_bytes.map_or_else(String::new, |b| format!(", deepest stack {b} bytes"));
        let _ = writeln!(out, "  frames over it    {:>9}{stack}", cost.slips);
    }
    let Some(kept) = &s.realtime else { return };
    let late = &kept.wake_up_late_us;
    let _ = writeln!(
        out,
        "  wall clock        {:>9.0} µs late in the median, {:.0} µs at 99 %, {:.0} µs at worst",
        late.p50, late.p99, late.max
    );
    let _ = writeln!(out, "  late answers      {:>9} of {} frames", kept.misses, kept.frames);
    if let Some(grant) = &kept.grant {
        let _ = writeln!(out, "  real time         {grant}");
    }
}

/// Non-zero reject counters by name, or that there are none.
fn rejects(link: &LinkCounters) -> String {
    let r = &link.rejected;
    let causes = [
        ("overflow", r.overflow),
        ("stuffing", r.cobs),
        ("checksum", r.crc),
        ("decode", r.decode),
        ("lost", r.lost),
        ("duplicate", r.duplicate),
        ("reordered", r.reordered),
        ("late", r.late),
        ("early", r.early),
        ("range", r.range),
        ("not finite", r.not_finite),
        ("status", r.status),
        ("missed frames", r.missed_frames),
        ("commands beyond the most of a frame", r.flooded),
        ("downlink", link.downlink_rejected),
    ];
    let named: Vec<_> = causes.iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{n} {name}")).collect();
    if named.is_empty() { "none rejected".to_owned() } else { named.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::link::packet::RejectCounters;

    #[test]
    fn a_value_outside_its_range_shows_the_range() {
        let text = console::strip_ansi_codes(&against(3.2, 5.0, 13.0, 2, "km")).into_owned();
        assert!(text.contains("3.20 km") && text.contains("[5 … 13]"), "{text}");
    }

    #[test]
    fn only_causes_that_happened_are_named() {
        let mut link = LinkCounters::default();
        assert_eq!(rejects(&link), "none rejected");
        link.rejected = RejectCounters { crc: 3, accepted: 9, ..RejectCounters::default() };
        assert_eq!(rejects(&link), "3 checksum");
    }
}
