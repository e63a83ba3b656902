//! Packets of the link, both directions. `doc/icd.md` states every field with unit, size and range.
//!
//! Every packet travels in a [`Frame`] with the sender's sequence number and time stamp.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::parameters::{BlockId, ParameterBlock};
use crate::time::MissionTime;

/// Version of the protocol; changes with the meaning of a packet. Its shape is covered by the schema hash.
pub const PROTOCOL_VERSION: u16 = 1;

/// Velocity increment of one accelerometer count, m/s.
pub const DELTA_V_LSB_MPS: f64 = 1e-6;
/// Angle increment of one gyro count, rad.
pub const DELTA_THETA_LSB_RAD: f64 = 1e-8;

/// Largest number of radio sources (orbiters and beacons).
pub const MAX_SOURCES: usize = 4;
/// Largest number of innovations in one [`NavTlm`].
pub const MAX_INNOVATIONS: usize = 1 + 2 * MAX_SOURCES;
/// Number of independent elements of the 6×6 covariance of position and velocity.
pub const COVARIANCE_ELEMENTS: usize = 21;

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

/// Inertial measurement, body axes, as integer counts accumulated over one minor frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Imu {
    /// Velocity increments, counts of [`DELTA_V_LSB_MPS`].
    pub delta_v_counts: [i32; 3],
    /// Angle increments, counts of [`DELTA_THETA_LSB_RAD`].
    pub delta_theta_counts: [i32; 3],
    /// Status bits, [`Imu::ACCELEROMETER_SATURATED`] and following; 0 is healthy.
    pub status: u8,
}

impl Imu {
    /// An accelerometer axis reached its limit within the frame.
    pub const ACCELEROMETER_SATURATED: u8 = 1;
    /// A gyro axis reached its limit within the frame.
    pub const GYRO_SATURATED: u8 = 2;
    /// The unit's self test failed: data not to be used.
    pub const FAILED: u8 = 4;
}

/// Stagnation pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pressure {
    /// Stagnation pressure, Pa.
    pub stagnation_pa: f32,
    /// Status; 0 is healthy.
    pub status: u8,
}

/// One radio measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Radio {
    /// Slot of the source in the loaded parameters, 0 to [`MAX_SOURCES`] − 1.
    pub source: u8,
    /// Geometric range, m.
    pub range_m: f64,
    /// Rate of change of the range, m/s.
    pub range_rate_mps: f64,
    /// Signal quality, 0 (unusable) to 255.
    pub quality: u8,
}

/// True state of the vehicle at the frame's time stamp. Simulation only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Truth {
    /// Inertial position, m.
    pub position_m: [f64; 3],
    /// Inertial velocity, m/s.
    pub velocity_mps: [f64; 3],
    /// Attitude body → inertial, quaternion (w, x, y, z).
    pub attitude: [f64; 4],
    /// Bank angle about the air-relative velocity, rad.
    pub bank_rad: f64,
    /// Bank rate, rad/s.
    pub bank_rate_radps: f64,
    /// Atmospheric density, kg/m³.
    pub density_kgpm3: f64,
    /// Air-relative Mach number.
    pub mach: f64,
    /// Air-relative dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
}

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
    Go,
    /// Inject a fault, for tests.
    Inject(Injection),
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

/// Modes of the flight software.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Waiting for parameters, arming and start.
    #[default]
    Standby,
    /// Attitude hold at the initial bank, before the sensed load reaches the threshold.
    Coast,
    /// Range control by the predictor-corrector.
    RangeControl,
    /// Heading alignment below the switch speed.
    HeadingAlignment,
    /// Parachute fired.
    Deployed,
    /// Range control on the last valid command: navigation or guidance is lost.
    DegradedRangeControl,
    /// Heading alignment with a lost navigation or guidance.
    DegradedHeadingAlignment,
}

/// Bank command and discretes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Actuator {
    /// Index of the minor frame.
    pub frame: u32,
    /// Commanded bank acceleration, rad/s², to be held for one frame.
    pub bank_accel_radps2: f64,
    /// Commanded bank rate at the end of the frame, rad/s.
    pub bank_rate_radps: f64,
    /// Discretes, [`Actuator::MORTAR_ARM`] and following.
    pub discretes: u8,
    /// Mode.
    pub mode: Mode,
}

