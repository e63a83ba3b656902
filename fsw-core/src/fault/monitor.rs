//! Health monitors: each watches one quantity, raises an event on the edge, and is throttled.

use super::EventLog;
use crate::link::packet::{
    EventKind, GivenUpCause, Innovation, MAX_INNOVATIONS, RejectCounters, Severity, Verdict as Fate,
};
use crate::time::{FRAMES_PER_SECOND, MissionTime};

/// Throttled warnings are repeated no sooner than this many frames later.
const THROTTLE_FRAMES: u32 = FRAMES_PER_SECOND;

/// What the monitors look at in one frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameReport<'a> {
    /// Now.
    pub time: MissionTime,
    /// Minor frame.
    pub frame: u32,
    /// An inertial measurement was accepted in this frame.
    pub imu_present: bool,
    /// The navigation estimate may be used.
    pub navigation_valid: bool,
    /// Link and validation counters so far.
    pub rejects: &'a RejectCounters,
    /// Innovations since the navigation telemetry before; none in the frames between.
    pub innovations: Option<&'a [Option<Innovation>; MAX_INNOVATIONS]>,
    /// Covariance restorations so far.
    pub covariance_restored: u16,
    /// Why a model-based filter was given up, if it was.
    pub filter_given_up: Option<GivenUpCause>,
}

/// What the frame is fit for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// The estimate may steer; false sends the mode to its degraded twin.
    pub navigation_usable: bool,
}

/// State of all monitors.
#[derive(Clone, Debug, Default)]
pub struct Monitor {
    imu_gap_frames: u16,
    navigation_was_invalid: bool,
    rejected_reported: u32,
    reject_event_frame: Option<u32>,
    gate_event_frame: Option<u32>,
    restored_reported: u16,
    given_up_reported: bool,
}

impl Monitor {
    /// Monitors that have seen nothing.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            imu_gap_frames: 0,
            navigation_was_invalid: false,
            rejected_reported: 0,
            reject_event_frame: None,
            gate_event_frame: None,
            restored_reported: 0,
            given_up_reported: false,
        }
    }

    /// A flight begins: what the link lost before it is counted, but no event of the flight. A computer that was
    /// switched on while its peer was talking misses the beginning.
    pub fn begin(&mut self, rejects: &RejectCounters) {
        self.rejected_reported = total_rejected(rejects);
    }

    /// Judges one frame and logs what it finds.
    pub fn step(&mut self, report: &FrameReport<'_>, log: &mut EventLog) -> Verdict {
        self.watch_imu(report, log);
        self.watch_rejects(report, log);
        self.watch_gates(report, log);
        if report.covariance_restored != self.restored_reported {
            self.restored_reported = report.covariance_restored;
            let kind = EventKind::CovarianceRestored { times: report.covariance_restored };
            log.record(report.time, Severity::Warning, kind);
        }
        if let Some(cause) = report.filter_given_up
            && !self.given_up_reported
        {
            self.given_up_reported = true;
            log.record(report.time, Severity::Fault, EventKind::FilterGivenUp { cause });
        }
        if !report.navigation_valid && !self.navigation_was_invalid {
            log.record(report.time, Severity::Fault, EventKind::NavigationInvalid);
        }
        self.navigation_was_invalid = !report.navigation_valid;
        Verdict { navigation_usable: report.navigation_valid }
    }

    fn watch_imu(&mut self, report: &FrameReport<'_>, log: &mut EventLog) {
        if report.imu_present {
            if self.imu_gap_frames > 0 {
                let kind = EventKind::ImuRecovered { frames: self.imu_gap_frames };
                log.record(report.time, Severity::Activity, kind);
            }
            self.imu_gap_frames = 0;
        } else {
            if self.imu_gap_frames == 0 {
                log.record(report.time, Severity::Warning, EventKind::ImuLost { frames: 1 });
            }
            self.imu_gap_frames = self.imu_gap_frames.saturating_add(1);
        }
    }

    fn watch_rejects(&mut self, report: &FrameReport<'_>, log: &mut EventLog) {
        let total = total_rejected(report.rejects);
        let fresh = total.wrapping_sub(self.rejected_reported);
        if fresh > 0 && throttle_over(self.reject_event_frame, report.frame) {
            let count = u16::try_from(fresh).unwrap_or(u16::MAX);
            log.record(report.time, Severity::Warning, EventKind::PacketsRejected { count });
            self.reject_event_frame = Some(report.frame);
            self.rejected_reported = total;
        }
    }

    fn watch_gates(&mut self, report: &FrameReport<'_>, log: &mut EventLog) {
        let gated = report.innovations.into_iter().flatten().flatten().find(|i| i.verdict == Fate::Gated);
        if let Some(innovation) = gated
            && throttle_over(self.gate_event_frame, report.frame)
        {
            let kind = EventKind::MeasurementGated {
                kind: innovation.kind,
                source: innovation.source,
                ratio: if innovation.sigma > 0.0 { innovation.value / innovation.sigma } else { 0.0 },
            };
            log.record(report.time, Severity::Warning, kind);
            self.gate_event_frame = Some(report.frame);
        }
    }
}

