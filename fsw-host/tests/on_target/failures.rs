//! Images that fail on purpose: the reason is told, and the board is a flight computer again after its restart.

use std::sync::atomic::AtomicBool;

use fsw_core::link::packet::{Actuator, EventKind, RestartReason, Severity};
use fsw_host::ends::{ComputerEnd, LocalComputer};
use fsw_host::pump::{self, Pace, Unwatched};
use fsw_host::record::{End, FlightRecord, ScenarioFacts};
use fsw_host::recorder::{FlightId, Recorder};
use fsw_host::target::{Image, Opening, Target};
use hil_sim::scenario::Scenario;
use hil_sim::session::Conductor;

use crate::{Scratch, said};

/// Longer than until the failure, long enough for some seconds of telemetry, s.
const FLIGHT: &str = "time_limit_s=4.0";
/// The minor frame after which the images fail.
const FAILING_FRAME: u32 = 100;

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_panic_is_told_and_survived() {
    fail("fail_panic", RestartReason::Panic, "its software panicked");
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_processor_fault_is_told_and_survived() {
    fail("fail_fault", RestartReason::ProcessorFault, "its processor met a fault");
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_stack_overflow_is_told_and_survived() {
    fail("fail_stack", RestartReason::StackOverflow, "its stack ran into the guard");
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_hang_is_ended_by_the_watchdog_told_and_survived() {
    fail("fail_watchdog", RestartReason::Watchdog, "its watchdog was not fed in time");
}

fn fail(name: &str, reason: RestartReason, words: &str) {
    for target in Target::ALL {
        let image = Image::build(target, name).unwrap_or_else(|e| panic!("{e}"));
        the_program_says_so(target, &image, words);
        the_board_flies_again(target, &image, reason);
    }
}

fn the_program_says_so(target: Target, image: &Image, words: &str) {
    let scratch = Scratch::new(&format!("{}-{target}", words.replace(' ', "-")));
    let (place, file) = (format!("qemu:{target}"), image.path.display().to_string());
    let flown = scratch.aeroshell(&["fly", "--quiet", "--computer", &place, "--image", &file, "--out", "run"]);
    let said = said(&flown);
    assert_eq!(flown.status.code(), Some(1), "{target}: {said}");
    let sentence = format!("the flight computer {place} restarted in flight: {words} in frame {FAILING_FRAME}");
    assert!(said.contains(&sentence), "{target}: {said}");
    let summary = scratch.summary("run");
    assert!(summary.reason.is_some_and(|reason| reason.contains(&sentence)));
    println!("{target}: {}", said.trim());
}

fn the_board_flies_again(target: Target, image: &Image, reason: RestartReason) {
    static CALM: AtomicBool = AtomicBool::new(false);
    let opening = Opening { image: Some(&image.path), interrupt: &CALM, say: &|_| () };
    let mut board = opening.emulator(target).unwrap_or_else(|e| panic!("{e}"));
    let End::Failed(why) = fly(&mut board.end).end else { panic!("{target}: it did not fail") };
    assert!(why.contains("restarted"), "{target}: {why}");

    board.end.start_over();
    let (again, here) = (fly(&mut board.end), fly(&mut LocalComputer::default()));
    assert_eq!(again.end, End::TimeLimit, "{target}");
    assert_eq!(bits(&again), bits(&here), "{target}: after its restart it flies differently");
    let told: Vec<_> = again.events.iter().filter(|e| matches!(e.kind, EventKind::Restarted(_))).collect();
    let report = |kind: &EventKind| if let EventKind::Restarted(report) = kind { Some(*report) } else { None };
    assert!(told.iter().all(|event| event.severity == Severity::Fault), "{target}");
    let report = told.first().and_then(|event| report(&event.kind)).expect("the reason is told to a new peer");
    assert_eq!((report.reason, report.frame), (reason, FAILING_FRAME), "{target}");
}

fn fly(computer: &mut dyn ComputerEnd) -> FlightRecord {
    static CALM: AtomicBool = AtomicBool::new(false);
    let scenario = Scenario::resolve("msl", &[FLIGHT.to_owned()]).unwrap_or_else(|e| panic!("{e}"));
    let mut truth = Conductor::new(&scenario, 1, 0, false).unwrap_or_else(|e| panic!("{e}"));
    let id = FlightId { seed: 1, ..FlightId::default() };
    let recorder = Recorder::new(ScenarioFacts::of(&scenario), id, scenario.time_limit_s);
    let pace = Pace { realtime: false, interrupt: &CALM };
    pump::fly(&mut truth, computer, recorder, &mut Unwatched, pace)
}

fn bits(record: &FlightRecord) -> Vec<(u32, u64, u64, u8)> {
    let of = |a: &Actuator| (a.frame, a.bank_accel_radps2.to_bits(), a.bank_rate_radps.to_bits(), a.discretes);
    record.actuators.iter().map(of).collect()
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn guidance_that_takes_too_long_is_counted_and_changes_no_bit_of_a_lock_step_flight() {
    for target in Target::ALL {
        let image = Image::build(target, "fail_overrun").unwrap_or_else(|e| panic!("{e}"));
        let scratch = Scratch::new(&format!("overrun-{target}"));
        let (place, file) = (format!("qemu:{target}"), image.path.display().to_string());
        let fly = |run: &str, more: &[&str]| {
            let flown = scratch.aeroshell(&[&["fly", "--quiet", "--set", FLIGHT, "--out", run], more].concat());
            assert_eq!(flown.status.code(), Some(1), "it ends at its time limit: {}", said(&flown));
            scratch.summary(run)
        };
        let there = fly("there", &["--computer", &place, "--image", &file]);
        let cost = there.cost.expect("the board measures what its frames cost");
        let guidance = cost.slots.iter().find(|slot| slot.name == "guidance").expect("the schedule has a slot for it");
        assert!(cost.slips > 0 && Some(guidance.max) > guidance.budget, "{target}: {cost:?}");
        assert_eq!(there.output_hash, fly("here", &[]).output_hash, "{target}");
        println!("{target}: {} slips, guidance {} of {:?}", cost.slips, guidance.max, guidance.budget);
    }
}
