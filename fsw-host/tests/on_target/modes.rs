//! Every algorithm that can be chosen, recorded here and replayed on the targets, all in one boot: the same bits.

use std::io;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::ValueEnum;
use fsw_core::link::packet::{CycleOutcome, Mode};
use fsw_core::link::parameters::{GuidanceMode, NavigationMode, TriggerKind};
use fsw_core::link::schema::SCHEMA_HASH;
use fsw_core::time::MissionTime;
use fsw_host::cli::{GuidanceName, TriggerName};
use fsw_host::ends::LocalComputer;
use fsw_host::linklog::{Direction, LinkLog, LinkLogWriter};
use fsw_host::pump::{self, Pace, Watch};
use fsw_host::record::{End, FlightRecord, ScenarioFacts};
use fsw_host::recorder::{FlightId, Recorder};
use fsw_host::replay;
use fsw_host::target::{Image, Target, bench};
use hil_sim::scenario::Scenario;
use hil_sim::session::Conductor;
use postcard_schema::Schema;
use postcard_schema::schema::DataModelType;

const FRAMES: u32 = 1_000;

/// Name, changes to the scenario, and what must have happened in it.
type Window = (&'static str, &'static [&'static str], fn(&FlightRecord) -> bool);

/// Where the frames are flown: the standard entry, whose first frames coast, and two that begin lower, so that range
/// control, heading alignment and the parachute come within the frames too.
const WINDOWS: [Window; 3] = [
    ("entry", &[], |record| has_mode(record, Mode::Coast)),
    ("range control", &["entry.altitude_km=40.0", "entry.longitude_deg=-79.0", "entry.latitude_deg=-42.4"], |record| {
        has_mode(record, Mode::RangeControl) && corrects(record)
    }),
    (
        "deployment",
        &["entry.altitude_km=9.0", "entry.speed_mps=520.0", "entry.longitude_deg=-73.36", "entry.latitude_deg=-41.46"],
        |record| has_mode(record, Mode::HeadingAlignment) && record.end == End::Deployed,
    ),
];

fn has_mode(record: &FlightRecord, mode: Mode) -> bool {
    record.actuators.iter().any(|actuator| actuator.mode == mode)
}

/// A cycle has found a bank; that of a waypoint out of reach, in mode `segmented`, is one too.
fn corrects(record: &FlightRecord) -> bool {
    use CycleOutcome::{BestSoFar, Constrained, Converged, Long, Short};
    record
        .guidance
        .iter()
        .any(|(_, report)| matches!(report.outcome, Converged | BestSoFar | Short | Long | Constrained))
}

#[test]
fn every_algorithm_of_the_flight_software_has_a_name_on_the_command_line() {
    let variants = |schema: &DataModelType| match schema {
        DataModelType::Enum(variants) => variants.len(),
        other => panic!("{other:?} is no choice"),
    };
    assert_eq!(NavigationMode::ALL.len(), variants(NavigationMode::SCHEMA.ty));
    assert_eq!(GuidanceName::value_variants().len(), variants(GuidanceMode::SCHEMA.ty));
    assert_eq!(TriggerName::value_variants().len(), variants(TriggerKind::SCHEMA.ty));
}

#[test]
#[ignore = "needs QEMU; run by cargo xtask test"]
fn every_mode_gives_the_same_bits_on_every_processor() {
    let flights: Vec<_> =
        every_choice().iter().flat_map(|choice| WINDOWS.map(|window| recorded(choice, window))).collect();
    let uplinks: Vec<_> = flights.iter().map(|(_, log)| bench::uplink_of(log)).collect();
    for target in Target::ALL {
        let image = Image::build(target, bench::BENCH_IMAGE).unwrap_or_else(|e| panic!("{e}"));
        let start = Instant::now();
        let answers = bench::run(target, &image, &uplinks, bench::PATIENCE).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(answers.len(), flights.len());
        let mut frames = 0;
        for ((name, log), answer) in flights.iter().zip(&answers) {
            let verdict = replay::compare(log, answer);
            assert!(verdict.identical, "{target}, {name}: {:?}", verdict.difference);
            frames += verdict.frames;
        }
        let wall_s = start.elapsed().as_secs_f64();
        println!("{target}: {} logs, {frames} frames, identical; {wall_s:.1} s of wall time", flights.len());
    }
}

/// Settings in which each algorithm of a kind meets each of the others that it talks to: every guidance with every trigger,
/// on the default navigation and on perfect one; every navigation with the default guidance.
fn every_choice() -> Vec<[String; 3]> {
    let (first, trigger) = (GuidanceName::Aeroshell, TriggerName::Speed);
    let mut choices: Vec<_> = NavigationMode::ALL.iter().map(|nav| choice(*nav, first, trigger)).collect();
    for nav in [NavigationMode::Ekf, NavigationMode::Ideal] {
        for guidance in GuidanceName::value_variants() {
            choices.extend(TriggerName::value_variants().iter().map(|trigger| choice(nav, *guidance, *trigger)));
        }
    }
    choices.dedup();
    choices
}

fn choice(nav: NavigationMode, guidance: GuidanceName, trigger: TriggerName) -> [String; 3] {
    [
        format!("navigation.filter={}", nav.name()),
        format!("guidance.mode={}", guidance.field_value()),
        format!("deploy.trigger={}", trigger.field_value()),
    ]
}

/// Flies in this process; name and link log.
fn recorded(choice: &[String; 3], (window, sets, exercises): Window) -> (String, LinkLog) {
    static CALM: AtomicBool = AtomicBool::new(false);
    let name = format!("{window}, {}", choice.join(", "));
    // At the limit itself no frame is flown any more.
    let limit = format!("time_limit_s={}", MissionTime::of_frame(FRAMES + 1).as_s());
    let sets: Vec<String> =
        sets.iter().map(|set| (*set).to_owned()).chain(choice.iter().cloned()).chain([limit]).collect();
    let scenario = Scenario::resolve("msl", &sets).unwrap_or_else(|e| panic!("{name}: {e}"));
    let mut truth = Conductor::new(&scenario, 1, 0, false).unwrap_or_else(|e| panic!("{name}: {e}"));
    let id = FlightId { seed: 1, ..FlightId::default() };
    let recorder = Recorder::new(ScenarioFacts::of(&scenario), id, scenario.time_limit_s);
    let mut log = Kept(LinkLogWriter::new(Vec::new(), SCHEMA_HASH).expect("memory can be written"));
    let pace = Pace { realtime: false, interrupt: &CALM };
    let record = pump::fly(&mut truth, &mut LocalComputer::default(), recorder, &mut log, pace);
    assert!(exercises(&record), "{name}: {:?}, {:?}", record.end, record.guidance);
    (name, LinkLog::read(log.0.into_inner().as_slice()).expect("what was written can be read"))
}

/// Keeps the link in memory.
struct Kept(LinkLogWriter<Vec<u8>>);

impl Watch for Kept {
    fn link(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        self.0.record(direction, bytes)
    }
}
