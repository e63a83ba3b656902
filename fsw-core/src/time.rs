//! Mission time: integer microseconds since the entry epoch, always an argument, never read from a clock.

use postcard::experimental::max_size::MaxSize;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Length of a minor frame, 20 ms (50 Hz).
pub const FRAME: Micros = Micros(20_000);
/// Minor frames per second.
pub const FRAMES_PER_SECOND: u32 = 50;

/// An instant: microseconds after the entry epoch; 32 bits hold 71 minutes, twelve times an entry.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Schema, MaxSize,
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionTime(pub u32);

/// A duration in microseconds.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Schema, MaxSize,
)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Micros(pub u32);

impl Micros {
    /// The duration in seconds.
    #[must_use]
    pub fn as_s(self) -> f64 {
        f64::from(self.0) * 1e-6
    }
}

impl MissionTime {
    /// The entry epoch.
    pub const ZERO: Self = Self(0);

    /// Seconds since the entry epoch.
    #[must_use]
    pub fn as_s(self) -> f64 {
        f64::from(self.0) * 1e-6
    }

    /// Time elapsed since `earlier`, or `None` if `earlier` lies in the future.
    #[must_use]
    pub fn since(self, earlier: Self) -> Option<Micros> {
        self.0.checked_sub(earlier.0).map(Micros)
    }

    /// This instant plus a duration, saturating at the end of the range.
    #[must_use]
    pub fn plus(self, duration: Micros) -> Self {
        Self(self.0.saturating_add(duration.0))
    }

    /// The start of minor frame `index`, saturating at the end of the range.
    #[must_use]
    pub fn of_frame(index: u32) -> Self {
        Self(index.saturating_mul(FRAME.0))
    }

    /// Index of the minor frame that contains this instant.
    #[must_use]
    pub fn frame_index(self) -> u32 {
        self.0 / FRAME.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_starts_where_its_index_says() {
        assert_eq!(MissionTime::of_frame(50), MissionTime(1_000_000));
        assert_eq!(MissionTime::of_frame(50).frame_index(), 50);
        assert_eq!(MissionTime(1_019_999).frame_index(), 50);
    }

    #[test]
    fn elapsed_time_never_runs_backwards() {
        assert_eq!(MissionTime(30).since(MissionTime(10)), Some(Micros(20)));
        assert_eq!(MissionTime(10).since(MissionTime(30)), None);
    }

    #[test]
    fn sums_saturate_at_the_end_of_the_range() {
        assert_eq!(MissionTime(u32::MAX).plus(FRAME), MissionTime(u32::MAX));
    }
}
