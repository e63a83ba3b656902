//! Frames by the wall clock: an absolute schedule, how well it was kept, and what the system grants to keep it better.

use std::time::{Duration, Instant};

use fsw_core::time::{FRAME, MissionTime};
use serde::{Deserialize, Serialize};

/// How well the schedule of a real-time flight was kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RealTime {
    /// Frames that left by the clock.
    pub frames: u32,
    /// Frames whose answer came after the next frame was due.
    pub misses: u32,
    /// How late frames left after they were due.
    pub wake_up_late_us: Lateness,
    /// What the operating system granted: one sentence, none when nothing was asked for.
    pub grant: Option<String>,
}

/// Lateness over the frames of a flight, µs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lateness {
    /// Median.
    pub p50: f64,
    /// 99 % are at most so late.
    pub p99: f64,
    /// Worst.
    pub max: f64,
}

impl Lateness {
    /// Of a list in any order.
    #[must_use]
    pub fn of(late: &[Duration]) -> Self {
        let mut us: Vec<f64> = late.iter().map(|d| d.as_secs_f64() * 1e6).collect();
        us.sort_unstable_by(f64::total_cmp);
        // The smallest value that at least this share of the frames does not exceed.
        let at = |share: f64| us.get(((us.len() as f64 * share).ceil() as usize).max(1) - 1).copied().unwrap_or(0.0);
        Self { p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

/// Wall-clock schedule of the frames: absolute, so that delays never add up.
#[derive(Debug, Default)]
pub struct FrameClock {
    first: Option<(Instant, MissionTime)>,
    late: Vec<Duration>,
    misses: u32,
}

impl FrameClock {
    /// Sleeps until the frame that ends at `time` is due; the first one is due at once. Returns when the next is due.
    pub fn wait_for(&mut self, time: MissionTime) -> Instant {
        let due = self.due(time, Instant::now());
        while let Some(left) = due.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
            std::thread::sleep(left);
        }
        self.left(due, Instant::now())
    }

    /// When a frame is due, if it is asked for `now`.
    fn due(&mut self, time: MissionTime, now: Instant) -> Instant {
        let (start, first) = *self.first.get_or_insert((now, time));
        start + Duration::from_micros(u64::from(time.since(first).unwrap_or(FRAME).0))
    }

    /// Notes that the frame due at `due` leaves `now`; returns when the next one is due.
    fn left(&mut self, due: Instant, now: Instant) -> Instant {
        self.late.push(now.saturating_duration_since(due));
        due + Duration::from_micros(u64::from(FRAME.0))
    }

    /// Notes when the answer of the frame was there.
    pub fn answered(&mut self, now: Instant, next_due: Instant) {
        if now >= next_due {
            self.misses += 1;
        }
    }

    /// How well the schedule was kept.
    #[must_use]
    pub fn report(&self) -> RealTime {
        RealTime {
            frames: u32::try_from(self.late.len()).unwrap_or(u32::MAX),
            misses: self.misses,
            wake_up_late_us: Lateness::of(&self.late),
            grant: None,
        }
    }
}

/// Asks for a first-in-first-out scheduling class and for locked memory; one sentence on what was granted.
#[must_use]
pub fn ask_for_real_time() -> String {
    let refused = |what: &str, reason: String| format!("{what} refused ({reason})");
    let scheduling = match fifo() {
        Ok(priority) => format!("SCHED_FIFO granted at priority {priority}"),
        Err(reason) => refused("SCHED_FIFO", reason),
    };
    let memory = match lock_memory() {
        Ok(()) => "memory locked".to_owned(),
        Err(reason) => refused("locked memory", reason),
    };
    format!("{scheduling}, {memory}")
}

/// Middle of the range of real-time priorities: above all ordinary work, below what the kernel itself needs.
#[cfg(target_os = "linux")]
const FIFO_PRIORITY_SHARE: u8 = 50;

#[cfg(target_os = "linux")]
fn fifo() -> Result<u8, String> {
    use thread_priority::{
        RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
        set_thread_priority_and_policy, thread_native_id,
    };
    let priority = ThreadPriorityValue::try_from(FIFO_PRIORITY_SHARE).map_err(|e| format!("{e:?}"))?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(priority), policy)
        .map(|()| FIFO_PRIORITY_SHARE)
        .map_err(|e| match e {
            thread_priority::Error::OS(code) => std::io::Error::from_raw_os_error(code).to_string(),
            other => other.to_string(),
        })
}

#[cfg(target_os = "linux")]
fn lock_memory() -> Result<(), String> {
    use nix::sys::mman::{MlockAllFlags, mlockall};
    mlockall(MlockAllFlags::MCL_CURRENT | MlockAllFlags::MCL_FUTURE).map_err(|e| e.desc().to_owned())
}

#[cfg(not(target_os = "linux"))]
fn fifo() -> Result<u8, String> {
    Err("this program asks for it on Linux only".into())
}

#[cfg(not(target_os = "linux"))]
fn lock_memory() -> Result<(), String> {
    Err("this program asks for it on Linux only".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_late_frame_delays_no_other() {
        let mut clock = FrameClock::default();
        let start = Instant::now();
        for (frame, late) in [(1, 0), (2, 15), (3, 0)] {
            let scheduled = start + 20 * MS * (frame - 1);
            let due = clock.due(MissionTime::of_frame(frame), if frame == 1 { start } else { scheduled + 7 * MS });
            assert_eq!(due, scheduled);
            assert_eq!(clock.left(due, due + late * MS), scheduled + 20 * MS);
        }
        let report = clock.report();
        assert_eq!((report.frames, report.wake_up_late_us.max, report.wake_up_late_us.p50), (3, 15_000.0, 0.0));
    }

    #[test]
    fn an_answer_after_the_next_frame_was_due_is_a_miss() {
        let mut clock = FrameClock::default();
        let due = Instant::now();
        clock.answered(due - MS, due);
        assert_eq!(clock.report().misses, 0);
        clock.answered(due + MS, due);
        assert_eq!(clock.report().misses, 1);
    }

    #[test]
    fn lateness_is_told_by_quantiles_that_occurred() {
        let late: Vec<Duration> = (1..=200u32).rev().map(|k| MS * k).collect();
        assert_eq!(Lateness::of(&late), Lateness { p50: 100_000.0, p99: 198_000.0, max: 200_000.0 });
        assert_eq!(Lateness::of(&[]), Lateness::default());
    }
}
