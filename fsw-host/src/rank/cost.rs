//! What each filter costs on the reference computer: the record that `cargo xtask navigation` keeps.

use std::collections::BTreeMap;

use fsw_core::link::parameters::NavigationMode;
use serde::{Deserialize, Serialize};

/// The record, as of the sources that this program was built from.
const RECORD: &str = include_str!("../../../firmware/navigation-cost.toml");

/// Cost on the Cortex-M7, instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OnTarget {
    /// The dearest minor frame of all hard flights, guidance and link in it.
    pub worst_frame: u32,
    /// What it may cost in this mode.
    pub frame_budget: u32,
    /// Navigation over a second of whole flights, on average.
    pub navigation_per_second: u32,
}

#[derive(Deserialize)]
struct Record {
    short: BTreeMap<String, OnTarget>,
    long: BTreeMap<String, OnTarget>,
}

/// Of a filter; none for one that was not recorded.
pub fn on_target(mode: NavigationMode) -> Option<OnTarget> {
    let Record { short, long } = toml::from_str(RECORD).ok()?;
    let (short, long) = (short.get(mode.name())?, long.get(mode.name())?);
    Some(OnTarget { worst_frame: long.worst_frame.max(short.worst_frame), ..*long })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_filter_is_recorded_and_within_its_budget() {
        for mode in NavigationMode::ALL {
            let cost = on_target(*mode).unwrap_or_else(|| panic!("{}", mode.name()));
            assert!(cost.navigation_per_second > 0 && cost.worst_frame <= cost.frame_budget, "{}", mode.name());
        }
    }
}
