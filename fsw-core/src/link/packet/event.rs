//! Typed events.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

use super::{MeasurementKind, Mode};
use crate::time::MissionTime;

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
    /// For several cycles no bank reached the target.
    TargetUnreachable {
        /// Predicted miss with the best bank, m: downrange, positive beyond the target, or, where it is worse, to the side.
        miss_m: f32,
    },
    /// The covariance was not finite and was restored to that of the start.
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
    /// The flight computer has restarted by itself.
    Restarted(RestartReport),
    /// The target called unreachable before is in reach again.
    TargetReachable,
    /// A model-based filter was given up: navigation is dead reckoning from here on.
    FilterGivenUp {
        /// Why.
        cause: GivenUpCause,
    },
}

/// Why a model-based filter was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GivenUpCause {
    /// A number in it was not finite, or a variance not positive: it could not take a step.
    Failed,
    /// It was uncertain of its position or velocity beyond all use.
    Lost,
    /// It contradicted dead reckoning by more than both were uncertain of.
    Contradicted,
}

/// What the flight computer found in its black box when it started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RestartReport {
    /// Why it restarted.
    pub reason: RestartReason,
    /// Minor frame in which it did.
    pub frame: u32,
    /// Address of the instruction at fault, 0 where unknown.
    pub address: u32,
}

/// Why a flight computer restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RestartReason {
    /// The software panicked.
    Panic,
    /// The processor met an instruction or an address that it cannot serve.
    ProcessorFault,
    /// The stack ran into its guard.
    StackOverflow,
    /// The watchdog was not fed in time.
    Watchdog,
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
    /// The lowest altitude of the deploy box: falling on would leave it.
    BoxFloor,
}
