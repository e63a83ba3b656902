use super::super::host::replay;
use super::super::uplink::record;
use super::*;
use fsw_core::executive::FlightComputer;
use fsw_core::link::framing::DELIMITER;
use fsw_core::link::packet::Mode;
use fsw_core::probe::{Counter, FrameMeter, Meter};
use hil_sim::transport::Local;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;

static CALM: AtomicBool = AtomicBool::new(false);
const PLACE: &str = "on the bench";

#[derive(Clone, Copy, PartialEq)]
enum Image {
    /// Begins again when told to.
    Measure,
    /// Refuses to, and nobody resets it.
    Flight,
    /// Refuses to, and is reset after so many packets that belong to no frame.
    FlightResetAfter(u32),
    /// Refuses to; the user has had enough when its flight is over.
    FlightAndEnough,
}

/// Set when a user has had enough.
static ENOUGH: AtomicBool = AtomicBool::new(false);

/// Counts so much at every reading.
struct Readings {
    count: u32,
    step: u32,
}

impl Counter for Readings {
    fn restart(&mut self) {
        self.count = 0;
    }

    fn read(&mut self) -> u32 {
        self.count += self.step;
        self.count
    }
}

fn meter(step: u32) -> FrameMeter<Readings> {
    FrameMeter::new(Readings { count: 0, step })
}

fn fresh(image: Image) -> Box<FlightComputer> {
    let mut computer = Box::new(FlightComputer::new(7));
    if image == Image::Measure {
        computer.allow_restart();
    }
    computer
}

/// A board in a thread, until its line is closed.
fn switch_on(image: Image, step: u32) -> Line<'static> {
    let (near, far) = Local::pair().unwrap();
    std::thread::spawn(move || run_board(UnixStream::from(far), image, meter(step)));
    let end = RemoteComputer::new(Box::new(near), PLACE.into(), &CALM);
    Line { reset_patience: Duration::ZERO, ..Line::new(end, PLACE, &CALM) }
}

fn run_board(mut stream: UnixStream, image: Image, mut meter: impl Meter) {
    let (mut computer, mut packet, mut idle) = (fresh(image), Vec::new(), 0);
    let mut buffer = [0u8; 64];
    while let Ok(n @ 1..) = stream.read(&mut buffer) {
        let mut answer = Vec::new();
        for byte in &buffer[..n] {
            packet.push(*byte);
            if *byte != DELIMITER {
                continue;
            }
            let frame = computer.executive().frame();
            serve(&mut computer, &std::mem::take(&mut packet), &mut meter, &mut answer);
            idle = if frame > 0 && frame == computer.executive().frame() { idle + 1 } else { 0 };
            answer.push(DELIMITER);
            computer.restart_if_asked();
            if image == Image::FlightResetAfter(idle) {
                (computer, idle) = (fresh(image), 0);
            }
            if image == Image::FlightAndEnough && idle > 0 {
                ENOUGH.store(true, Ordering::Relaxed);
            }
        }
        if stream.write_all(&answer).is_err() {
            return;
        }
    }
}

fn serve(computer: &mut FlightComputer, packet: &[u8], meter: &mut impl Meter, answer: &mut Vec<u8>) {
    meter.resume();
    computer.receive_probed(packet, meter, |bytes| answer.extend_from_slice(bytes));
    meter.pause();
    if computer.executive().mode() == Mode::Standby {
        meter.discard();
    }
    if let Some(cost) = meter.take() {
        computer.enter_cost(cost);
        computer.report_cost(|bytes| answer.extend_from_slice(bytes));
    }
}

fn short(name: &str, scenario: &str) -> HardFlight {
    HardFlight::new(name, scenario, &["time_limit_s=3"]).unwrap()
}

fn measure(line: Line<'_>, flights: &[HardFlight]) -> Result<Vec<Flown>, String> {
    line.measure(flights, &Bar::new(false, flights.len())).map_err(|error| error.to_string())
}

#[test]
fn a_board_that_begins_again_when_told_reports_of_each_flight_what_a_fresh_one_does() {
    let flights = [short("first", "msl"), short("second", "msl-beacon"), short("third", "msl")];
    let flown = measure(switch_on(Image::Measure, 1), &flights).unwrap();
    assert_eq!(flown.len(), flights.len());
    for (flight, flown) in flights.iter().zip(flown) {
        assert_eq!(flown.name, flight.name);
        assert_eq!(flown.cost, replay(&record(flight).unwrap().log, &mut meter(1)), "{}", flight.name);
    }
}

#[test]
fn a_board_that_flies_once_per_boot_is_waited_for_until_it_is_reset() {
    let flights = [short("first", "msl"), short("second", "msl")];
    // Three commands with a greeting each: the next one finds it fresh.
    let line = switch_on(Image::FlightResetAfter(6), 1);
    let flown = measure(Line { reset_patience: RESET_PATIENCE, ..line }, &flights).unwrap();
    assert_eq!(flown.len(), 2);
    assert_eq!(flown[0].cost, flown[1].cost);
}

#[test]
fn a_board_that_is_not_reset_is_told_by_name() {
    let flights = [short("first", "msl"), short("second", "msl")];
    let refused = measure(switch_on(Image::Flight, 1), &flights).unwrap_err();
    assert!(refused.starts_with("the flight computer on the bench is still in a flight"), "{refused}");
    assert_eq!(measure(switch_on(Image::Flight, 1), &flights[..1]).unwrap().len(), 1);
}

#[test]
fn a_counter_that_stands_still_is_no_measurement() {
    let refused = measure(switch_on(Image::Flight, 0), &[short("first", "msl")]).unwrap_err();
    assert_eq!(refused, "the counter of the flight computer on the bench stands still: every frame cost 0");
}

#[test]
fn an_interrupt_keeps_the_flights_that_are_done() {
    let flights = [short("first", "msl"), short("second", "msl")];
    let line = switch_on(Image::FlightAndEnough, 1);
    assert_eq!(measure(Line { interrupt: &ENOUGH, ..line }, &flights).unwrap().len(), 1);
    let (near, _far) = Local::pair().unwrap();
    let end = RemoteComputer::new(Box::new(near), PLACE.into(), &ENOUGH);
    assert_eq!(measure(Line::new(end, PLACE, &ENOUGH), &flights).unwrap_err(), "interrupted");
}

#[test]
fn a_board_that_says_nothing_is_given_up() {
    let (near, _far) = Local::pair().unwrap();
    let end = RemoteComputer::new(Box::new(near), PLACE.into(), &CALM);
    let refused = measure(Line { attempts: 2, ..Line::new(end, PLACE, &CALM) }, &[short("first", "msl")]);
    assert_eq!(
        refused.unwrap_err(),
        "the flight computer on the bench does not answer within 1 s: is it switched on, and reset since its last flight?"
    );
}
