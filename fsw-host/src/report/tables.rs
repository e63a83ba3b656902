//! Tables: what happened when, and what the link counted.

use fsw_core::link::packet::{DeployCause, Event, EventKind, GivenUpCause, RejectCounters, Severity};
use maud::{Markup, html};

use super::figures::mode_name;
use super::plot::number;
use crate::cost::slot_name;
use crate::ends::restart_reason;
use crate::record::{FlightRecord, Milestone};

/// Events beyond this number are left out of the page.
const MOST_EVENTS: usize = 200;

/// Milestones, and every event behind a fold.
#[must_use]
pub fn events(record: &FlightRecord) -> Markup {
    let (milestones, events) = (&record.summary.timeline, &record.events);
    html! {
        section id="timeline" {
            h2 { "Event timeline" }
            @if milestones.is_empty() {
                p.missing { "The flight ended before its first milestone." }
            } @else {
                ol.milestones { @for milestone in milestones { (step(milestone)) } }
            }
            @if !events.is_empty() {
                details {
                    summary { "All " (events.len()) " events of the flight software" }
                    table {
                        thead { tr { th { "time, s" } th { "severity" } th.text { "event" } } }
                        tbody {
                            @for event in events.iter().take(MOST_EVENTS) {
                                tr.(severity(event)) {
                                    td { (number(event.time.as_s(), 2)) } td { (severity(event)) } td.text { (describe(&event.kind)) }
                                }
                            }
                        }
                    }
                    @if events.len() > MOST_EVENTS { p { "The first " (MOST_EVENTS) " are shown; telemetry holds them all." } }
                }
            }
        }
    }
}

fn step(milestone: &Milestone) -> Markup {
    html! {
        li {
            span.when { (number(milestone.time_s, 1)) " s" }
            span.what { (milestone.event) }
            span.note { (number(milestone.altitude_m * 1e-3, 1)) " km · " (number(milestone.speed_mps, 0)) " m/s" }
        }
    }
}

const fn severity(event: &Event) -> &'static str {
    match event.severity {
        Severity::Activity => "activity",
        Severity::Warning => "warning",
        Severity::Fault => "fault",
    }
}

/// Why a filter was given up, in words.
#[must_use]
pub fn given_up(cause: GivenUpCause) -> &'static str {
    match cause {
        GivenUpCause::Failed => "its numbers failed",
        GivenUpCause::Lost => "lost by its own account",
        GivenUpCause::Contradicted => "contradicts dead reckoning",
    }
}

/// An event in words.
fn describe(kind: &EventKind) -> String {
    let f = |value: f32, digits| number(f64::from(value), digits);
    match *kind {
        EventKind::Armed { digest } => format!("parameters accepted, digest {digest:08x}"),
        EventKind::ModeChanged { from, to } => format!("{} → {}", mode_name(from), mode_name(to)),
        EventKind::Reversal { bank_rad } => format!("bank reversal to {}°", f(bank_rad.to_degrees(), 1)),
        EventKind::ParachuteFired { cause, altitude_m, speed_mps } => {
            let cause = match cause {
                DeployCause::Trigger => "trigger",
                DeployCause::Floor => "altitude floor, last chance",
                DeployCause::MinimumSpeed => "lowest speed of the window",
                DeployCause::BoxFloor => "lowest altitude of the box",
            };
            format!(
                "parachute fired by {cause} at {} km and {} m/s (estimates)",
                f(altitude_m * 1e-3, 2),
                f(speed_mps, 1)
            )
        }
        EventKind::MeasurementGated { kind, source, ratio } => {
            format!("{kind:?} of source {source} gated at {} σ", f(ratio, 1))
        }
        EventKind::ImuLost { frames } => format!("inertial measurements missing for {frames} frames"),
        EventKind::ImuRecovered { frames } => format!("inertial measurements back after {frames} frames"),
        EventKind::PacketsRejected { count } => format!("{count} packets rejected"),
        EventKind::TargetUnreachable { miss_m } => {
            format!("target out of reach by {} km with the best bank", f(miss_m * 1e-3, 1))
        }
        EventKind::FilterGivenUp { cause } => {
            format!("filter given up ({}), dead reckoning from here on", given_up(cause))
        }
        EventKind::TargetReachable => "target in reach again".to_owned(),
        EventKind::CovarianceRestored { times } => format!("covariance restored, {times} so far"),
        EventKind::NavigationInvalid => "navigation estimate not usable".to_owned(),
        EventKind::FrameOverrun { slot, cost, budget } => {
            format!("{} took {cost} of a budget of {budget}", slot_name(slot))
        }
        EventKind::Restarted(report) => format!("flight computer restarted: {}", restart_reason(&report)),
    }
}

/// Link counters by cause.
#[must_use]
pub fn link(record: &FlightRecord) -> Markup {
    let link = &record.summary.link;
    let kib = |bytes: u64| format!("{} KiB", number(bytes as f64 / 1024.0, 0));
    let slips = record.health.last().map_or(0, |(_, health)| health.slips);
    html! {
        section id="link" {
            h2 { "Link" }
            p { "Counted by the flight computer, each cause on its own; " (kib(link.uplink_bytes)) " up, " (kib(link.downlink_bytes)) " down." }
            table.counters {
                tbody {
                    @for (name, count) in counters(&link.rejected) {
                        tr.(if count > 0 && name != "frames accepted" { "warning" } else { "activity" }) {
                            th.text { (name) } td { (number(f64::from(count), 0)) }
                        }
                    }
                    tr { th.text { "downlink frames not decoded by the host" } td { (link.downlink_rejected) } }
                    tr { th.text { "frames over budget" } td { (slips) } }
                }
            }
        }
    }
}

/// Counters with what they count.
const fn counters(c: &RejectCounters) -> [(&'static str, u32); 15] {
    [
        ("frames accepted", c.accepted),
        ("too long without a delimiter", c.overflow),
        ("COBS decoding failed", c.cobs),
        ("CRC mismatch", c.crc),
        ("not a packet of the schema", c.decode),
        ("lost (sequence numbers skipped)", c.lost),
        ("duplicates", c.duplicate),
        ("out of order", c.reordered),
        ("late or not advancing", c.late),
        ("too far ahead in time", c.early),
        ("value out of range", c.range),
        ("value not finite", c.not_finite),
        ("status forbids use", c.status),
        ("minor frames without an IMU packet", c.missed_frames),
        ("commands beyond the most of a frame", c.flooded),
    ]
}
