//! What the flight computer sends every frame, every epoch, every second.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::MAX_SOURCES;
use crate::probe::{KERNEL_COUNT, SLOT_COUNT};
use crate::time::MissionTime;

/// Largest number of innovations in one [`NavTlm`].
pub const MAX_INNOVATIONS: usize = 1 + 2 * MAX_SOURCES;

/// Number of independent elements of the 6×6 covariance of position and velocity.
pub const COVARIANCE_ELEMENTS: usize = 21;

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

/// Counters and execution cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthTlm {
    /// Counters of the link and of sensor validation, by cause.
    pub rejects: RejectCounters,
    /// Worst measured cost per schedule slot since start, in the caller's unit; zero when not measured.
    pub worst_cost: [u32; SLOT_COUNT],
    /// Worst measured cost of a whole minor frame, same unit.
    pub worst_frame: u32,
    /// Frames that took longer than their budget.
    pub slips: u16,
    /// Deepest stack use seen, bytes; zero when not measured.
    pub stack_high_water_bytes: u32,
    /// Minor frames run.
    pub frames: u32,
    /// Events lost because the log was full.
    pub events_lost: u16,
}

/// Execution cost of one minor frame, as its board measured it; the unit is the board's (instructions, cycles).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CostTlm {
    /// Index of the minor frame.
    pub frame: u32,
    /// The whole frame.
    pub whole: u32,
    /// Per slot of the schedule.
    pub slots: [u32; SLOT_COUNT],
    /// Per algorithm, [`Kernel::ALL`](crate::probe::Kernel::ALL).
    pub kernels: [u32; KERNEL_COUNT],
    /// Units of work per algorithm.
    pub units: [u16; KERNEL_COUNT],
    /// Deepest stack use so far, bytes.
    pub stack_high_water_bytes: u32,
}

impl RejectCounters {
    /// Nothing counted.
    pub const NONE: Self = Self {
        accepted: 0,
        overflow: 0,
        cobs: 0,
        crc: 0,
        decode: 0,
        lost: 0,
        duplicate: 0,
        reordered: 0,
        late: 0,
        early: 0,
        range: 0,
        not_finite: 0,
        status: 0,
        missed_frames: 0,
        flooded: 0,
    };
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
    /// Commands and greetings beyond those that one minor frame of the flight answers.
    pub flooded: u32,
}
