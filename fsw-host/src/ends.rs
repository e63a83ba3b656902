//! The end of the link where the flight computer is, and the flight computer of this process.

use std::time::Instant;

use fsw_core::executive::FlightComputer;
use thiserror::Error;

/// Identity of this build as it says hello: the version of the package, FNV-1a.
pub const BUILD_ID: u64 = {
    let (text, mut hash, mut at) = (env!("CARGO_PKG_VERSION").as_bytes(), 0xcbf2_9ce4_8422_2325u64, 0);
    while at < text.len() {
        hash = (hash ^ text[at] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        at += 1;
    }
    hash
};

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

    /// Whether the wall time of an exchange is what the flight software costs here, and not a link to elsewhere.
    fn is_local(&self) -> bool {
        false
    }
}

/// A fresh flight computer in this process.
pub struct LocalComputer(Box<FlightComputer>);

impl Default for LocalComputer {
    fn default() -> Self {
        Self(Box::new(FlightComputer::new(BUILD_ID)))
    }
}

impl ComputerEnd for LocalComputer {
    fn exchange(
        &mut self,
        to_computer: &[u8],
        from_computer: &mut Vec<u8>,
        _until: Option<Instant>,
    ) -> Result<(), ComputerError> {
        self.0.receive(to_computer, |bytes| from_computer.extend_from_slice(bytes));
        Ok(())
    }

    fn is_local(&self) -> bool {
        true
    }
}
