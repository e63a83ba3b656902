//! A board on a serial line, as a user meets it: the flight software's own board loop in a thread of this test, at the
//! far end of a pseudo-terminal, flown by the real program.
#![cfg(unix)]

use std::convert::Infallible;
use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use embedded_hal::digital::OutputPin;
use embedded_io::ErrorKind;
use fsw_core::executive::{Board, BoardError, Clock, FlightComputer, Room};
use fsw_core::link::discretes::Discretes;
use fsw_core::link::port::PortError;
use fsw_core::probe::{Counter, FrameMeter};
use hil_sim::transport::{Pty, PtyPair, Stream};
use serde_json::Value;

/// The board's end of the line.
struct Line(Pty);

impl embedded_io::ErrorType for Line {
    type Error = ErrorKind;
}

impl embedded_io::Read for Line {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        match self.0.read_some(buffer, Duration::from_millis(1)) {
            Ok(0) => Err(ErrorKind::TimedOut),
            Ok(n) => Ok(n),
            Err(e) if e.kind() == std::io::ErrorKind::UnexpectedEof => Ok(0),
            Err(_) => Err(ErrorKind::Other),
        }
    }
}

impl embedded_io::Write for Line {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        self.0.write_all(bytes).map(|()| bytes.len()).map_err(|_| ErrorKind::Other)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

/// An output line that leads nowhere.
struct Pin;

impl embedded_hal::digital::ErrorType for Pin {
    type Error = Infallible;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Counts what no board would exceed, so that a busy computer cannot overrun the budgets.
struct Ones(u32);

impl Counter for Ones {
    fn restart(&mut self) {
        self.0 = 0;
    }

    fn read(&mut self) -> u32 {
        self.0 += 1;
        self.0
    }
}

struct WallClock(Instant);

impl Clock for WallClock {
    fn now_us(&mut self) -> u32 {
        self.0.elapsed().as_micros() as u32
    }
}

/// A board that is switched on until its line is closed.
fn switch_on() -> (String, JoinHandle<()>) {
    let pair = PtyPair::open().expect("the system has a pseudo-terminal");
    let place = format!("serial:{}:921600", pair.slave_path.display());
    let board = std::thread::spawn(move || {
        // With our own hold on the far end gone, the end of the program is the end of the line.
        let mut held = Some(pair.slave);
        let (mut computer, mut room) = (Box::new(FlightComputer::new(7)), Room::new());
        let lines = Discretes::new(Pin, Pin, Pin).expect("these lines cannot fail");
        let mut board = Board::new(Line(pair.master), lines, &mut computer, &mut room);
        let (mut meter, mut clock) = (FrameMeter::new(Ones(0)), WallClock(Instant::now()));
        loop {
            match board.step(&mut meter, &mut clock) {
                Err(BoardError::Port(PortError::Closed | PortError::Read(ErrorKind::Other))) => return,
                _ if board.computer_mut().executive().is_armed() => held = None,
                _ => assert!(held.is_some()),
            }
        }
    });
    (place, board)
}

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("aeroshell-serial-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        fs::create_dir_all(&path).expect("a scratch folder can be made");
        Self(path)
    }

    fn aeroshell(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_aeroshell"));
        command.args(arguments).current_dir(&self.0).output().expect("the program starts")
    }

