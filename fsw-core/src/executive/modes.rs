//! Modes and the one table of their transitions.
//!
//! ```text
//!            go            load ≥ threshold       speed ≤ alignment speed          fired
//! Standby ────────▶ Coast ─────────────────▶ RangeControl ───────────▶ HeadingAlignment ──────▶ Deployed
//!                                              │       ▲                  │         ▲               ▲
//!                              navigation lost │       │ regained    lost │         │ regained      │ fired, from
//!                                              ▼       │                  ▼         │               │ any of them
//!                                     DegradedRangeControl ───▶ DegradedHeadingAlignment ───────────┘
//! ```

use crate::link::packet::Mode;

/// What the transitions look at.
#[derive(Clone, Copy, Debug, Default)]
pub struct Facts {
    /// `Go` was accepted.
    pub go: bool,
    /// Sensed load, m/s².
    pub load_mps2: f64,
    /// Planet-relative speed, m/s.
    pub speed_mps: f64,
    /// The estimate may steer.
    pub navigation_usable: bool,
    /// The parachute was fired.
    pub fired: bool,
}

/// Thresholds of the transitions.
#[derive(Clone, Copy, Debug)]
pub struct Thresholds {
    /// Range control begins at this sensed load, m/s².
    pub range_control_load_mps2: f64,
    /// Heading alignment begins below this speed, m/s.
    pub alignment_speed_mps: f64,
}

/// Conditions that edges of the table carry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Condition {
    /// The ground said go.
    Go,
    /// The parachute was fired.
    Fired,
    /// The sensed load reached the threshold.
    Loaded,
    /// The speed fell below that of heading alignment.
    Slow,
    /// The estimate is not usable.
    NavigationLost,
    /// The estimate is usable again.
    NavigationRegained,
}

impl Condition {
    fn holds(self, facts: &Facts, thresholds: &Thresholds) -> bool {
        match self {
            Self::Go => facts.go,
            Self::Fired => facts.fired,
            Self::Loaded => facts.load_mps2 >= thresholds.range_control_load_mps2,
            Self::Slow => facts.speed_mps <= thresholds.alignment_speed_mps,
            Self::NavigationLost => !facts.navigation_usable,
            Self::NavigationRegained => facts.navigation_usable,
        }
    }
}

/// One edge: from, to, when.
#[derive(Clone, Copy, Debug)]
pub struct Transition {
    /// The mode it leaves.
    pub from: Mode,
    /// The mode it enters.
    pub to: Mode,
    /// When it is taken.
    pub when: Condition,
}

const fn edge(from: Mode, when: Condition, to: Mode) -> Transition {
    Transition { from, to, when }
}

/// Number of edges.
pub const TRANSITION_COUNT: usize = 13;

/// All edges, most urgent first; the first one that leaves the present mode and holds is taken, one per frame.
pub const TRANSITIONS: [Transition; TRANSITION_COUNT] = [
    edge(Mode::Coast, Condition::Fired, Mode::Deployed),
    edge(Mode::RangeControl, Condition::Fired, Mode::Deployed),
    edge(Mode::HeadingAlignment, Condition::Fired, Mode::Deployed),
    edge(Mode::DegradedRangeControl, Condition::Fired, Mode::Deployed),
    edge(Mode::DegradedHeadingAlignment, Condition::Fired, Mode::Deployed),
    edge(Mode::Standby, Condition::Go, Mode::Coast),
    edge(Mode::Coast, Condition::Loaded, Mode::RangeControl),
    edge(Mode::RangeControl, Condition::NavigationLost, Mode::DegradedRangeControl),
    edge(Mode::HeadingAlignment, Condition::NavigationLost, Mode::DegradedHeadingAlignment),
    edge(Mode::DegradedRangeControl, Condition::NavigationRegained, Mode::RangeControl),
    edge(Mode::DegradedHeadingAlignment, Condition::NavigationRegained, Mode::HeadingAlignment),
    edge(Mode::RangeControl, Condition::Slow, Mode::HeadingAlignment),
    edge(Mode::DegradedRangeControl, Condition::Slow, Mode::DegradedHeadingAlignment),
];

/// The mode after this frame: the only place where the mode changes.
#[must_use]
pub fn next(mode: Mode, facts: &Facts, thresholds: &Thresholds) -> Mode {
    TRANSITIONS.iter().find(|t| t.from == mode && t.when.holds(facts, thresholds)).map_or(mode, |t| t.to)
}

#[cfg(test)]
mod tests {
    use super::*;

    const THRESHOLDS: Thresholds = Thresholds { range_control_load_mps2: 2.0, alignment_speed_mps: 600.0 };
    const CALM: Facts = Facts { go: true, load_mps2: 0.0, speed_mps: 5000.0, navigation_usable: true, fired: false };

    fn walk(facts: &[Facts]) -> Mode {
        facts.iter().fold(Mode::Standby, |mode, f| next(mode, f, &THRESHOLDS))
    }

    #[test]
    fn an_entry_walks_from_standby_to_deployed() {
        let loaded = Facts { load_mps2: 3.0, ..CALM };
        let slow = Facts { speed_mps: 590.0, ..loaded };
        assert_eq!(walk(&[Facts { go: false, ..CALM }]), Mode::Standby);
        assert_eq!(walk(&[CALM]), Mode::Coast);
        assert_eq!(walk(&[CALM, CALM, loaded]), Mode::RangeControl);
        assert_eq!(walk(&[CALM, loaded, slow]), Mode::HeadingAlignment);
        assert_eq!(walk(&[CALM, loaded, slow, Facts { fired: true, ..slow }]), Mode::Deployed);
    }

    #[test]
    fn losing_the_estimate_degrades_and_regaining_it_restores() {
        let lost = Facts { navigation_usable: false, load_mps2: 3.0, ..CALM };
        let loaded = Facts { load_mps2: 3.0, ..CALM };
        assert_eq!(walk(&[CALM, loaded, lost]), Mode::DegradedRangeControl);
        assert_eq!(walk(&[CALM, loaded, lost, loaded]), Mode::RangeControl);
    }

    #[test]
    fn nothing_leaves_deployed() {
        assert!(TRANSITIONS.iter().all(|t| t.from != Mode::Deployed));
    }

    #[test]
    fn a_load_that_is_not_a_number_starts_nothing() {
        assert_eq!(next(Mode::Coast, &Facts { load_mps2: f64::NAN, ..CALM }, &THRESHOLDS), Mode::Coast);
    }
}
