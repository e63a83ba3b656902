//! From a whole flight to its [`Summary`]. Peaks and errors come from the truth, everything else from telemetry.

use fsw_core::guidance::cycle::MAX_EVALUATIONS;
use fsw_core::link::packet::{
    CycleOutcome, DeployCause, EventKind, Innovation, MeasurementKind, Mode, NavTlm, Verdict,
};
use fsw_core::link::parameters::DeployParameters;
use fsw_core::time::MissionTime;
use fsw_core::units::deg;

use crate::cost::slot_name;
use crate::measure::{NEES_BAND_95, miss};
use crate::record::{
    Corrector, DeployState, End, FlightRecord, LinkCounters, MeasurementCounts, Milestone, Navigation, NeesSample, Nis,
    Peak, Summary, TruthSample,
};
use crate::recorder::sample_at;

/// The summary of a closed record, less what only those who flew it know.
#[must_use]
pub fn of(record: &FlightRecord, link: LinkCounters, output_hash: String, wall_s: f64) -> Summary {
    let deployed = record.truth.last().filter(|_| record.end == End::Deployed);
    let miss = deployed.map(|sample| miss(&record.facts, sample));
    let deploy = deployed.map(deploy_state);
    let reason = why_no_success(&record.end, deploy.as_ref(), &record.facts.deploy);
    Summary {
        scenario: record.facts.name.clone(),
        seed: record.seed,
        run: record.run,
        nominal: record.nominal,
        success: reason.is_none(),
        outcome: record.end.word().to_owned(),
        reason,
        miss_m: miss.map(|m| m.miss_m),
        downrange_error_m: miss.map(|m| m.downrange_m),
        crossrange_error_m: miss.map(|m| m.crossrange_m),
        timeline: timeline(record),
        deploy,
        peak: peak(&record.truth),
        reversals: reversals(record),
        corrector: corrector(record),
        navigation: navigation(&record.nees, &record.nav),
        link,
        frames: u32::try_from(record.actuators.len()).unwrap_or(u32::MAX),
        output_hash,
        wall_s,
        ..Summary::default()
    }
}

/// True conditions at deployment, from the last true state.
pub(crate) fn deploy_state(sample: &TruthSample) -> DeployState {
    DeployState {
        time_s: sample.time_s,
        altitude_m: sample.altitude_m,
        speed_mps: sample.speed_mps,
        mach: sample.packet.mach,
        dynamic_pressure_pa: sample.packet.dynamic_pressure_pa,
        longitude_deg: deg(sample.longitude_rad),
        latitude_deg: deg(sample.latitude_rad),
    }
}

/// None for a success, else one sentence.
pub(crate) fn why_no_success(end: &End, deploy: Option<&DeployState>, limits: &DeployParameters) -> Option<String> {
    match (end, deploy) {
        (End::Deployed, Some(deploy)) => outside_the_box(deploy, limits),
        (End::Deployed, None) => Some("the parachute was fired but no true state was recorded".to_owned()),
        (End::Ground, _) => Some("the surface was reached without a parachute".to_owned()),
        (End::TimeLimit, _) => Some("the time limit of the scenario was reached without a parachute".to_owned()),
        (End::Interrupted, _) => Some("the flight was interrupted".to_owned()),
        (End::Failed(reason), _) => Some(reason.clone()),
    }
}

fn outside_the_box(deploy: &DeployState, limits: &DeployParameters) -> Option<String> {
    let checks = [
        ("altitude", deploy.altitude_m * 1e-3, limits.min_altitude_m * 1e-3, limits.max_altitude_m * 1e-3, "km", 2),
        ("Mach number", deploy.mach, limits.min_mach, limits.max_mach, "", 2),
        (
            "dynamic pressure",
            deploy.dynamic_pressure_pa,
            limits.min_dynamic_pressure_pa,
            limits.max_dynamic_pressure_pa,
            "Pa",
            0,
        ),
    ];
    let outside = checks.iter().find(|(_, value, low, high, ..)| !(*low..=*high).contains(value));
    outside.map(|(name, value, low, high, unit, digits)| {
        let text = format!("deployed outside the box: {name} {value:.digits$} {unit}, allowed {low} to {high} {unit}");
        text.replace(" ,", ",").trim_end().to_owned()
    })
}

fn peak(truth: &[TruthSample]) -> Peak {
    let largest = |value: fn(&TruthSample) -> f64| truth.iter().map(value).fold(0.0, f64::max);
    Peak {
        load_g: largest(|s| s.load_g),
        dynamic_pressure_pa: largest(|s| s.packet.dynamic_pressure_pa),
        heat_flux_wpm2: largest(|s| s.heat_flux_wpm2),
    }
}

