//! A whole flight whose guidance takes too long for a while: seen, told, and survived.

use fsw_core::executive::schedule::SCHEDULE;
use fsw_core::link::packet::{CycleOutcome, EventKind, GuidanceTlm};
use fsw_core::probe::SlotId;
use fsw_core::time::FRAMES_PER_SECOND;
use fsw_host::record::FlightRecord;
use hil_sim::scenario::Scenario;

const START_S: f64 = 120.0;
const DURATION_S: f64 = 5.0;

fn fly(faults: &str) -> FlightRecord {
    let scenario = Scenario::resolve("msl", &[format!("fault=[{faults}]")]).unwrap_or_else(|e| panic!("{e}"));
    fsw_host::fly::fly_in_process(&scenario, 1, 0, false).unwrap_or_else(|e| panic!("{e}"))
}

/// What guidance reported while it was held up, from the end of the first cycle without work on.
fn reports(record: &FlightRecord) -> Vec<GuidanceTlm> {
    let held_up = START_S + 1.0..START_S + DURATION_S + 0.5;
    record.guidance.iter().filter(|(time, _)| held_up.contains(&time.as_s())).map(|(_, report)| *report).collect()
}

#[test]
fn an_overrun_in_flight_is_counted_reported_throttled_and_survived_with_the_last_command() {
    let undisturbed = fly("");
    let disturbed =
        fly(&format!("{{kind=\"overrun\", target=\"computer\", start_s={START_S:.1}, duration_s={DURATION_S:.1}}}"));

    let frames = DURATION_S as u32 * FRAMES_PER_SECOND;
    let slips = |record: &FlightRecord| record.health.last().map(|(_, health)| u32::from(health.slips));
    assert_eq!((slips(&undisturbed), slips(&disturbed)), (Some(0), Some(frames)));

    let budget = SCHEDULE.iter().find(|slot| slot.id == SlotId::Guidance).map(|slot| slot.budget);
    let overruns: Vec<f64> = disturbed
        .events
        .iter()
        .filter_map(|event| match event.kind {
            EventKind::FrameOverrun { slot, cost, budget: told } => {
                assert_eq!((slot, Some(told), Some(cost)), (SlotId::Guidance as u8, budget, budget.map(|b| 2 * b)));
                Some(event.time.as_s())
            }
            _ => None,
        })
        .collect();
    assert_eq!(overruns.len(), DURATION_S as usize, "{overruns:?}");
    // Times are whole microseconds.
    assert!(overruns.windows(2).all(|pair| pair[1] - pair[0] > 1.0 - 1e-9), "{overruns:?}");

    let (worked, held) = (reports(&undisturbed), reports(&disturbed));
    assert_eq!(held.len(), DURATION_S as usize, "{held:?}");
    assert!(held.iter().all(|report| report.outcome == CycleOutcome::Held), "{held:?}");
    assert!(held.iter().all(|report| report.bank_rad.to_bits() == held[0].bank_rad.to_bits()), "{held:?}");
    assert!(worked.windows(2).any(|pair| pair[0].bank_rad != pair[1].bank_rad), "there was nothing to hold up");

    println!("miss {:?} m, undisturbed {:?} m", disturbed.summary.miss_m, undisturbed.summary.miss_m);
    assert!(disturbed.summary.success, "{:?}", disturbed.summary.reason);
}
