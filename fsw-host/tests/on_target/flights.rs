//! The default flight, whole, with the program as a user starts it.

use std::time::Instant;

use fsw_core::link::packet::RejectCounters;
use fsw_host::record::Summary;
use fsw_host::target::{Image, Target, bench};

use crate::{Scratch, said};

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_whole_flight_on_the_cortex_m7_is_that_of_this_process() {
    same_flight(Target::M7);
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_whole_flight_on_risc_v_is_that_of_this_process() {
    same_flight(Target::Rv64);
}

fn same_flight(target: Target) {
    let scratch = Scratch::new(&format!("flight-{target}"));
    // Built first, so that the time below is that of the flight.
    for image in ["flight", bench::BENCH_IMAGE] {
        Image::build(target, image).unwrap_or_else(|e| panic!("{e}"));
    }
    let here = fly(&scratch, "here", "in-process");
    let there = fly(&scratch, "there", &format!("qemu:{target}"));
    assert_eq!(there.output_hash, here.output_hash);
    assert_eq!(miss(&there), miss(&here));
    assert_eq!(there.frames, here.frames);
    assert_eq!(there.link.rejected, RejectCounters { accepted: here.link.rejected.accepted, ..Default::default() });
    assert_eq!((there.link.downlink_rejected, here.link.downlink_rejected), (0, 0));
    let cost = there.cost.expect("the board measures what its frames cost");
    assert_eq!(cost.slips, 0, "worst frame {} {}, slots {:?}", cost.frame.max, cost.unit, cost.slots);
    println!("{target}: miss {} on both, {} {} in the worst frame", miss(&here), cost.frame.max, cost.unit);
    replay(&scratch, "in-process");
    replay(&scratch, &format!("qemu:{target}"));
}

fn fly(scratch: &Scratch, run: &str, place: &str) -> Summary {
    let start = Instant::now();
    let flown = scratch.aeroshell(&["fly", "--quiet", "--computer", place, "--out", run]);
    assert_eq!(flown.status.code(), Some(0), "{}", said(&flown));
    println!("{place}: flown in {:.1} s of wall time", start.elapsed().as_secs_f64());
    scratch.summary(run)
}

fn replay(scratch: &Scratch, place: &str) {
    let start = Instant::now();
    let replayed = scratch.aeroshell(&["replay", "--quiet", "--computer", place, "there"]);
    assert_eq!(replayed.status.code(), Some(0), "{}", said(&replayed));
    println!("{place}: replayed in {:.1} s of wall time", start.elapsed().as_secs_f64());
}

/// As the summary has it, to the last digit.
fn miss(summary: &Summary) -> String {
    serde_json::to_string(&summary.miss_m.expect("the flight deployed")).expect("a number can be written")
}
