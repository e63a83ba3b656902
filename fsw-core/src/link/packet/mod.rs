//! Packets of the link, both directions. `doc/icd.md` states every field with unit, size and range.
//!
//! Every packet travels in a [`Frame`] with the sender's sequence number and time stamp.

mod command;
mod event;
mod telemetry;
mod uplink;

pub use command::{Command, CommandOutcome, CommandReply, Injection, Pace, Refusal};
pub use event::{DeployCause, Event, EventKind, GivenUpCause, RestartReason, RestartReport, Severity};
pub use telemetry::{
    Actuator, COVARIANCE_ELEMENTS, CostTlm, CycleOutcome, GuidanceTlm, HealthTlm, Innovation, MAX_INNOVATIONS,
    MeasurementKind, Mode, NavTlm, RejectCounters, Verdict,
};
pub use uplink::{DELTA_THETA_LSB_RAD, DELTA_V_LSB_MPS, Imu, Pressure, Radio, Truth};

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use crate::time::MissionTime;

/// Version of the protocol; changes with the meaning of a packet. Its shape is covered by the schema hash.
pub const PROTOCOL_VERSION: u16 = 1;

/// Largest number of radio sources (orbiters and beacons).
pub const MAX_SOURCES: usize = 4;

/// Envelope of every packet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame<P> {
    /// Sequence number of the sender, plus one per packet, wrapping.
    pub sequence: u16,
    /// Sender's mission time.
    pub time: MissionTime,
    /// The packet.
    pub packet: P,
}

/// Packets to the flight computer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)] // no_std, no boxes: the largest packet sizes the buffer anyway
pub enum Uplink {
    /// First exchange.
    Hello(Hello),
    /// Inertial increments of the minor frame that ends at the frame's time stamp; closes the frame in lock-step.
    Imu(Imu),
    /// Stagnation pressure.
    Pressure(Pressure),
    /// Range and range-rate to one source.
    Radio(Radio),
    /// Parameter load, arming and start.
    Command(Command),
    /// True state: simulation only, used by navigation mode `ideal` and by recorders.
    Truth(Truth),
}

/// Packets from the flight computer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[allow(clippy::large_enum_variant)]
pub enum Downlink {
    /// First exchange.
    Hello(Hello),
    /// Bank command and discretes, one per minor frame; last packet of the frame in lock-step.
    Actuator(Actuator),
    /// Navigation estimate, 10 Hz.
    NavTlm(NavTlm),
    /// Guidance command and its making, 1 Hz.
    GuidanceTlm(GuidanceTlm),
    /// Counters and execution cost, 1 Hz; outside the output hash.
    HealthTlm(HealthTlm),
    /// Something happened.
    Event(Event),
    /// Answer to a command.
    CommandReply(CommandReply),
    /// Execution cost of one frame, when asked for; outside the output hash.
    CostTlm(CostTlm),
}

/// First exchange in both directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`PROTOCOL_VERSION`] of the sender.
    pub protocol_version: u16,
    /// Hash over the shapes of all packet types.
    pub schema_hash: u64,
    /// Identity of the sender's build; outside the output hash.
    pub build_id: u64,
}
