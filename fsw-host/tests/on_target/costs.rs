//! The cost of a flight as a board reports it over its line, against the same flight replayed from files.

use std::sync::atomic::AtomicBool;

use fsw_core::probe::SlotId;
use fsw_host::target::bench::{self, BENCH_IMAGE, PATIENCE};
use fsw_host::target::{Image, Opening, Target};
use fsw_host::wcet::bar::Bar;
use fsw_host::wcet::flights::HardFlight;
use fsw_host::wcet::ledger::{FlightCost, FrameCost};
use fsw_host::wcet::line::Line;
use fsw_host::wcet::uplink::record;

static CALM: AtomicBool = AtomicBool::new(false);
/// The image that flies over a line and begins again when told to.
const MEASURE_IMAGE: &str = "measure";
/// Slots whose work depends on the packets alone. Bytes come over a line in other pieces than from a file, and pieces
/// cost a little to receive.
const SLOTS: [SlotId; 5] = [SlotId::Sensors, SlotId::Navigation, SlotId::Guidance, SlotId::Control, SlotId::Telemetry];
/// Both are images of their own: the compiler lays the same algorithms out a little differently, and `SysTick` counts
/// every 40th instruction.
const TOLERANCE: f64 = 0.02;
const GRAIN: f64 = 80.0;

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn a_board_reports_over_its_line_what_the_bench_reports_in_files() {
    let flight =
        |scenario| HardFlight::new(scenario, scenario, &["time_limit_s=4.0"]).unwrap_or_else(|e| panic!("{e}"));
    let flights = [flight("msl"), flight("msl-beacon")];
    let logs: Vec<_> = flights.iter().map(|f| record(f).unwrap_or_else(|e| panic!("{e}")).log).collect();
    for target in Target::ALL {
        let image = |name| Image::build(target, name).unwrap_or_else(|e| panic!("{e}"));
        let answers = bench::run(target, &image(BENCH_IMAGE), &logs, PATIENCE).unwrap_or_else(|e| panic!("{e}"));
        let measured = image(MEASURE_IMAGE);
        let opening = Opening { image: Some(&measured.path), interrupt: &CALM, say: &|_| () };
        let board = opening.emulator(target).unwrap_or_else(|e| panic!("{e}"));
        let line = Line::new(board.end, &board.facts.place, &CALM);
        let flown = line.measure(&flights, &Bar::new(false, flights.len())).unwrap_or_else(|e| panic!("{e}"));
        for (flown, answer) in flown.iter().zip(answers) {
            let there = FlightCost::of_answer(&answer);
            assert_eq!(flown.cost.frames.len(), there.frames.len(), "{target}: {}", flown.name);
            flown.cost.frames.iter().zip(&there.frames).for_each(|(line, bench)| compare(target, line, bench));
        }
    }
}

fn compare(target: Target, line: &FrameCost, bench: &FrameCost) {
    assert_eq!((line.frame, line.units), (bench.frame, bench.units), "{target}");
    for slot in SLOTS {
        let (line_cost, bench_cost) = (f64::from(line.slots[slot as usize]), f64::from(bench.slots[slot as usize]));
        let alike = (line_cost - bench_cost).abs() <= GRAIN + TOLERANCE * bench_cost;
        assert!(alike, "{target}, frame {}, {slot:?}: {line_cost} over the line, {bench_cost} in files", line.frame);
    }
}