/// All rejected packets, whatever the cause; lost ones were never seen and are not counted here.
fn total_rejected(c: &RejectCounters) -> u32 {
    [c.overflow, c.cobs, c.crc, c.decode, c.duplicate, c.reordered, c.late, c.early, c.range, c.not_finite, c.status]
        .iter()
        .fold(0, |sum: u32, n| sum.wrapping_add(*n))
}

fn throttle_over(last: Option<u32>, frame: u32) -> bool {
    last.is_none_or(|last| frame.wrapping_sub(last) >= THROTTLE_FRAMES)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::packet::Event;
    use std::vec::Vec;

    struct Bench {
        monitor: Monitor,
        log: EventLog,
        frame: u32,
        rejects: RejectCounters,
    }

    impl Bench {
        fn new() -> Self {
            Self { monitor: Monitor::new(), log: EventLog::new(), frame: 0, rejects: RejectCounters::default() }
        }

        fn frame(&mut self, imu_present: bool, navigation_valid: bool) -> Verdict {
            self.frame += 1;
            let report = FrameReport {
                time: MissionTime::of_frame(self.frame),
                frame: self.frame,
                imu_present,
                navigation_valid,
                rejects: &self.rejects,
                innovations: None,
                covariance_restored: 0,
                filter_given_up: None,
            };
            self.monitor.step(&report, &mut self.log)
        }

        fn events(&self) -> Vec<Event> {
            self.log.last().copied().collect()
        }
    }

    #[test]
    fn an_imu_gap_gives_one_event_at_its_start_and_one_at_its_end() {
        let mut bench = Bench::new();
        bench.frame(true, true);
        for _ in 0..7 {
            bench.frame(false, true);
        }
        bench.frame(true, true);
        let kinds: Vec<_> = bench.events().iter().map(|e| e.kind).collect();
        assert_eq!(kinds, [EventKind::ImuLost { frames: 1 }, EventKind::ImuRecovered { frames: 7 }]);
    }

    #[test]
    fn a_flood_of_rejects_is_reported_once_a_second_with_its_count() {
        let mut bench = Bench::new();
        for _ in 0..200 {
            bench.rejects.crc += 3;
            bench.frame(true, true);
        }
        let counts: Vec<_> = bench
            .events()
            .iter()
            .filter_map(|e| if let EventKind::PacketsRejected { count } = e.kind { Some(count) } else { None })
            .collect();
        assert_eq!(counts, [3, 150, 150, 150]);
    }

    #[test]
    fn what_was_rejected_before_the_flight_is_no_event_of_it() {
        let mut bench = Bench::new();
        bench.rejects.crc = 2;
        bench.monitor.begin(&bench.rejects);
        bench.frame(true, true);
        assert!(bench.events().is_empty());
        bench.rejects.crc += 1;
        bench.frame(true, true);
        assert!(matches!(bench.events()[..], [e] if e.kind == EventKind::PacketsRejected { count: 1 }));
    }

    #[test]
    fn an_invalid_estimate_is_a_fault_on_its_edge_and_forbids_steering() {
        let mut bench = Bench::new();
        assert!(bench.frame(true, true).navigation_usable);
        assert!(!bench.frame(true, false).navigation_usable);
        assert!(!bench.frame(true, false).navigation_usable);
        assert_eq!(bench.events().len(), 1);
    }
}
