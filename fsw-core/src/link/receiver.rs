//! Both ends of a link above framing: number and encode what goes out, decode, order and count what comes in.

use core::marker::PhantomData;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::framing::{
    Body, DELIMITER, EncodeError, FrameBytes, LONGEST_STRETCH, MAX_FRAME, Reject, Stretches, are_same, common_prefix,
    copy, decode, encode_frame, glance, skip_short_noise, split_at_delimiter,
};
use super::packet::{Downlink, Frame, RejectCounters, Uplink};
use super::sequence::{Arrival, SequenceMonitor};
use crate::time::MissionTime;

/// What the link needs to know of its packets.
pub trait Packet: Serialize + DeserializeOwned {
    /// Whether the packet opens a session, after which the sender's numbering may start anew.
    fn opens_session(&self) -> bool;
}

impl Packet for Uplink {
    fn opens_session(&self) -> bool {
        matches!(self, Self::Hello(_))
    }
}

impl Packet for Downlink {
    fn opens_session(&self) -> bool {
        matches!(self, Self::Hello(_))
    }
}

/// Numbers and encodes outgoing packets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sender {
    next_sequence: u16,
}

impl Sender {
    /// A sender whose first packet has number 0.
    #[must_use]
    pub const fn new() -> Self {
        Self { next_sequence: 0 }
    }

    /// Number of the packet to be sent next.
    #[must_use]
    pub const fn next_sequence(&self) -> u16 {
        self.next_sequence
    }

    /// Encodes a packet under the next number.
    ///
    /// # Errors
    /// As [`encode_frame`]; the number is not used up then.
    pub fn encode<'o, P: Packet>(
        &mut self,
        time: MissionTime,
        packet: &P,
        out: &'o mut FrameBytes,
    ) -> Result<&'o [u8], EncodeError> {
        let bytes = encode_frame(&Frame { sequence: self.next_sequence, time, packet }, out)?;
        self.next_sequence = self.next_sequence.wrapping_add(1);
        Ok(bytes)
    }
}

/// Finds the packets of one sender in its byte stream, drops doubles and stragglers, counts by cause.
///
/// Every frame is counted exactly once: `accepted`, `overflow`, `cobs`, `crc`, `decode`, `duplicate` or `reordered`.
/// `lost` counts frames that never came.
#[derive(Clone, Debug)]
pub struct Receiver<P> {
    stretches: Stretches,
    body: Body,
    /// The last frame judged, as it came, with its delimiter; none, of length zero, after one that may be repeated.
    last: [u8; MAX_FRAME],
    last_length: usize,
    /// Why it was no packet.
    verdict: Option<Reject>,
    sequence: SequenceMonitor,
    packet: PhantomData<P>,
}

