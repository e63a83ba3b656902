//! See the library.

use std::env;
use std::fs;
use std::io::{self, StdinLock, Write};
use std::process::ExitCode;

use fsw_core::executive::FlightComputer;
use fsw_core::link::packet::Mode;
use fsw_core::probe::{Counter, FrameMeter, Meter};
use host_bench::{ASK, ASK_FOR_END, end_of_read, instructions};
use valgrind_requests::{callgrind, valgrind};

fn main() -> ExitCode {
    let flown = env::args_os().nth(1).ok_or_else(|| io::Error::other("usage: host-bench UPLINK")).and_then(|path| {
        let log = fs::read(path)?;
        let answer = fly(&log, &mut FrameMeter::new(Instructions::begin()?));
        io::stdout().lock().write_all(&answer)
    });
    // Standard error is what Valgrind's log goes to, and standard input what it is read from: the status has to speak.
    flown.map_or_else(|error| ExitCode::from(error.raw_os_error().map_or(1, |_| 2)), |()| ExitCode::SUCCESS)
}

/// Room for what comes down the link, per byte that went up: a vector that grows would be in the figures.
const ROOM: usize = 16;

/// Flies a log as a board does: what a read brings up to its last delimiter is served at once, span by span.
fn fly(log: &[u8], meter: &mut FrameMeter<Instructions>) -> Vec<u8> {
    let (mut computer, mut answer) = (Box::new(FlightComputer::new(0)), Vec::with_capacity(ROOM * log.len()));
    let mut unread = log;
    while !unread.is_empty() {
        let (mut read, behind) = unread.split_at(end_of_read(unread));
        unread = behind;
        while !read.is_empty() {
            meter.resume();
            computer.take_probed(&mut read, meter, |bytes| answer.extend_from_slice(bytes));
            meter.pause();
            meter.counter_mut().stop();
            if computer.executive().mode() == Mode::Standby {
                meter.discard();
            }
            if let Some(cost) = meter.take() {
                computer.enter_cost(cost);
                computer.report_cost(|bytes| answer.extend_from_slice(bytes));
            }
        }
    }
    answer
}

/// What Callgrind has counted; the code that asks is not counted, apart from a few instructions around it, which are
/// taken off.
struct Instructions {
    log: StdinLock<'static>,
    counting: bool,
    /// What a reading adds to the count.
    of_a_reading: u64,
    readings: u64,
    began: u64,
}

impl Instructions {
    fn begin() -> io::Result<Self> {
        let log = io::stdin().lock();
        let mut counter = Self { log, counting: false, of_a_reading: 0, readings: 0, began: 0 };
        if valgrind::running_on_valgrind() == 0 {
            return Err(io::Error::other("not under Valgrind"));
        }
        counter.restart();
        counter.of_a_reading = u64::from(counter.read());
        counter.stop();
        Ok(counter)
    }

    fn stop(&mut self) {
        if self.counting {
            callgrind::toggle_collect();
            self.counting = false;
        }
    }

    fn start(&mut self) {
        self.counting = true;
        callgrind::toggle_collect();
    }

    /// Counted since the program began; counting has to be stopped.
    fn counted(&mut self) -> u64 {
        valgrind::monitor_command(ASK);
        valgrind::monitor_command(ASK_FOR_END);
        // A log that ends has no more to say: the figures stand still, and the reader of them finds no cost.
        instructions(&mut self.log).unwrap_or(self.began)
    }
}

impl Counter for Instructions {
    fn restart(&mut self) {
        self.stop();
        self.began = self.counted();
        self.readings = 0;
        self.start();
    }

    #[inline(never)]
    fn read(&mut self) -> u32 {
        self.stop();
        self.readings += 1;
        let own = self.readings * self.of_a_reading;
        let cost = self.counted().saturating_sub(self.began).saturating_sub(own);
        self.start();
        u32::try_from(cost).unwrap_or(u32::MAX)
    }
}
