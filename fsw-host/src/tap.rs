//! Listening on the byte stream: cuts it at the delimiters and decodes each piece, without changing a byte.

use std::marker::PhantomData;

use fsw_core::link::framing::{DELIMITER, Decoder, MAX_FRAME, Reject, decode};
use fsw_core::link::packet::Frame;
use serde::de::DeserializeOwned;

/// Longest piece held back while no delimiter comes; longer ones pass in pieces.
pub const LONGEST_PIECE: usize = 2 * MAX_FRAME;

/// What a piece of the stream turned out to be.
#[derive(Debug)]
pub enum Heard<P> {
    /// A packet.
    Packet(Frame<P>),
    /// Bytes that are no packet, and why.
    Damaged(Reject),
    /// Nothing: a lone delimiter, or the rest of something already reported.
    Nothing,
}

/// A tap on one direction of the link, with packets of type `P`.
pub struct Tap<P> {
    decoder: Decoder,
    piece: Vec<u8>,
    heard: Heard<P>,
    packets: PhantomData<P>,
}

impl<P: DeserializeOwned> Default for Tap<P> {
    fn default() -> Self {
        Self {
            decoder: Decoder::new(),
            piece: Vec::with_capacity(LONGEST_PIECE),
            heard: Heard::Nothing,
            packets: PhantomData,
        }
    }
}

impl<P: DeserializeOwned> Tap<P> {
    /// Takes bytes as they arrive; calls `each` with every complete piece (its delimiter included) and what it is.
    /// Bytes behind the last delimiter wait for the next call.
    pub fn feed(&mut self, mut bytes: &[u8], mut each: impl FnMut(&[u8], Heard<P>)) {
        while !bytes.is_empty() {
            let room = LONGEST_PIECE - self.piece.len();
            let reach = &bytes[..room.min(bytes.len())];
            let ends = reach.iter().position(|byte| *byte == DELIMITER);
            let (now, later) = bytes.split_at(ends.map_or(reach.len(), |at| at + 1));
            bytes = later;
            self.piece.extend_from_slice(now);
            self.decode(now);
            if ends.is_some() || self.piece.len() >= LONGEST_PIECE {
                each(&self.piece, std::mem::replace(&mut self.heard, Heard::Nothing));
                self.piece.clear();
            }
        }
    }

    fn decode(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if let Some(result) = self.decoder.push(byte) {
                self.heard = match result.and_then(decode::<Frame<P>>) {
                    Ok(frame) => Heard::Packet(frame),
                    Err(reject) => Heard::Damaged(reject),
                };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fsw_core::link::framing::{FrameBytes, encode_frame};
    use fsw_core::link::packet::{Pressure, Uplink};
    use fsw_core::time::MissionTime;

    fn pressure(sequence: u16) -> Vec<u8> {
        let packet = Uplink::Pressure(Pressure { stagnation_pa: 10.0, status: 0 });
        let frame = Frame { sequence, time: MissionTime(20_000), packet };
        let mut room: FrameBytes = [0; MAX_FRAME];
        encode_frame(&frame, &mut room).unwrap().to_vec()
    }

    fn listen(bytes: &[u8]) -> (Vec<u8>, Vec<String>) {
        let (mut passed, mut heard) = (Vec::new(), Vec::new());
        let mut tap = Tap::<Uplink>::default();
        for chunk in bytes.chunks(7) {
            tap.feed(chunk, |piece, what| {
                passed.extend_from_slice(piece);
                heard.push(match what {
                    Heard::Packet(frame) => format!("packet {}", frame.sequence),
                    Heard::Damaged(reject) => format!("{reject:?}"),
                    Heard::Nothing => "nothing".to_owned(),
                });
            });
        }
        (passed, heard)
    }

    #[test]
    fn every_byte_passes_unchanged_and_in_order() {
        let mut bytes = [pressure(1), pressure(2)].concat();
        bytes[3] ^= 0x10;
        bytes.extend_from_slice(&[0, 0]);
        let (passed, heard) = listen(&bytes);
        assert_eq!(passed, bytes);
        assert_eq!(heard[1..], ["packet 2", "nothing", "nothing"]);
        assert_ne!(heard[0], "packet 1");
    }

    #[test]
    fn a_stream_without_delimiters_is_not_held_back_for_ever() {
        let bytes = vec![0x55; 5 * LONGEST_PIECE];
        assert_eq!(listen(&bytes).0, bytes);
    }
}
