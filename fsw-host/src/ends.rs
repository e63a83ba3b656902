//! The end of the link where the flight computer is, and the flight computer of this process.

use std::time::Instant;

use fsw_core::executive::FlightComputer;
use fsw_core::link::handshake::build_id;
use fsw_core::link::packet::{RestartReason, RestartReport};
use fsw_core::probe::{Counter, FrameMeter, MeasuredCost, Meter};
use thiserror::Error;

/// Identity of this build as it says hello: the version of the package.
pub const BUILD_ID: u64 = build_id(env!("CARGO_PKG_VERSION"));

/// Why the flight computer cannot be flown any further.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ComputerError {
    /// It answers nothing.
    #[error("the flight computer {place} is silent: no answer within {waited_s} s")]
    Silent {
        /// Which one.
        place: String,
        /// How long was waited, s.
        waited_s: u64,
    },
    /// The line to it is cut.
    #[error("the flight computer {place} is lost: {reason}")]
    Lost {
        /// Which one.
        place: String,
        /// How it showed.
        reason: String,
    },
    /// It has begun again and knows nothing of the flight any more.
    #[error("the flight computer {place} restarted in flight: {}", restart_reason(.report))]
    Restarted {
        /// Which one.
        place: String,
        /// What it found when it started again.
        report: RestartReport,
    },
    /// The user does not want to wait any longer.
    #[error("the flight was interrupted")]
    Interrupted,
}

/// The end of the link where the flight computer is.
pub trait ComputerEnd {
    /// Hands over bytes and appends the answer. In lock-step (`until` is none) it returns when the answer is complete;
    /// in real time no later than `until`, and what comes afterwards belongs to the next exchange.
    ///
    /// # Errors
    /// The computer is lost. What was heard before is appended all the same.
    fn exchange(
        &mut self,
        to_computer: &[u8],
        from_computer: &mut Vec<u8>,
        until: Option<Instant>,
    ) -> Result<(), ComputerError>;

    /// What the last minor frame cost, ns, where this process runs the flight software.
    fn take_cost(&mut self) -> Option<MeasuredCost> {
        None
    }
}

/// Why a flight computer restarted, in words.
#[must_use]
pub fn restart_reason(report: &RestartReport) -> String {
    let RestartReport { reason, frame, address } = report;
    let reason = match reason {
        RestartReason::Panic => "its software panicked",
        RestartReason::ProcessorFault => "its processor met a fault",
        RestartReason::StackOverflow => "its stack ran into the guard",
        RestartReason::Watchdog => "its watchdog was not fed in time",
    };
    match address {
        0 => format!("{reason} in frame {frame}"),
        _ => format!("{reason} in frame {frame} at {address:#010x}"),
    }
}

/// A fresh flight computer in this process.
pub struct LocalComputer {
    computer: Box<FlightComputer>,
    meter: FrameMeter<Nanoseconds>,
}

impl Default for LocalComputer {
    fn default() -> Self {
        let meter = FrameMeter::new(Nanoseconds(Instant::now()));
        Self { computer: Box::new(FlightComputer::new(BUILD_ID)), meter }
    }
}

/// The wall clock as a counter of cost. It is kept from the flight computer, whose outputs must not depend on it.
pub(crate) struct Nanoseconds(pub(crate) Instant);

impl Counter for Nanoseconds {
    fn restart(&mut self) {
        self.0 = Instant::now();
    }

    fn read(&mut self) -> u32 {
        u32::try_from(self.0.elapsed().as_nanos()).unwrap_or(u32::MAX)
    }
}

impl ComputerEnd for LocalComputer {
    fn exchange(
        &mut self,
        to_computer: &[u8],
        from_computer: &mut Vec<u8>,
        _until: Option<Instant>,
    ) -> Result<(), ComputerError> {
        self.meter.resume();
        self.computer.receive_probed(to_computer, &mut self.meter, |bytes| from_computer.extend_from_slice(bytes));
        self.meter.pause();
        Ok(())
    }

    fn take_cost(&mut self) -> Option<MeasuredCost> {
        self.meter.take()
    }
}