impl<P: Packet> Default for Receiver<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P: Packet> Receiver<P> {
    /// A receiver that takes any first sequence number.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stretches: Stretches::new(),
            body: Body::new(),
            last: [0; MAX_FRAME],
            last_length: 0,
            verdict: None,
            sequence: SequenceMonitor::new(),
            packet: PhantomData,
        }
    }

    /// Takes one byte; `Some` when it completes a packet that is to be used.
    pub fn push(&mut self, byte: u8, counters: &mut RejectCounters) -> Option<Frame<P>> {
        self.take(&mut [byte].as_slice(), counters)
    }

    /// Takes bytes off the front of `bytes` up to the end of a frame; `Some` when that is a packet that is to be used.
    pub fn take(&mut self, bytes: &mut &[u8], counters: &mut RejectCounters) -> Option<Frame<P>> {
        if self.stretches.is_between() && self.skip_repeated(bytes, counters) {
            return None;
        }
        let stretch = match self.stretches.take(bytes)? {
            Ok(stretch) => stretch,
            Err(reject) => {
                counters.count(reject);
                return None;
            }
        };
        // A flood of noise is to cost little.
        if let Some(reject) = glance(stretch) {
            counters.count(reject);
            if !bytes.is_empty() {
                skip_noise(bytes, counters);
            }
            return None;
        }
        self.last_length = stretch.len() + 1;
        copy(&mut self.last, stretch);
        if let Some(end) = self.last.get_mut(stretch.len()) {
            *end = DELIMITER;
        }
        self.verdict = None;
        let frame = match self.body.unstuffed(stretch).and_then(decode::<Frame<P>>) {
            Ok(frame) => frame,
            Err(reject) => {
                self.verdict = Some(reject);
                counters.count(reject);
                return None;
            }
        };
        if frame.packet.opens_session() {
            // A greeting that comes again is answered again.
            self.last_length = 0;
            self.sequence.restart();
        }
        let arrival = self.sequence.observe(frame.sequence, counters);
        if arrival == Arrival::Reordered {
            // Told from a restart of the sender by those that follow.
            self.last_length = 0;
        }
        if !arrival.is_new() {
            return None;
        }
        counters.accepted = counters.accepted.saturating_add(1);
        Some(frame)
    }

    /// Takes repetitions of the last frame judged off the front of `bytes`, and counts them; whether there are any. A flood
    /// of repetitions is to cost little: what has been judged need not be judged again.
    #[inline]
    fn skip_repeated(&self, bytes: &mut &[u8], counters: &mut RejectCounters) -> bool {
        let length = self.last_length;
        let (Some((first, behind)), Some(last)) = (bytes.split_at_checked(length), self.last.get(..length)) else {
            return false;
        };
        if length == 0 || !are_same(first, last) {
            return false;
        }
        // Bytes that equal those one frame before them repeat it further.
        let repeated = if behind.is_empty() { 1 } else { 1 + common_prefix(bytes, behind) / length };
        *bytes = bytes.get(repeated * length..).unwrap_or_default();
        let counter = match self.verdict {
            Some(reject) => counters.of(reject),
            None => &mut counters.duplicate,
        };
        *counter = counter.saturating_add(u32::try_from(repeated).unwrap_or(u32::MAX));
        true
    }
}

