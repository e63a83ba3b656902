//! Framing: value → postcard → CRC-32 → COBS → `0x00`, and back without any panic path.
//!
//! The decoder is our own because `cobs::decode_in_place` and postcard's framing flavours contain panic paths. It never
//! needs more than its fixed buffers and starts afresh after every `0x00`, so that damage never outlives the frame it
//! happened in. A full line brings nearly two thousand bytes in a minor frame: what is no packet has to be known as such
//! for a few instructions a byte.

mod body;
mod stretches;
mod words;

pub(crate) use body::{Body, glance};
pub(crate) use stretches::Stretches;
pub(crate) use words::{are_same, common_prefix, copy, skip_short_noise, split_at_delimiter};

use core::fmt;

use crc::{CRC_32_ISO_HDLC, Crc};
use postcard::experimental::max_size::MaxSize;
use serde::{Deserialize, Serialize};

use super::packet::{Downlink, Frame, RejectCounters, Uplink};

/// Longest postcard encoding of a frame in either direction, bytes.
pub const MAX_PAYLOAD: usize = {
    let (up, down) = (Frame::<Uplink>::POSTCARD_MAX_SIZE, Frame::<Downlink>::POSTCARD_MAX_SIZE);
    if up > down { up } else { down }
};
/// Bytes of the checksum behind the payload.
pub const CRC_BYTES: usize = 4;
/// Payload and checksum before stuffing, bytes.
pub const MAX_BODY: usize = MAX_PAYLOAD + CRC_BYTES;
/// Longest frame on the wire, with stuffing and delimiter, bytes.
pub const MAX_FRAME: usize = wire_len(MAX_PAYLOAD);
/// Ends every frame and occurs nowhere inside one.
pub const DELIMITER: u8 = 0x00;

/// Longest stretch of bytes between two delimiters that can be a frame.
pub(crate) const LONGEST_STRETCH: usize = MAX_FRAME - 1;
/// Shortest one: a checksum, a byte of payload and a code byte.
pub(crate) const SHORTEST_STRETCH: usize = CRC_BYTES + 2;
/// COBS code of a full block of 254 bytes that no zero follows.
const FULL_BLOCK: u8 = 0xFF;
/// Data bytes of a full block.
const FULL_BLOCK_BYTES: usize = 254;

/// The CRC-32 of Ethernet and zip (reflected, polynomial 0x04C11DB7), a byte at a time from a table of 1 KiB.
#[cfg(target_os = "none")]
pub(crate) static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
/// The same on a host, which flies thousands of flights and has room: sixteen bytes at a time. The same checksum.
#[cfg(not(target_os = "none"))]
pub(crate) static CRC32: Crc<u32, crc::Table<16>> = Crc::<u32, crc::Table<16>>::new(&CRC_32_ISO_HDLC);

/// Room for one encoded frame.
pub type FrameBytes = [u8; MAX_FRAME];

/// Largest number of bytes on the wire of a payload of `payload` bytes: checksum, one code byte per started block of
/// 254 bytes, delimiter.
#[must_use]
pub const fn wire_len(payload: usize) -> usize {
    let body = payload + CRC_BYTES;
    body + body.div_ceil(FULL_BLOCK_BYTES) + 1
}

/// Why a value could not be encoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EncodeError {
    /// It needs more than [`MAX_PAYLOAD`] bytes. Cannot happen to packets.
    TooLong,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the value needs more than the {MAX_PAYLOAD} bytes of a frame")
    }
}

impl core::error::Error for EncodeError {}

/// Why received bytes are no packet. Numbered from one, so that "none of them" is zero: memory cleared at boot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reject {
    /// More bytes than any frame has, without a delimiter.
    Overflow = 1,
    /// The stuffing is inconsistent: the frame ends inside a block.
    Cobs,
    /// The checksum does not match, or the frame is too short to hold one.
    Crc,
    /// The checksum matches but the bytes are no value of the expected type, or some are left over.
    Decode,
}

impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Overflow => "more bytes than a frame can have without a delimiter",
            Self::Cobs => "byte stuffing is inconsistent",
            Self::Crc => "checksum does not match",
            Self::Decode => "not a packet of this protocol",
        })
    }
}

impl core::error::Error for Reject {}

impl RejectCounters {
    /// Counts a rejected frame under its cause.
    pub fn count(&mut self, reject: Reject) {
        let counter = self.of(reject);
        *counter = counter.saturating_add(1);
    }

    /// The counter of a cause.
    pub(crate) fn of(&mut self, reject: Reject) -> &mut u32 {
        match reject {
            Reject::Overflow => &mut self.overflow,
            Reject::Cobs => &mut self.cobs,
            Reject::Crc => &mut self.crc,
            Reject::Decode => &mut self.decode,
        }
    }
}

