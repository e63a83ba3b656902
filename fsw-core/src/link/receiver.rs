//! Both ends of a link above framing: number and encode what goes out, decode, order and count what comes in.

use core::marker::PhantomData;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::framing::{Decoder, EncodeError, FrameBytes, decode, encode_frame};
use super::packet::{Downlink, Frame, RejectCounters, Uplink};
use super::sequence::SequenceMonitor;
use crate::time::MissionTime;

/// What the link needs to know of its packets.
pub trait Packet: Serialize + DeserializeOwned {
    /// Whether the packet opens a session, after which the sender's numbering may start anew.
    fn opens_session(&self) -> bool;
}

/// Tag of the packet that opens a session, in both directions: the first variant.
const SESSION_TAG: u32 = 0;

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
        packet: P,
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
    decoder: Decoder,
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
        Self { decoder: Decoder::new(), sequence: SequenceMonitor::new(), packet: PhantomData }
    }

    /// Takes one byte; `Some` when it completes a packet that is to be used.
    pub fn push(&mut self, byte: u8, counters: &mut RejectCounters) -> Option<Frame<P>> {
        self.take(&mut [byte].as_slice(), counters)
    }

    /// Takes bytes off the front of `bytes` up to the end of a frame; `Some` when that is a packet that is to be used.
    pub fn take(&mut self, bytes: &mut &[u8], counters: &mut RejectCounters) -> Option<Frame<P>> {
        let payload = match self.decoder.take(bytes)? {
            Ok(payload) => payload,
            Err(reject) => {
                counters.count(reject);
                return None;
            }
        };
        // A flood of doubles is to cost little: their head is enough to know them.
        if let Ok((sequence, _, tag)) = head(payload)
            && tag != SESSION_TAG
            && self.sequence.is_stale(sequence)
        {
            self.sequence.observe(sequence, counters);
            return None;
        }
        let frame = match decode::<Frame<P>>(payload) {
            Ok(frame) => frame,
            Err(reject) => {
                counters.count(reject);
                return None;
            }
        };
        if frame.packet.opens_session() {
            self.sequence.restart();
        }
        if !self.sequence.observe(frame.sequence, counters).is_new() {
            return None;
        }
        counters.accepted = counters.accepted.saturating_add(1);
        Some(frame)
    }
}

/// Sequence number, time stamp and tag of the packet: what every payload begins with.
fn head(payload: &[u8]) -> Result<(u16, u32, u32), postcard::Error> {
    postcard::take_from_bytes(payload).map(|(head, _)| head)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::framing::MAX_FRAME;
    use crate::link::packet::{Hello, Imu};
    use std::vec::Vec;

    fn wire(sender: &mut Sender, packet: Uplink) -> Vec<u8> {
        let mut out = [0; MAX_FRAME];
        sender.encode(MissionTime(0), packet, &mut out).unwrap().to_vec()
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
    fn the_greeting_is_the_first_packet_of_both_directions_and_is_never_taken_for_a_double() {
        let mut out = [0; MAX_FRAME];
        let up = wire(&mut Sender::new(), Uplink::Hello(Hello::ours(1)));
        let down = Sender::new().encode(MissionTime(0), Downlink::Hello(Hello::ours(1)), &mut out).unwrap().to_vec();
        for bytes in [&up, &down] {
            let mut decoder = Decoder::new();
            let payload = decoder.take(&mut bytes.as_slice()).unwrap().unwrap();
            assert_eq!(head(payload), Ok((0, 0, SESSION_TAG)));
        }
        let (mut receiver, mut counters) = (Receiver::new(), RejectCounters::default());
        assert_eq!(receive(&mut receiver, &[up.clone(), up].concat(), &mut counters), [0, 0]);
    }
}
