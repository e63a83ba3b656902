//! The line to the flight computer and what goes wrong on it: packets lost, corrupted, doubled, held back, and bytes that
//! are no packets. It never carries more than a serial line of the link's speed does in a minor frame.

use std::collections::VecDeque;

use fsw_core::link::framing::DELIMITER;

use crate::noise::Stream;
use crate::scenario::{Fault, FaultKind, FaultTarget};

/// Bytes that the line carries in a minor frame of 20 ms: 921,600 bits a second, ten bits a byte.
pub const BYTES_PER_FRAME: usize = 1_843;

/// See the [module](self).
#[derive(Clone, Debug)]
pub struct Uplink {
    faults: Vec<Fault>,
    noise: Stream,
    now_s: f64,
    /// Packets that wait, in order.
    held: VecDeque<Vec<u8>>,
    /// Bytes sent in this frame.
    sent: usize,
    /// Whether the last packet of the frame went out whole.
    whole: bool,
}

impl Uplink {
    /// A line with the faults of a scenario that strike it.
    #[must_use]
    pub fn new(faults: &[Fault], noise: Stream) -> Self {
        let faults = faults.iter().filter(|f| f.target == FaultTarget::Uplink).cloned().collect();
        Self { faults, noise, now_s: 0.0, held: VecDeque::new(), sent: 0, whole: true }
    }

    /// A minor frame that ends at this time begins to be sent.
    pub fn begin_frame(&mut self, now_s: f64, out: &mut Vec<u8>) {
        (self.now_s, self.sent, self.whole) = (now_s, 0, true);
        // A line that is held back brings no noise either, and no noise stands before what was held back.
        let is_held = self.acting(FaultKind::Hold).is_some() || !self.held.is_empty();
        if let (Some(garbage), false) = (self.acting(FaultKind::Garbage), is_held) {
            let bytes = (parameter(&garbage, "bytes") as usize).min(BYTES_PER_FRAME);
            let piece = (parameter(&garbage, "piece") as usize).max(1);
            let noise = &mut self.noise;
            let delimited = |k: usize| (k + 1).is_multiple_of(piece + 1) || k + 1 == bytes;
            let byte = |k| if delimited(k) { DELIMITER } else { 1 + (noise.uniform() * 255.0) as u8 };
            out.extend((0..bytes).map(byte));
            self.sent += bytes;
        }
    }

    /// Sends a packet of the frame through the faults.
    pub fn send(&mut self, packet: &[u8], out: &mut Vec<u8>) {
        let mut packet = packet.to_vec();
        self.whole = true;
        let acting = self.faults.iter().filter(|fault| fault.acts_at(self.now_s));
        for fault in acting {
            if fault.kind == FaultKind::Dropout {
                packet.clear();
            } else if fault.kind == FaultKind::BitFlips && self.noise.uniform() < parameter(fault, "per_packet") {
                flip_one_bit(&mut packet, &mut self.noise);
                self.whole = false;
            }
        }
        if packet.is_empty() {
            self.whole = false;
            return;
        }
        if self.acting(FaultKind::Hold).is_some() || !self.held.is_empty() {
            self.held.push_back(packet);
            return;
        }
        self.put(&packet, out);
        let copies = self.acting(FaultKind::Duplicate).map_or(0, |fault| parameter(&fault, "copies") as usize);
        for _ in 0..copies.min(BYTES_PER_FRAME.saturating_sub(self.sent) / packet.len()) {
            self.put(&packet, out);
        }
    }

    /// The frame has been sent, as far as the line had room for what was held back. Whether its last packet, which
    /// closes it, arrives whole.
    pub fn end_frame(&mut self, out: &mut Vec<u8>) -> bool {
        while self.acting(FaultKind::Hold).is_none()
            && let Some(packet) = self.held.pop_front_if(|packet| self.sent + packet.len() <= BYTES_PER_FRAME)
        {
            self.put(&packet, out);
        }
        self.whole && self.held.is_empty()
    }

    fn put(&mut self, packet: &[u8], out: &mut Vec<u8>) {
        out.extend_from_slice(packet);
        self.sent += packet.len();
    }

    fn acting(&self, kind: FaultKind) -> Option<Fault> {
        self.faults.iter().find(|fault| fault.kind == kind && fault.acts_at(self.now_s)).cloned()
    }
}

fn parameter(fault: &Fault, name: &str) -> f64 {
    fault.parameters.get(name).copied().unwrap_or(0.0)
}