/// Encodes one packet in its envelope; the result lies at the start of `out` and includes the delimiter.
///
/// # Errors
/// [`EncodeError::TooLong`] when the value does not fit, which [`MaxSize`] excludes for packets.
pub fn encode_frame<'o, P: Serialize>(frame: &Frame<P>, out: &'o mut FrameBytes) -> Result<&'o [u8], EncodeError> {
    encode(frame, out)
}

/// Encodes any value as a frame on the wire; the result lies at the start of `out` and includes the delimiter.
///
/// # Errors
/// [`EncodeError::TooLong`] when the value needs more than [`MAX_PAYLOAD`] bytes.
///
/// The payload is written where it stands on the wire, behind the first code byte, and stuffed there: no byte is moved.
pub fn encode<'o, T: Serialize + ?Sized>(value: &T, out: &'o mut FrameBytes) -> Result<&'o [u8], EncodeError> {
    let room = out.get_mut(1..=MAX_PAYLOAD).ok_or(EncodeError::TooLong)?;
    let payload = postcard::to_slice(value, room).map_err(|_| EncodeError::TooLong)?.len();
    let end = seal(payload, out).ok_or(EncodeError::TooLong)?;
    out.get(..end).ok_or(EncodeError::TooLong)
}

/// Makes a frame of the payload of this length behind the first byte: checksum, stuffing, delimiter. The length of the
/// frame; `None` when it does not fit, which [`MAX_FRAME`] excludes.
fn seal(payload: usize, out: &mut FrameBytes) -> Option<usize> {
    let (covered, rest) = out.get_mut(1..)?.split_at_mut_checked(payload)?;
    *rest.first_chunk_mut::<CRC_BYTES>()? = CRC32.checksum(covered).to_le_bytes();
    let end = stuff(1 + payload + CRC_BYTES, out)?;
    *out.get_mut(end)? = DELIMITER;
    Some(end + 1)
}

/// Stuffs the bytes from the second to before `end`, in place; the first becomes a code. Every zero gives its place to
/// the code of the block behind it. Only after a full block, of 254 bytes without a zero, the rest moves on by one.
/// The new end.
fn stuff(mut end: usize, out: &mut FrameBytes) -> Option<usize> {
    let mut code = 0;
    // Each turn ends a block, of a byte or more of the frame.
    for _ in 0..MAX_FRAME {
        let data = out.get(code + 1..end)?;
        let block = data.get(..FULL_BLOCK_BYTES).unwrap_or(data);
        let length = block.iter().position(|byte| *byte == 0).unwrap_or(block.len());
        let (next, last) = (code + 1 + length, length == data.len());
        *out.get_mut(code)? = u8::try_from(length + 1).ok()?;
        if last {
            return Some(end);
        }
        if length == FULL_BLOCK_BYTES {
            end += 1;
            // Not `rotate_right`, which keeps a panic.
            let mut before = 0;
            out.get_mut(next..end)?.iter_mut().for_each(|byte| core::mem::swap(byte, &mut before));
        }
        code = next;
    }
    None
}

/// Decodes the payload of a frame whose checksum has been verified.
///
/// # Errors
/// [`Reject::Decode`] when the bytes are no `T` or some are left over.
pub fn decode<'p, T: Deserialize<'p>>(payload: &'p [u8]) -> Result<T, Reject> {
    match postcard::take_from_bytes(payload) {
        Ok((value, [])) => Ok(value),
        _ => Err(Reject::Decode),
    }
}

/// Finds frames in a byte stream: the payload of each whose checksum agrees, or why it is none.
#[derive(Clone, Debug)]
pub struct Decoder {
    stretches: Stretches,
    body: Body,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder at the start of a frame.
    #[must_use]
    pub const fn new() -> Self {
        Self { stretches: Stretches::new(), body: Body::new() }
    }

