//! What guidance is told: which algorithm and trigger, its settings, the limits along the path.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Guidance algorithms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum GuidanceMode {
    /// The predictor-corrector of P4.
    #[default]
    Paper,
    /// The predictor rehearses the flight, in the air that it has learned.
    Aeroshell,
    /// P4's predictor-corrector from waypoint to waypoint.
    Segmented,
    /// Predictions cut short at the waypoints' speeds; the rest of the range by table.
    SegmentedTable,
    /// Terminal-point guidance derived from that of Apollo.
    Apollo,
}

/// What fires the parachute.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum TriggerKind {
    /// Planet-relative speed.
    #[default]
    Speed,
    /// Range: the target lies abeam.
    Range,
}

/// Settings of the guidance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct GuidanceParameters {
    /// Step of the predictor, s.
    pub predictor_step_s: f64,
    /// Longest predicted flight, s.
    pub prediction_horizon_s: f64,
    /// Predicted miss at which the corrector stops, m.
    pub tolerance_m: f64,
    /// Second point of the secant, added to the first bank, rad (P4: 30–50°).
    pub bank_increment_rad: f64,
    /// Corrector iterations of a cycle, at most; predictor calls are bounded by `MAX_PREDICTIONS` besides.
    pub max_iterations: u8,
    /// Smallest commanded bank magnitude in range control, rad.
    pub min_bank_rad: f64,
    /// Largest commanded bank magnitude in range control, rad.
    pub max_bank_rad: f64,
    /// Heading-offset threshold, constant part, m.
    pub threshold_constant_m: f64,
    /// Heading-offset threshold, part linear in speed, m per m/s.
    pub threshold_linear_s: f64,
    /// Heading-offset threshold, part quadratic in speed, m per (m/s)².
    pub threshold_quadratic_s2pm: f64,
    /// Sensed load at which range control begins, m/s².
    pub range_control_load_mps2: f64,
    /// Heading alignment begins below this planet-relative speed, m/s.
    pub alignment_speed_mps: f64,
    /// Gain of the heading alignment, 1/s.
    pub alignment_gain_ps: f64,
    /// Largest bank in heading alignment, rad.
    pub alignment_max_bank_rad: f64,
    /// The desired heading is frozen inside this range to the target, m.
    pub alignment_freeze_range_m: f64,
    /// Mode `aeroshell`, speed trigger: heading alignment begins below this planet-relative speed, m/s.
    pub late_alignment_speed_mps: f64,
    /// Mode `aeroshell`, range trigger: the same, m/s.
    pub range_alignment_speed_mps: f64,
    /// Mode `aeroshell`: a bank reversal when the heading offset exceeds this share of the crossrange that can be recovered.
    pub reversal_share: f64,
}

/// Limits along the path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, Schema, MaxSize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ConstraintParameters {
    /// Sensed load, m/s².
    pub load_mps2: f64,
    /// Convective heat flux at the stagnation point, W/m².
    pub heat_flux_wpm2: f64,
    /// Dynamic pressure, Pa.
    pub dynamic_pressure_pa: f64,
}