/// Flips a random bit of a frame.
fn flip_one_bit(bytes: &mut [u8], noise: &mut Stream) {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // in [0, 8·len)
    let bit = (noise.uniform() * (8 * bytes.len()) as f64) as usize;
    if let Some(byte) = bytes.get_mut(bit / 8) {
        *byte ^= 1 << (bit % 8);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACKET: [u8; 4] = [3, 7, 7, 0];

    /// What the line carries in each of five frames of one packet, under a fault that acts in the second and third, and
    /// whether the frame's end arrives.
    fn carried(kind: FaultKind, parameters: &[(&str, f64)]) -> Vec<(Vec<u8>, bool)> {
        let parameters = parameters.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect();
        let fault = Fault { kind, target: FaultTarget::Uplink, start_s: 2.0, duration_s: 2.0, parameters };
        let mut line = Uplink::new(&[fault], Stream::new(1, 0, "test"));
        let frame = |second: i32| {
            let mut out = Vec::new();
            line.begin_frame(f64::from(second), &mut out);
            line.send(&PACKET, &mut out);
            let whole = line.end_frame(&mut out);
            (out, whole)
        };
        (1..=5).map(frame).collect()
    }

    fn good(times: usize) -> (Vec<u8>, bool) {
        (PACKET.repeat(times), true)
    }

    #[test]
    fn each_fault_of_the_line_does_what_it_says_for_its_time() {
        let nothing = (Vec::new(), false);
        assert_eq!(carried(FaultKind::Dropout, &[]), [good(1), nothing.clone(), nothing.clone(), good(1), good(1)]);
        assert_eq!(carried(FaultKind::Hold, &[]), [good(1), nothing.clone(), nothing, good(3), good(1)]);
        assert_eq!(carried(FaultKind::Duplicate, &[("copies", 2.0)]), [good(1), good(3), good(3), good(1), good(1)]);
    }

    #[test]
    fn garbage_has_the_length_and_the_pieces_asked_for() {
        let frames = carried(FaultKind::Garbage, &[("bytes", 10.0), ("piece", 3.0)]);
        let (garbage, packet) = frames[1].0.split_at(10);
        assert_eq!(packet, PACKET);
        let delimiters: Vec<_> = (0..10).filter(|k| garbage[*k] == 0).collect();
        assert_eq!(delimiters, [3, 7, 9]);
        assert_eq!(frames[3], good(1));
    }

    #[test]
    fn the_line_carries_no_more_than_it_can() {
        let copies = carried(FaultKind::Duplicate, &[("copies", 1e6)]);
        assert_eq!(copies[1].0.len(), BYTES_PER_FRAME - BYTES_PER_FRAME % PACKET.len());
        assert_eq!(carried(FaultKind::Garbage, &[("bytes", 1e6), ("piece", 1.0)])[1].0.len(), BYTES_PER_FRAME + 4);
    }

    #[test]
    fn a_line_that_is_held_back_brings_no_noise() {
        let fault = |kind, start_s, numbers: &[(&str, f64)]| Fault {
            kind,
            target: FaultTarget::Uplink,
            start_s,
            duration_s: 3.0,
            parameters: numbers.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        };
        let noise = fault(FaultKind::Garbage, 1.0, &[("bytes", 10.0), ("piece", 3.0)]);
        let mut line = Uplink::new(&[noise, fault(FaultKind::Hold, 2.0, &[])], Stream::new(1, 0, "test"));
        let lengths: Vec<_> = (1..=6_u8)
            .map(|second| {
                let mut out = Vec::new();
                line.begin_frame(f64::from(second), &mut out);
                line.send(&PACKET, &mut out);
                line.end_frame(&mut out);
                out.len()
            })
            .collect();
        assert_eq!(lengths, [10 + PACKET.len(), 0, 0, 0, 4 * PACKET.len(), PACKET.len()]);
    }

    #[test]
    fn what_was_held_back_comes_in_order_over_as_many_frames_as_the_line_needs() {
        let fault = Fault {
            kind: FaultKind::Hold,
            target: FaultTarget::Uplink,
            start_s: 0.0,
            duration_s: 10.0,
            parameters: std::collections::BTreeMap::new(),
        };
        let mut line = Uplink::new(&[fault], Stream::new(1, 0, "test"));
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for second in 0..20u8 {
            let begin = all.len();
            line.begin_frame(f64::from(second), &mut all);
            line.send(&[second; 1_000], &mut all);
            ends.push(line.end_frame(&mut all));
            assert!(all.len() - begin <= BYTES_PER_FRAME);
        }
        // Ten frames at a kilobyte a frame never catch up with a line of less than two.
        assert!(ends.iter().all(|end| !end));
        assert!(all.chunks(1_000).enumerate().all(|(k, piece)| piece.iter().all(|byte| usize::from(*byte) == k)));
    }
}
