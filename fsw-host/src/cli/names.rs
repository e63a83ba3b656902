//! Algorithms by the names of the command line.

use clap::ValueEnum;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use fsw_core::link::parameters::NavigationMode;

/// Names of the navigation algorithms as the command line takes them.
pub(crate) fn navigation_name() -> impl TypedValueParser<Value = NavigationMode> {
    let names = NavigationMode::ALL.iter().map(|mode| PossibleValue::new(mode.name()).help(mode.title()));
    PossibleValuesParser::new(names).map(|name| {
        let found = NavigationMode::ALL.iter().find(|mode| mode.name() == name);
        found.copied().unwrap_or_default()
    })
}

/// Guidance algorithms.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum GuidanceName {
    /// The predictor-corrector of the paper.
    Paper,
    /// The predictor rehearses the flight, in the air that it has learned.
    Aeroshell,
    /// The paper's predictor-corrector from waypoint to waypoint.
    Segmented,
    /// Predictions cut short at the waypoints' speeds, the rest of the range by table.
    SegmentedTable,
    /// Terminal-point guidance derived from that of Apollo.
    Apollo,
}

impl GuidanceName {
    /// The name in a scenario file.
    #[must_use]
    pub fn field_value(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Aeroshell => "aeroshell",
            Self::Segmented => "segmented",
            Self::SegmentedTable => "segmented-table",
            Self::Apollo => "apollo",
        }
    }
}

/// Parachute triggers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TriggerName {
    /// Planet-relative speed.
    Speed,
    /// Target abeam, within the speed window.
    Range,
}

impl TriggerName {
    /// The name in a scenario file.
    #[must_use]
    pub fn field_value(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Range => "range",
        }
    }
}