/// Takes stretches that are no frames at a glance off the front of `bytes`, where one begins, and counts them.
#[inline(never)]
fn skip_noise(bytes: &mut &[u8], counters: &mut RejectCounters) {
    skip_short_noise(bytes, counters);
    // Each turn takes a byte or more.
    while let Some((stretch, rest)) = split_at_delimiter(bytes) {
        let Some(reject) = glance(stretch) else { return };
        if stretch.is_empty() || stretch.len() > LONGEST_STRETCH {
            return;
        }
        counters.count(reject);
        *bytes = rest;
        skip_short_noise(bytes, counters);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::framing::MAX_FRAME;
    use crate::link::packet::{Hello, Imu};
    use proptest::prelude::*;
    use std::vec;
    use std::vec::Vec;

    fn wire(sender: &mut Sender, packet: Uplink) -> Vec<u8> {
        let mut out = [0; MAX_FRAME];
        sender.encode(MissionTime(0), &packet, &mut out).unwrap().to_vec()
    }

    fn receive(receiver: &mut Receiver<Uplink>, bytes: &[u8], counters: &mut RejectCounters) -> Vec<u16> {
        bytes.iter().filter_map(|b| receiver.push(*b, counters)).map(|f| f.sequence).collect()
    }

    #[test]
    fn every_frame_is_counted_once_under_its_cause() {
        let mut sender = Sender::new();
        let frames: Vec<_> = (0..4).map(|_| wire(&mut sender, Uplink::Imu(Imu::default()))).collect();
        let mut damaged = frames[2].clone();
        let last_of_checksum = damaged.len() - 2;
        damaged[last_of_checksum] ^= 0x10;
        let order = [&frames[0], &frames[1], &frames[0], &damaged, &frames[3], &frames[3]];
        let (mut receiver, mut counters) = (Receiver::new(), RejectCounters::default());
        let mut used = Vec::new();
        for bytes in order {
            used.extend(receive(&mut receiver, bytes, &mut counters));
        }
        assert_eq!(used, [0, 1, 3]);
        let expected =
            RejectCounters { accepted: 3, crc: 1, lost: 1, duplicate: 1, reordered: 1, ..Default::default() };
        assert_eq!(counters, expected);
    }

    #[test]
    fn a_peer_that_starts_again_with_hello_is_followed_at_once() {
        let (mut receiver, mut counters) = (Receiver::new(), RejectCounters::default());
        let mut before = Sender::new();
        for _ in 0..20 {
            receive(&mut receiver, &wire(&mut before, Uplink::Imu(Imu::default())), &mut counters);
        }
        let mut after = Sender::new();
        receive(&mut receiver, &wire(&mut after, Uplink::Hello(Hello::ours(0))), &mut counters);
        receive(&mut receiver, &wire(&mut after, Uplink::Imu(Imu::default())), &mut counters);
        assert_eq!(counters, RejectCounters { accepted: 22, ..Default::default() });
    }

    #[test]
    fn a_greeting_is_never_taken_for_a_double() {
        let up = wire(&mut Sender::new(), Uplink::Hello(Hello::ours(1)));
        let (mut receiver, mut counters) = (Receiver::new(), RejectCounters::default());
        assert_eq!(receive(&mut receiver, &[up.clone(), up].concat(), &mut counters), [0, 0]);
    }

    #[test]
    fn a_damaged_frame_that_comes_again_is_counted_again_under_its_cause() {
        let mut damaged = wire(&mut Sender::new(), Uplink::Imu(Imu::default()));
        let last_of_checksum = damaged.len() - 2;
        damaged[last_of_checksum] ^= 0x10;
        let good = wire(&mut Sender::new(), Uplink::Imu(Imu::default()));
        let (mut receiver, mut counters) = (Receiver::<Uplink>::new(), RejectCounters::default());
        let stream = [damaged.repeat(5), good.repeat(3), damaged.repeat(2)].concat();
        let mut rest = stream.as_slice();
        let mut used = 0;
        while !rest.is_empty() {
            used += u32::from(receiver.take(&mut rest, &mut counters).is_some());
        }
        assert_eq!(used, 1);
        assert_eq!(counters, RejectCounters { accepted: 1, crc: 7, duplicate: 2, ..Default::default() });
    }

    #[test]
    fn a_double_is_known_by_its_bytes_and_one_with_other_bytes_by_its_number() {
        let mut sender = Sender::new();
        let first = wire(&mut sender, Uplink::Imu(Imu::default()));
        let same_number = wire(&mut Sender::new(), Uplink::Imu(Imu { status: 1, ..Imu::default() }));
        let (mut receiver, mut counters) = (Receiver::new(), RejectCounters::default());
        assert_eq!(receive(&mut receiver, &[first.clone(), first, same_number].concat(), &mut counters), [0]);
        assert_eq!(counters, RejectCounters { accepted: 1, duplicate: 2, ..Default::default() });
    }

    proptest! {
        /// Noise is skipped many stretches at a time where they lie together, and judged one by one where they come in pieces.
        #[test]
        fn noise_and_packets_count_the_same_in_one_piece_as_byte_by_byte(
            pieces in prop::collection::vec(
                prop_oneof![
                    prop::collection::vec(prop_oneof![Just(0_u8), 1..4_u8, any::<u8>()], 0..40).prop_map(Some),
                    Just(None),
                ],
                0..60,
            )
        ) {
            let mut sender = Sender::new();
            let stream: Vec<u8> = pieces
                .into_iter()
                .flat_map(|noise| noise.unwrap_or_else(|| [vec![0], wire(&mut sender, Uplink::Imu(Imu::default()))].concat()))
                .collect();
            let (mut slow, mut one_by_one) = (Receiver::<Uplink>::new(), RejectCounters::default());
            let used = receive(&mut slow, &stream, &mut one_by_one);
            let (mut fast, mut at_once) = (Receiver::<Uplink>::new(), RejectCounters::default());
            let (mut rest, mut found) = (stream.as_slice(), Vec::new());
            while !rest.is_empty() {
                found.extend(fast.take(&mut rest, &mut at_once).map(|frame| frame.sequence));
            }
            prop_assert_eq!((found, at_once), (used, one_by_one));
        }
    }
}
