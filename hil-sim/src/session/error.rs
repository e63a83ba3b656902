//! How a session can fail; every message is one clear sentence.

use fsw_core::link::handshake::HelloError;

/// Why a session ended without a flight, or a flight without an end.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SessionError {
    /// The peer cannot be talked to.
    #[error("the {peer} is refused: {error}")]
    Hello {
        /// Who.
        peer: &'static str,
        /// Why.
        error: HelloError,
    },
    /// Nothing came back.
    #[error("the {peer} does not answer {what} (waited {waited_s} s)")]
    NoAnswer {
        /// Who.
        peer: &'static str,
        /// What was to be answered.
        what: String,
        /// How long was waited, s.
        waited_s: f64,
    },
    /// A parameter block, arming or start was refused.
    #[error("the flight computer refuses {what}: {reason}")]
    Refused {
        /// The block or command.
        what: String,
        /// Why, with the field.
        reason: String,
    },
    /// What was read back is not what was sent.
    #[error("the flight computer holds another {block} than it was sent: sent {sent}, read back {held}")]
    ReadBack {
        /// The block.
        block: String,
        /// As sent.
        sent: String,
        /// As read back.
        held: String,
    },
    /// The scenario cannot be told to this flight software.
    #[error("the scenario cannot be flown: {0}")]
    Parameters(String),
    /// A stream cannot be opened.
    #[error("{place}: {reason}")]
    Open {
        /// Address or device.
        place: String,
        /// Why.
        reason: String,
    },
    /// The stream ended or failed.
    #[error("the link to the {peer} was cut {when}: {reason}")]
    Cut {
        /// Who.
        peer: &'static str,
        /// During what.
        when: String,
        /// How it showed.
        reason: String,
    },
    /// The truth simulator refused the flight, in its own words.
    #[error("the truth simulator refuses the flight: {0}")]
    Bench(String),
    /// The truth simulator speaks another protocol.
    #[error(
        "the peer's bench protocol is version {theirs}, this program's is {ours}: build both ends from the same sources"
    )]
    BenchVersion {
        /// The peer's.
        theirs: u16,
        /// Ours.
        ours: u16,
    },
}
