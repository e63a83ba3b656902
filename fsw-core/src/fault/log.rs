//! Event log of fixed size: the first events ever and the last events so far are both kept, because the first fault
//! explains and the last one tells the state.

use heapless::{Deque, Vec};

use crate::link::packet::{Event, EventKind, Severity};
use crate::time::MissionTime;

/// Warnings and faults kept from the start; never overwritten.
pub const FIRST_EVENTS: usize = 16;
/// Most recent events kept, of any severity.
pub const LAST_EVENTS: usize = 32;
/// Events that wait for downlink, at most.
pub const PENDING_EVENTS: usize = 16;

/// First-N and last-N log, and the queue of events still to be sent.
#[derive(Clone, Debug, Default)]
pub struct EventLog {
    first: Vec<Event, FIRST_EVENTS>,
    last: Deque<Event, LAST_EVENTS>,
    pending: Deque<Event, PENDING_EVENTS>,
    lost: u16,
}

impl EventLog {
    /// An empty log.
    #[must_use]
    pub const fn new() -> Self {
        Self { first: Vec::new(), last: Deque::new(), pending: Deque::new(), lost: 0 }
    }

    /// Records an event. When the downlink queue is full the event is still logged, and counted as lost to the ground.
    pub fn record(&mut self, time: MissionTime, severity: Severity, kind: EventKind) {
        let event = Event { time, severity, kind };
        if severity > Severity::Activity {
            // Full: the first faults stay, by design.
            let _ = self.first.push(event);
        }
        if self.last.is_full() {
            self.last.pop_front();
        }
        let _ = self.last.push_back(event);
        if self.pending.push_back(event).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }

    /// The next event to send, oldest first.
    pub fn next_pending(&mut self) -> Option<Event> {
        self.pending.pop_front()
    }

    /// The first warnings and faults since start.
    pub fn first(&self) -> impl Iterator<Item = &Event> {
        self.first.iter()
    }

    /// The most recent events, oldest first.
    pub fn last(&self) -> impl Iterator<Item = &Event> {
        self.last.iter()
    }

    /// Events that were logged but could not be queued for downlink.
    #[must_use]
    pub const fn lost(&self) -> u16 {
        self.lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec as StdVec;

    fn overrun(cost: u32) -> EventKind {
        EventKind::FrameOverrun { slot: 0, cost, budget: 1 }
    }

    #[test]
    fn a_flood_keeps_the_first_faults_and_the_last_events() {
        let mut log = EventLog::new();
        for i in 0..1000 {
            log.record(MissionTime(i), Severity::Warning, overrun(i));
        }
        let times = |events: &mut dyn Iterator<Item = &Event>| events.map(|e| e.time.0).collect::<StdVec<_>>();
        assert_eq!(times(&mut log.first()), (0..16).collect::<StdVec<_>>());
        assert_eq!(times(&mut log.last()), (968..1000).collect::<StdVec<_>>());
        assert_eq!(log.lost(), 1000 - 16);
    }

    #[test]
    fn activities_do_not_fill_the_record_of_first_faults() {
        let mut log = EventLog::new();
        for i in 0..100 {
            log.record(MissionTime(i), Severity::Activity, EventKind::Armed { digest: i });
        }
        assert_eq!(log.first().count(), 0);
    }

    #[test]
    fn events_leave_in_the_order_they_came() {
        let mut log = EventLog::new();
        log.record(MissionTime(1), Severity::Fault, EventKind::NavigationInvalid);
        log.record(MissionTime(2), Severity::Activity, EventKind::Armed { digest: 7 });
        assert_eq!(log.next_pending().map(|e| e.time), Some(MissionTime(1)));
        assert_eq!(log.next_pending().map(|e| e.time), Some(MissionTime(2)));
        assert_eq!(log.next_pending(), None);
    }
}