/// Milestones in order of time: mode changes, reversals and deployment from events, peaks from the truth.
fn timeline(record: &FlightRecord) -> Vec<Milestone> {
    let truth = &record.truth;
    let mut milestones = Vec::new();
    let mut add = |event: &str, sample: Option<&TruthSample>| {
        if let Some(sample) = sample {
            milestones.push(Milestone {
                event: event.to_owned(),
                time_s: sample.time_s,
                altitude_m: sample.altitude_m,
                speed_mps: sample.speed_mps,
            });
        }
    };
    add("entry", truth.first());
    let mut overruns = Vec::new();
    for event in &record.events {
        let Some(name) = milestone_name(&event.kind) else { continue };
        let sample = match (&event.kind, &record.end) {
            // A computer that begins again does not know the time; its restart ends the flight.
            (EventKind::Restarted(_), End::Failed(_)) => truth.last(),
            // Overruns repeat; the events have them all.
            (EventKind::FrameOverrun { slot, .. }, _) if overruns.contains(slot) => continue,
            (EventKind::FrameOverrun { slot, .. }, _) => {
                overruns.push(*slot);
                sample_at(truth, event.time.as_s())
            }
            _ => sample_at(truth, event.time.as_s()),
        };
        add(&name, sample);
    }
    add("peak heat flux", largest_by(truth, |s| s.heat_flux_wpm2));
    add("peak load", largest_by(truth, |s| s.load_g));
    if record.end != End::Deployed {
        add(record.end.word(), truth.last());
    }
    milestones.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
    milestones
}

fn milestone_name(kind: &EventKind) -> Option<String> {
    match kind {
        EventKind::ModeChanged { to, .. } => mode_milestone(*to).map(str::to_owned),
        EventKind::Reversal { bank_rad } => Some(format!("bank reversal to {:+.0}°", deg(f64::from(*bank_rad)))),
        EventKind::ParachuteFired { cause, .. } => Some(
            match cause {
                DeployCause::Trigger => "parachute fired",
                DeployCause::Floor => "parachute fired at the altitude floor",
                DeployCause::MinimumSpeed => "parachute fired at the minimum speed",
                DeployCause::BoxFloor => "parachute fired at the lowest altitude of the box",
            }
            .to_owned(),
        ),
        EventKind::ImuLost { .. } => Some("inertial measurements lost".to_owned()),
        EventKind::ImuRecovered { .. } => Some("inertial measurements back".to_owned()),
        EventKind::NavigationInvalid => Some("navigation lost".to_owned()),
        EventKind::FilterGivenUp { .. } => Some("filter given up".to_owned()),
        EventKind::FrameOverrun { slot, .. } => Some(format!("overrun: {}", slot_name(*slot))),
        EventKind::Restarted(_) => Some("flight computer restarted".to_owned()),
        _ => None,
    }
}

/// Name of the milestone at which a mode begins; deployment has its own event and coasting begins at entry.
fn mode_milestone(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::Standby | Mode::Coast | Mode::Deployed => None,
        Mode::RangeControl => Some("range control"),
        Mode::HeadingAlignment => Some("heading alignment"),
        Mode::DegradedRangeControl => Some("degraded range control"),
        Mode::DegradedHeadingAlignment => Some("degraded heading alignment"),
    }
}

fn largest_by(truth: &[TruthSample], value: fn(&TruthSample) -> f64) -> Option<&TruthSample> {
    truth.iter().filter(|s| value(s) > 0.0).max_by(|a, b| value(a).total_cmp(&value(b)))
}

fn reversals(record: &FlightRecord) -> u32 {
    let events = record.events.iter().filter(|e| matches!(e.kind, EventKind::Reversal { .. })).count();
    let counted = record.guidance.last().map_or(0, |(_, g)| usize::from(g.reversals));
    u32::try_from(events.max(counted)).unwrap_or(u32::MAX)
}

fn corrector(record: &FlightRecord) -> Corrector {
    let corrects = |outcome: CycleOutcome| {
        matches!(outcome, CycleOutcome::Converged | CycleOutcome::BestSoFar | CycleOutcome::Short | CycleOutcome::Long)
    };
    let cycles: Vec<_> = record.guidance.iter().map(|(_, g)| g).filter(|g| corrects(g.outcome)).collect();
    let iterations: u32 = cycles.iter().map(|g| u32::from(g.iterations)).sum();
    Corrector {
        max_iterations: cycles.iter().map(|g| u32::from(g.iterations)).max().unwrap_or(0),
        mean_iterations: mean(f64::from(iterations), cycles.len()).unwrap_or(0.0),
        max_integrations: cycles.iter().map(|g| u32::from(g.evaluations)).max().unwrap_or(0),
        bound: u32::from(MAX_EVALUATIONS),
    }
}

