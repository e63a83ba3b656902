//! Where the flight software ran, what it cost there, and how the wall clock was kept.

use maud::{Markup, html};

use super::plot::number;
use crate::cost::{Cost, SlotCost};
use crate::realtime::RealTime;
use crate::record::{Computer, FlightRecord};

/// The section.
#[must_use]
pub fn section(record: &FlightRecord) -> Markup {
    let summary = &record.summary;
    html! {
        section id="computer" {
            h2 { "Flight computer" }
            (identity(&summary.computer))
            @match &summary.cost {
                Some(cost) => (cost_table(cost)),
                None => p.missing { "It told no measured cost." },
            }
            @if let Some(kept) = &summary.realtime { (realtime(kept)) }
        }
    }
}

fn identity(computer: &Computer) -> Markup {
    html! {
        p {
            "The flight software ran " b { (whereabouts(&computer.place)) }
            @if let Some(build) = &computer.build_id { ", build " code { (build) } }
            @if let Some(image) = &computer.image { ", image " code { (image) } }
            "."
        }
        @if let Some(hash) = &computer.image_sha256 { p.hash { "Image in memory, SHA-256 " code { (hash) } } }
    }
}

/// A place in words.
fn whereabouts(place: &str) -> String {
    match place.split_once(':') {
        Some(("qemu", "m7")) => "on a Cortex-M7 in QEMU".into(),
        Some(("qemu", "rv64")) => "on a RISC-V 64 in QEMU".into(),
        Some(("serial", line)) => format!("on a board at {line}"),
        _ => "in the process of the simulator".into(),
    }
}

fn cost_table(cost: &Cost) -> Markup {
    let scale = cost.frame.budget.unwrap_or(cost.frame.max).max(1);
    html! {
        table.cost {
            thead {
                tr {
                    th.text { "worst of the flight, " (cost.unit) }
                    th { "cost" }
                    @if cost.frame.budget.is_some() { th { "budget" } th { "used" } }
                    th.text { "" }
                }
            }
            tbody { @for line in cost.slots.iter().chain([&cost.frame]) { (cost_line(line, scale)) } }
        }
        p.caption { (footnote(cost)) }
    }
}

fn cost_line(line: &SlotCost, scale: u32) -> Markup {
    let share = |of: u32| 100.0 * f64::from(line.max) / f64::from(of.max(1));
    let over = line.budget.is_some_and(|budget| line.max > budget);
    html! {
        tr.(if over { "warning" } else { "within" }) {
            th.text { (line.name) }
            td { (number(f64::from(line.max), 0)) }
            @if let Some(budget) = line.budget {
                td { (number(f64::from(budget), 0)) }
                td { (number(share(budget), 0)) " %" }
            }
            td.text { span.bar { span style=(format!("width:{:.1}%", share(scale).min(100.0))) {} } }
        }
    }
}

fn footnote(cost: &Cost) -> String {
    let unit = match cost.unit.as_str() {
        "ns" => {
            "Wall time on the computer that ran the simulator, which other programs share; budgets hold for the flight processor. "
        }
        "instructions" => "Instructions executed, not cycles; as the flight computer told last, once a second. ",
        _ => "In the unit of the board's own counter; as it told last, once a second. ",
    };
    let stack = cost
        .stack_high_water_bytes
        .map_or_else(String::new, |bytes| format!(" Deepest stack {} bytes.", number(f64::from(bytes), 0)));
    let slips = match cost.slips {
        0 => "No frame over budget.".into(),
        1 => "One frame over budget.".into(),
        n => format!("{n} frames over budget."),
    };
    format!("{unit}{slips}{stack}")
}

fn realtime(kept: &RealTime) -> Markup {
    let late = &kept.wake_up_late_us;
    html! {
        h3 { "By the wall clock" }
        p {
            (number(f64::from(kept.frames), 0)) " frames at 50 a second; they left late by "
            b { (number(late.p50, 0)) " µs" } " in the median, " b { (number(late.p99, 0)) " µs" } " at 99 %, "
            b { (number(late.max, 0)) " µs" } " at worst. "
            @match kept.misses {
                0 => { "Every answer came before the next frame was due." }
                n => { b { (n) } " answers came after the next frame was due." }
            }
        }
        @if let Some(grant) = &kept.grant { p.caption { "The operating system: " (grant) "." } }
    }
}
