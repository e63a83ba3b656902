//! Order of packets: what is lost, doubled or out of order, from the sender's sequence numbers.

use super::packet::RejectCounters;

/// Numbers ahead of the newest by less than this count as newer, the rest as older (half of the 16-bit circle).
const HALF_CIRCLE: u16 = 0x8000;
/// After this many consecutive numbers in a row that look old, the sender has restarted: its numbering is adopted.
pub const RESTART_AFTER: u8 = 8;

/// How a packet stands to those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Arrival {
    /// The first packet, or the next in order.
    InOrder,
    /// In order after a gap of this many packets.
    AfterLoss(u16),
    /// The newest packet again: not to be used.
    Duplicate,
    /// Older than the newest: not to be used.
    Reordered,
}

impl Arrival {
    /// Whether the packet is to be used.
    #[must_use]
    pub const fn is_new(self) -> bool {
        matches!(self, Self::InOrder | Self::AfterLoss(_))
    }
}

/// Follows the sequence numbers of one sender.
///
/// A packet that comes after a newer one stays counted as lost as well as reordered: it is not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SequenceMonitor {
    newest: Option<u16>,
    /// The last number that looked old, and how many consecutive ones there were.
    old_run: Option<(u16, u8)>,
}

impl SequenceMonitor {
    /// A monitor that takes any first number.
    #[must_use]
    pub const fn new() -> Self {
        Self { newest: None, old_run: None }
    }

    /// Starts a new numbering at the next packet, as after a handshake.
    pub fn restart(&mut self) {
        *self = Self::new();
    }

    /// Judges the next packet and counts what is wrong with it.
    pub fn observe(&mut self, sequence: u16, counters: &mut RejectCounters) -> Arrival {
        let arrival = self.judge(sequence);
        match arrival {
            Arrival::InOrder => {}
            Arrival::AfterLoss(n) => counters.lost = counters.lost.saturating_add(u32::from(n)),
            Arrival::Duplicate => counters.duplicate = counters.duplicate.saturating_add(1),
            Arrival::Reordered => counters.reordered = counters.reordered.saturating_add(1),
        }
        if arrival.is_new() {
            self.newest = Some(sequence);
            self.old_run = None;
        }
        arrival
    }

    fn judge(&mut self, sequence: u16) -> Arrival {
        let Some(newest) = self.newest else { return Arrival::InOrder };
        match sequence.wrapping_sub(newest) {
            0 => Arrival::Duplicate,
            1 => Arrival::InOrder,
            ahead if ahead < HALF_CIRCLE => Arrival::AfterLoss(ahead - 1),
            _ if self.restarted(sequence) => Arrival::InOrder,
            _ => Arrival::Reordered,
        }
    }

    /// Counts consecutive old numbers; true when there are enough to believe in a restart.
    fn restarted(&mut self, sequence: u16) -> bool {
        let run = match self.old_run {
            Some((last, run)) if last.wrapping_add(1) == sequence => run.saturating_add(1),
            _ => 1,
        };
        self.old_run = Some((sequence, run));
        run >= RESTART_AFTER
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn arrivals(sequences: &[u16]) -> (Vec<Arrival>, RejectCounters) {
        let mut monitor = SequenceMonitor::new();
        let mut counters = RejectCounters::default();
        (sequences.iter().map(|s| monitor.observe(*s, &mut counters)).collect(), counters)
    }

    #[test]
    fn every_cause_is_told_apart_and_counted() {
        use Arrival::{AfterLoss, Duplicate, InOrder, Reordered};
        let (got, counters) = arrivals(&[10, 11, 11, 14, 12, 15]);
        assert_eq!(got, [InOrder, InOrder, Duplicate, AfterLoss(2), Reordered, InOrder]);
        assert_eq!((counters.lost, counters.duplicate, counters.reordered), (2, 1, 1));
    }

    #[test]
    fn numbers_wrap_without_a_loss() {
        let (got, counters) = arrivals(&[65_534, 65_535, 0, 1]);
        assert!(got.iter().all(|a| *a == Arrival::InOrder));
        assert_eq!(counters, RejectCounters::default());
    }

    #[test]
    fn a_sender_that_restarts_unannounced_is_followed_after_a_few_packets() {
        let mut numbers: Vec<u16> = std::vec![40_000];
        numbers.extend(30_000..30_000 + u16::from(RESTART_AFTER) + 1);
        let (got, counters) = arrivals(&numbers);
        assert_eq!(got[got.len() - 2..], [Arrival::InOrder, Arrival::InOrder]);
        assert_eq!(counters.reordered, u32::from(RESTART_AFTER) - 1);
    }

    #[test]
    fn scattered_old_packets_are_no_restart() {
        let numbers: Vec<u16> = std::iter::once(1000).chain((0..50).map(|k| 500 + 2 * k)).collect();
        let (got, _) = arrivals(&numbers);
        assert!(got[1..].iter().all(|a| *a == Arrival::Reordered));
    }
}