fn mean(sum: f64, count: usize) -> Option<f64> {
    (count > 0).then(|| sum / count as f64)
}

fn navigation(epochs: &[NeesSample], nav: &[(MissionTime, NavTlm)]) -> Navigation {
    let norm = |v: [f64; 3]| (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    let stated =
        |sigma: fn(&NeesSample) -> [f64; 3]| epochs.last().filter(|e| e.nees.is_some()).map(|e| norm(sigma(e)));
    let nees: Vec<f64> = epochs.iter().filter_map(|e| e.nees).collect();
    let inside = nees.iter().filter(|n| (NEES_BAND_95[0]..=NEES_BAND_95[1]).contains(*n)).count();
    let tally = |kind| Tally::of(nav, kind);
    let (pressure, range, range_rate) =
        (tally(MeasurementKind::Pressure), tally(MeasurementKind::Range), tally(MeasurementKind::RangeRate));
    Navigation {
        position_error_m: epochs.last().map(|e| norm(e.position_error_m)),
        velocity_error_mps: epochs.last().map(|e| norm(e.velocity_error_mps)),
        position_sigma_m: stated(|e| e.position_sigma_m),
        velocity_sigma_mps: stated(|e| e.velocity_sigma_mps),
        position_bound_m: None,
        velocity_bound_mps: None,
        nees_mean: mean(nees.iter().sum(), nees.len()),
        inside_95_share: mean(inside as f64, nees.len()),
        nis_mean: Nis { pressure: pressure.nis(), range: range.nis(), range_rate: range_rate.nis() },
        used: MeasurementCounts { pressure: pressure.used, range: range.used, range_rate: range_rate.used },
        gated: MeasurementCounts { pressure: pressure.gated, range: range.gated, range_rate: range_rate.gated },
    }
}

/// Innovations of one kind of sensor over a flight.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    used: u32,
    gated: u32,
    squared_sum: f64,
}

impl Tally {
    fn of(nav: &[(MissionTime, NavTlm)], kind: MeasurementKind) -> Self {
        let mut tally = Self::default();
        let innovations = nav.iter().flat_map(|(_, n)| n.innovations.iter().flatten());
        innovations.filter(|i| i.kind == kind).for_each(|i| tally.add(i));
        tally
    }

    fn add(&mut self, innovation: &Innovation) {
        match innovation.verdict {
            Verdict::Used => {
                self.used += 1;
                let ratio = f64::from(innovation.value) / f64::from(innovation.sigma);
                self.squared_sum += ratio * ratio;
            }
            Verdict::Gated => self.gated += 1,
            Verdict::OutOfValidity | Verdict::NotUsed => {}
        }
    }

    fn nis(&self) -> Option<f64> {
        mean(self.squared_sum, self.used as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::tests::facts;

    #[test]
    fn a_deployment_outside_the_box_names_what_is_outside() {
        let limits = facts().deploy;
        let good = DeployState { altitude_m: 8_000.0, mach: 1.8, dynamic_pressure_pa: 600.0, ..DeployState::default() };
        assert_eq!(why_no_success(&End::Deployed, Some(&good), &limits), None);
        let low = DeployState { altitude_m: 3_210.0, ..good };
        let reason = why_no_success(&End::Deployed, Some(&low), &limits).unwrap();
        assert!(reason.contains("altitude 3.21 km, allowed"), "{reason}");
        let fast = DeployState { mach: f64::NAN, ..good };
        let reason = why_no_success(&End::Deployed, Some(&fast), &limits).unwrap();
        assert!(reason.contains("Mach number NaN, allowed"), "{reason}");
    }

    #[test]
    fn consistency_figures_count_only_what_was_used() {
        let innovation = |value, verdict| {
            Some(Innovation { kind: MeasurementKind::Range, value, sigma: 2.0, verdict, ..Innovation::default() })
        };
        let mut nav = NavTlm::default();
        nav.innovations[0] = innovation(2.0, Verdict::Used);
        nav.innovations[1] = innovation(-4.0, Verdict::Used);
        nav.innovations[2] = innovation(40.0, Verdict::Gated);
        nav.innovations[3] = innovation(40.0, Verdict::NotUsed);
        let epoch = |nees| NeesSample { nees, position_error_m: [3.0, 4.0, 0.0], ..NeesSample::default() };
        let summary = navigation(&[epoch(Some(6.0)), epoch(None), epoch(Some(20.0))], &[(MissionTime(0), nav)]);
        assert_eq!(summary.nis_mean, Nis { range: Some(2.5), ..Nis::default() });
        assert_eq!((summary.used.range, summary.gated.range), (2, 1));
        assert_eq!((summary.nees_mean, summary.inside_95_share), (Some(13.0), Some(0.5)));
        assert_eq!(summary.position_error_m, Some(5.0));
    }
}