impl Actuator {
    /// The parachute mortar is armed.
    pub const MORTAR_ARM: u8 = 1;
    /// The parachute mortar is fired.
    pub const MORTAR_FIRE: u8 = 2;
}

/// Navigation estimate and what went into it since the packet before.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NavTlm {
    /// Inertial position, m.
    pub position_m: [f64; 3],
    /// Inertial velocity, m/s.
    pub velocity_mps: [f64; 3],
    /// Attitude body → inertial, quaternion (w, x, y, z).
    pub attitude: [f32; 4],
    /// Lower triangle, row by row, of the 6×6 covariance of inertial position and velocity; SI.
    pub covariance: [f32; COVARIANCE_ELEMENTS],
    /// Standard deviation of the attitude error per inertial axis, rad.
    pub attitude_sigma_rad: [f32; 3],
    /// Estimated accelerometer bias, m/s².
    pub accelerometer_bias_mps2: [f32; 3],
    /// Estimated gyro bias, rad/s.
    pub gyro_bias_radps: [f32; 3],
    /// Natural logarithm of the ratio of density to the onboard model, estimate.
    pub log_density: f32,
    /// Its standard deviation.
    pub log_density_sigma: f32,
    /// Bank angle about the planet-relative velocity, rad.
    pub bank_rad: f32,
    /// Innovations since the packet before.
    pub innovations: [Option<Innovation>; MAX_INNOVATIONS],
}

/// One scalar measurement as the filter saw it, used or not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Innovation {
    /// Time of the measurement.
    pub time: MissionTime,
    /// What was measured.
    pub kind: MeasurementKind,
    /// Slot of the source; 0 for pressure.
    pub source: u8,
    /// Measured minus predicted, in the unit of the measurement (Pa, m, m/s).
    pub value: f32,
    /// Its predicted standard deviation, same unit.
    pub sigma: f32,
    /// What became of it.
    pub verdict: Verdict,
}

/// Kinds of scalar measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MeasurementKind {
    /// Stagnation pressure, Pa.
    #[default]
    Pressure,
    /// Range, m.
    Range,
    /// Range-rate, m/s.
    RangeRate,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// It corrected the state.
    #[default]
    Used,
    /// Its normalised innovation lies beyond the gate.
    Gated,
    /// The model does not hold here (dynamic pressure too low, source unknown or below the horizon).
    OutOfValidity,
    /// The navigation mode does not use it.
    NotUsed,
}

/// Guidance command and its making.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuidanceTlm {
    /// Index of the guidance cycle.
    pub cycle: u32,
    /// Time at which the command acts.
    pub effective: MissionTime,
    /// Commanded bank, rad, signed.
    pub bank_rad: f64,
    /// Great-circle range to the target at `effective`, m.
    pub range_to_go_m: f64,
    /// Predicted downrange error at the trigger with the command, m, positive beyond the target.
    pub predicted_downrange_error_m: f64,
    /// Heading offset χ (P4), m, signed positive when the target lies to the right.
    pub heading_offset_m: f64,
    /// Its threshold for a reversal, m.
    pub heading_threshold_m: f64,
    /// Corrector iterations of the cycle.
    pub iterations: u8,
    /// Predictor calls of the cycle.
    pub predictions: u8,
    /// Evaluations of the equations of motion in the cycle.
    pub evaluations: u16,
    /// How the cycle ended.
    pub outcome: CycleOutcome,
    /// Bank reversals commanded so far.
    pub reversals: u8,
    /// Margins to the limits over the predicted path: 1 − predicted peak / limit for load, heat flux, dynamic pressure.
    pub margins: [f32; 3],
}

/// How a guidance cycle ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CycleOutcome {
    /// No cycle has run.
    #[default]
    Idle,
    /// The predicted miss is within tolerance.
    Converged,
    /// The bound was reached: best iterate so far.
    BestSoFar,
    /// The target lies beyond what full lift-up reaches: lift-up commanded.
    Short,
    /// The target lies before what the steepest bank reaches: that bank commanded.
    Long,
    /// Heading alignment: no prediction needed.
    Alignment,
    /// The estimate is not usable: last command kept.
    Held,
    /// A limit of load, heat flux or dynamic pressure bounds the bank; the target is missed by the predicted error.
    Constrained,
}