    fn fly(&self, arguments: &[&str]) -> Value {
        let flown = self.aeroshell(&[&["fly", "--json"], arguments].concat());
        serde_json::from_slice(&flown.stdout).unwrap_or_else(|e| panic!("{e}: {flown:?}"))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_board_on_a_serial_line_flies_the_bits_of_this_process() {
    let scratch = Scratch::new("bits");
    let (place, board) = switch_on();
    let there = scratch.fly(&["--computer", &place, "--out", "there"]);
    board.join().expect("the board loop does not panic");
    let here = scratch.fly(&["--out", "here"]);
    assert_eq!(there["success"], true, "{there:#}");
    for same in ["output_hash", "miss_m", "timeline"] {
        assert_eq!(there[same], here[same], "{same}");
    }
    assert_eq!(there["link"]["rejected"], here["link"]["rejected"]);
    assert_eq!(there["computer"]["place"], place);
    assert_eq!(there["computer"]["build_id"], "0000000000000007");
    assert_eq!(there["cost"]["unit"], "counts");
    assert!(there["cost"]["frame"]["max"].as_u64() > Some(0));
    let replayed = scratch.aeroshell(&["replay", "there"]);
    assert!(String::from_utf8_lossy(&replayed.stdout).starts_with("identical"), "{replayed:?}");
}

#[test]
fn the_cost_of_a_board_is_what_its_own_counter_says_of_every_frame() {
    let scratch = Scratch::new("cost");
    let (place, board) = switch_on();
    let measured = scratch.aeroshell(&["wcet", "--target", &place, "--flights", "1", "--json", "--out", "figures"]);
    board.join().expect("the board loop does not panic");
    assert_eq!(measured.status.code(), Some(0), "{measured:?}");
    let report: Value = serde_json::from_slice(&measured.stdout).expect("it prints a report");
    assert_eq!(report["target"], place);
    let unit = report["unit"].as_str().expect("it says what a figure is");
    assert!(unit.starts_with("counts of the board's own counter; no budget applies"), "{unit}");
    let row = |name: &str| {
        let rows = report["rows"].as_array().expect("there are rows");
        rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no row {name}: {report:#}"))
    };
    let frames = report["flights"][0]["frames"].as_u64().expect("the frames are counted");
    assert!(frames > 10_000 && row("whole frame")["count"] == frames, "{report:#}");
    assert!(row("whole frame")["budget"].is_null());
    // Each slot is closed by one reading of this counter, at least.
    assert!(row("slot control")["median"].as_f64() >= Some(1.0));
    assert!(row("predictor evaluation")["count"].as_u64() > Some(1_000));
    let text = fs::read_to_string(scratch.0.join("figures/wcet.txt")).expect("the table is kept");
    assert!(text.starts_with(&format!("Execution cost on {place}, 1 flight\n")), "{text}");
}

#[test]
fn in_real_time_every_frame_leaves_by_the_clock_and_what_was_granted_is_told() {
    let scratch = Scratch::new("realtime");
    let (place, board) = switch_on();
    let start = Instant::now();
    let options = ["--computer", &place, "--realtime", "--rt", "--set", "time_limit_s=2", "--out", "run"];
    let flown = scratch.fly(&options);
    board.join().expect("the board loop does not panic");
    // The hundredth frame reaches the time limit. The one before it leaves 98 frames after the first, on any machine.
    assert!(start.elapsed() >= Duration::from_millis(98 * 20));
    let kept = &flown["realtime"];
    assert_eq!(kept["frames"], 99, "{flown:#}");
    assert!(kept["wake_up_late_us"]["max"].as_f64() >= kept["wake_up_late_us"]["p50"].as_f64());
    let grant = kept["grant"].as_str().expect("it says what was granted");
    assert!(grant.contains("SCHED_FIFO") && grant.contains("memory"), "{grant}");
}

#[test]
fn a_line_that_cannot_be_used_is_refused_by_name_and_leaves_nothing() {
    let scratch = Scratch::new("refused");
    let pair = PtyPair::open().expect("the system has a pseudo-terminal");
    let place = format!("serial:{}:921600", pair.slave_path.display());
    let _line = hil_sim::transport::open_serial(place.trim_start_matches("serial:")).expect("the line is free");
    for (place, words) in [
        (place.as_str(), "the port is busy"),
        ("serial:/dev/nonexistent:921600", "no such device"),
        ("serial:/dev/ttyUSB0", "expected "),
    ] {
        for command in [["fly", "--computer", place], ["wcet", "--target", place]] {
            let refused = scratch.aeroshell(&command);
            let said = String::from_utf8_lossy(&refused.stderr).into_owned();
            assert_eq!(refused.status.code(), Some(2), "{said}");
            assert!(said.contains(words) && said.contains("serial:"), "{said}");
        }
    }
    assert_eq!(fs::read_dir(&scratch.0).expect("the folder is there").count(), 0);
}
