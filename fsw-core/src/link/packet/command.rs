//! Commands to the flight computer and their answers.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::link::parameters::{BlockId, ParameterBlock};

/// Commands to the flight computer, each answered by a [`CommandReply`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)]
pub enum Command {
    /// Replace one parameter block; refused once armed.
    Load(ParameterBlock),
    /// Send one parameter block back.
    ReadBack(BlockId),
    /// Validate all parameters and accept them if their digest is the one given; refused otherwise.
    Arm {
        /// CRC-32 over the postcard bytes of all blocks, in the order of [`crate::config::Config::blocks`].
        digest: u32,
    },
    /// Leave `Standby`; refused unless armed.
    Go {
        /// What paces the minor frames.
        pace: Pace,
    },
    /// Inject a fault, for tests.
    Inject(Injection),
    /// Send a `CostTlm` after every minor frame, or no more.
    ReportCost {
        /// Whether to send it.
        on: bool,
    },
}

/// What paces the minor frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Pace {
    /// Inertial packets alone: a frame waits for its packet as long as it takes. No verdict depends on measured cost.
    #[default]
    LockStep,
    /// The board's clock: a frame whose inertial packet does not come in time runs without it, and measured overruns
    /// make guidance shed its work.
    RealTime,
}

/// Faults that the flight software can be asked to simulate inside itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Injection {
    /// Report the next `frames` frames as longer than their budget.
    Overrun {
        /// Number of frames.
        frames: u16,
    },
    /// Begin again in `Standby`. Obeyed by test images only, which replay several flights in one boot.
    Restart,
}

/// Answer to a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)]
pub struct CommandReply {
    /// Sequence number of the frame that carried the command.
    pub to_sequence: u16,
    /// What became of it.
    pub outcome: CommandOutcome,
}

/// Outcome of a command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)]
pub enum CommandOutcome {
    /// Done.
    Accepted,
    /// The block that was asked for.
    Block(ParameterBlock),
    /// Not done, and why.
    Refused(Refusal),
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Refusal {
    /// Parameters are frozen once armed.
    AlreadyArmed,
    /// `Go` before `Arm`.
    NotArmed,
    /// The digest is not that of the parameters held.
    DigestMismatch {
        /// Digest of the parameters held.
        held: u32,
    },
    /// A block failed its range check; `field` counts from 0 within the block.
    OutOfRange {
        /// The block.
        block: BlockId,
        /// The field.
        field: u8,
    },
    /// A table row index beyond the capacity, or a table with gaps.
    BadTable {
        /// The block.
        block: BlockId,
    },
    /// The command means nothing in the present mode.
    WrongMode,
}