/// Number of schedule slots that report their cost.
pub const SLOT_COUNT: usize = 6;

/// Counters and execution cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthTlm {
    /// Counters of the link and of sensor validation, by cause.
    pub rejects: RejectCounters,
    /// Worst measured cost per schedule slot since start, in the caller's unit; zero when not measured.
    pub worst_cost: [u32; SLOT_COUNT],
    /// Frames that took longer than their budget.
    pub slips: u16,
    /// Deepest stack use seen, bytes; zero when not measured.
    pub stack_high_water_bytes: u32,
    /// Minor frames run.
    pub frames: u32,
    /// Events lost because the log was full.
    pub events_lost: u16,
}

/// Rejected and lost packets, each cause on its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RejectCounters {
    /// Frames accepted.
    pub accepted: u32,
    /// Bytes longer than any frame without a delimiter.
    pub overflow: u32,
    /// COBS decoding failed.
    pub cobs: u32,
    /// CRC-32 did not match.
    pub crc: u32,
    /// Not a packet of the schema.
    pub decode: u32,
    /// Sequence numbers skipped.
    pub lost: u32,
    /// Sequence number seen just before.
    pub duplicate: u32,
    /// Sequence number older than the newest.
    pub reordered: u32,
    /// Time stamp too old, or not advancing.
    pub late: u32,
    /// Time stamp too far ahead.
    pub early: u32,
    /// A value outside its range.
    pub range: u32,
    /// A value that is not finite.
    pub not_finite: u32,
    /// A status that forbids use.
    pub status: u32,
    /// Minor frames without an inertial measurement.
    pub missed_frames: u32,
}

/// Something happened.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// When.
    pub time: MissionTime,
    /// How grave.
    pub severity: Severity,
    /// What.
    pub kind: EventKind,
}

/// How grave an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Severity {
    /// Expected activity.
    Activity,
    /// Unexpected, handled.
    Warning,
    /// A function is lost.
    Fault,
}

/// What an event says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EventKind {
    /// Parameters accepted.
    Armed {
        /// Their digest.
        digest: u32,
    },
    /// The mode changed.
    ModeChanged {
        /// From.
        from: Mode,
        /// To.
        to: Mode,
    },
    /// A bank reversal was commanded.
    Reversal {
        /// The new commanded bank, rad.
        bank_rad: f32,
    },
    /// The parachute was fired.
    ParachuteFired {
        /// What fired it.
        cause: DeployCause,
        /// Estimated altitude, m.
        altitude_m: f32,
        /// Estimated planet-relative speed, m/s.
        speed_mps: f32,
    },
    /// A measurement was gated.
    MeasurementGated {
        /// Which.
        kind: MeasurementKind,
        /// Source slot.
        source: u8,
        /// Innovation over its standard deviation.
        ratio: f32,
    },
    /// Inertial measurements are missing.
    ImuLost {
        /// Minor frames without one.
        frames: u16,
    },
    /// Inertial measurements are back.
    ImuRecovered {
        /// Minor frames that were bridged.
        frames: u16,
    },
    /// Packets were rejected since the event before of this kind.
    PacketsRejected {
        /// How many.
        count: u16,
    },
    /// The corrector found no bank that reaches the target.
    TargetUnreachable {
        /// Predicted downrange error with the best bank, m.
        miss_m: f32,
    },
    /// The covariance was not positive and was restored.
    CovarianceRestored {
        /// Times so far.
        times: u16,
    },
    /// The navigation estimate is not usable.
    NavigationInvalid,
    /// A frame took longer than its budget.
    FrameOverrun {
        /// Slot.
        slot: u8,
        /// Cost.
        cost: u32,
        /// Budget.
        budget: u32,
    },
}

/// What fired the parachute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DeployCause {
    /// The trigger, within the deploy limits.
    #[default]
    Trigger,
    /// The altitude floor: last chance.
    Floor,
    /// The lower end of the speed window of the range trigger.
    MinimumSpeed,
}