    /// Takes one byte. `Some` when it ends a frame: its payload with verified checksum, or why it is none.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], Reject>> {
        self.take(&mut [byte].as_slice())
    }

    /// Takes bytes off the front of `bytes` up to and including the one that ends a frame. `Some` for its payload with
    /// verified checksum, or why it is none; `None` when the bytes are used up or a delimiter ended nothing.
    pub fn take(&mut self, bytes: &mut &[u8]) -> Option<Result<&[u8], Reject>> {
        let judged = self.stretches.take(bytes)?.and_then(|stretch| glance(stretch).map_or(Ok(stretch), Err));
        Some(judged.and_then(|stretch| self.body.unstuffed(stretch)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link::packet::{Imu, Pressure};
    use crate::time::MissionTime;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn frame(sequence: u16) -> Frame<Uplink> {
        let imu = Imu { delta_v_counts: [1, -2, 300_000], delta_theta_counts: [0, 0, -7], status: 0 };
        Frame { sequence, time: MissionTime(20_000), packet: Uplink::Imu(imu) }
    }

    fn encoded<T: Serialize>(value: &T) -> Vec<u8> {
        let mut out = [0; MAX_FRAME];
        encode(value, &mut out).unwrap().to_vec()
    }

    fn results(decoder: &mut Decoder, bytes: &[u8]) -> Vec<Result<Vec<u8>, Reject>> {
        bytes.iter().filter_map(|b| decoder.push(*b).map(|r| r.map(<[u8]>::to_vec))).collect()
    }

    #[test]
    fn the_checksum_is_the_crc_32_of_ethernet() {
        // Check value of the CRC catalogue for "123456789".
        assert_eq!(CRC32.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn a_frame_comes_back_as_it_was_sent() {
        let bytes = encoded(&frame(7));
        assert_eq!(bytes.iter().filter(|b| **b == 0).count(), 1);
        let payloads = results(&mut Decoder::new(), &bytes);
        assert_eq!(payloads.len(), 1);
        assert_eq!(decode::<Frame<Uplink>>(payloads[0].as_ref().unwrap()), Ok(frame(7)));
    }

    #[test]
    fn delimiters_alone_are_no_frames() {
        assert!(results(&mut Decoder::new(), &[0, 0, 0]).is_empty());
    }

    #[test]
    fn a_frame_cut_off_inside_a_block_is_a_stuffing_error_and_the_next_is_good() {
        let good = encoded(&frame(1));
        let mut stream = good[..good.len() - 3].to_vec();
        stream.push(0);
        stream.extend_from_slice(&good);
        let mut decoder = Decoder::new();
        let got = results(&mut decoder, &stream);
        assert_eq!(got[0], Err(Reject::Cobs));
        assert!(got[1].is_ok());
    }

    #[test]
    fn an_endless_frame_is_reported_once_and_ends_at_the_delimiter() {
        let mut stream = std::vec![0x55; 10 * MAX_FRAME];
        stream.push(0);
        stream.extend_from_slice(&encoded(&frame(1)));
        let got = results(&mut Decoder::new(), &stream);
        assert_eq!(got[0], Err(Reject::Overflow));
        assert!(got[1].is_ok());
        assert_eq!(got.len(), 2);
    }

    #[test]
    fn frames_too_short_for_a_checksum_are_rejected() {
        for stream in [&[1u8, 0][..], &[2, 9, 0], &[4, 1, 2, 3, 0]] {
            assert_eq!(results(&mut Decoder::new(), stream), [Err(Reject::Crc)], "{stream:?}");
        }
    }

    #[test]
    fn left_over_bytes_are_a_decode_error() {
        let longer = encoded(&(frame(1), 0u8));
        let payload = results(&mut Decoder::new(), &longer).remove(0).unwrap();
        assert_eq!(decode::<Frame<Uplink>>(&payload), Err(Reject::Decode));
    }

    #[test]
    fn the_other_direction_is_not_taken_for_ours() {
        let up = Frame { sequence: 0, time: MissionTime(0), packet: Uplink::Pressure(Pressure::default()) };
        let payload = results(&mut Decoder::new(), &encoded(&up)).remove(0).unwrap();
        assert_eq!(decode::<Frame<Downlink>>(&payload), Err(Reject::Decode));
    }

    #[test]
    fn a_value_beyond_the_frame_is_refused() {
        let mut out = [0; MAX_FRAME];
        assert_eq!(encode(&[0u8; MAX_PAYLOAD + 1][..].as_ref(), &mut out).err(), Some(EncodeError::TooLong));
    }

    proptest! {
        /// Runs of zeros and of 254 and more non-zero bytes are the hard cases of COBS.
        #[test]
        fn any_payload_survives_stuffing(runs in prop::collection::vec((any::<bool>(), 1usize..300), 1..4)) {
            let mut body: Vec<u8> = runs.iter().flat_map(|(zero, n)| {
                std::iter::repeat_n(if *zero { 0u8 } else { 0xA5 }, *n)
            }).collect();
            body.truncate(MAX_PAYLOAD);
            let checksum = CRC32.checksum(&body).to_le_bytes();
            let mut framed = body.clone();
            framed.extend_from_slice(&checksum);
            let mut wire = std::vec![0u8; framed.len() + framed.len() / 254 + 2];
            let len = cobs::try_encode(&framed, &mut wire).unwrap();
            wire.truncate(len);
            prop_assert!(len < wire_len(body.len()));
            wire.push(0);
            let mut ours = [0xEE; MAX_FRAME];
            ours[1..=body.len()].copy_from_slice(&body);
            let end = seal(body.len(), &mut ours).unwrap();
            prop_assert_eq!(&ours[..end], &wire, "as an independent encoder stuffs it");
            prop_assert_eq!(results(&mut Decoder::new(), &wire), std::vec![Ok(body)]);
        }

        #[test]
        fn garbage_never_panics_and_gives_one_result_per_stretch(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
            let mut closed = bytes.clone();
            closed.push(0);
            let stretches = closed.split(|b| *b == 0).filter(|s| !s.is_empty()).count();
            prop_assert_eq!(results(&mut Decoder::new(), &closed).len(), stretches);
        }
    }
}
