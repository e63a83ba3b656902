//! [`Body`]: the stuffing of a stretch undone, and its checksum compared.

use super::words::copy;
use super::{CRC_BYTES, CRC32, DELIMITER, FULL_BLOCK, MAX_BODY, Reject, SHORTEST_STRETCH};

/// Room for the body of one frame, without its stuffing.
#[derive(Clone, Debug)]
pub(crate) struct Body([u8; MAX_BODY]);

impl Body {
    pub(crate) const fn new() -> Self {
        Self([0; MAX_BODY])
    }

    /// The payload of a stretch between delimiters, if its stuffing is consistent and its checksum agrees. Dear for noise, which
    /// [`glance`] knows as such.
    pub(crate) fn unstuffed(&mut self, stretch: &[u8]) -> Result<&[u8], Reject> {
        let (mut length, mut rest) = (0_usize, stretch);
        // Each turn takes a byte or more.
        while let [code, behind @ ..] = rest {
            let data = usize::from(*code).saturating_sub(1);
            let (block, next) = behind.split_at_checked(data).ok_or(Reject::Cobs)?;
            let end = length + data;
            copy(self.0.get_mut(length..end).ok_or(Reject::Overflow)?, block);
            length = end;
            rest = next;
            if *code != FULL_BLOCK && !rest.is_empty() {
                *self.0.get_mut(length).ok_or(Reject::Overflow)? = 0;
                length += 1;
            }
        }
        verified_payload(self.0.get(..length).unwrap_or_default())
    }
}

/// Why a stretch between delimiters is no frame, if that is to be seen for the price of a few steps: as of most noise.
#[inline]
pub(crate) fn glance(stretch: &[u8]) -> Option<Reject> {
    if stretch.len() < SHORTEST_STRETCH {
        return Some(Reject::Crc);
    }
    (!ends_with_a_block(stretch)).then_some(Reject::Cobs)
}

/// Whether the chain of block lengths ends where the stretch does.
fn ends_with_a_block(stretch: &[u8]) -> bool {
    let mut at = 0;
    // Each turn goes on by a byte or more: no byte of a stretch is zero.
    while let Some(code) = stretch.get(at) {
        at += usize::from(*code);
        if *code == DELIMITER {
            return false;
        }
    }
    at == stretch.len()
}

/// The payload of payload and checksum, if they agree.
fn verified_payload(body: &[u8]) -> Result<&[u8], Reject> {
    let (payload, checksum) = body.split_last_chunk::<CRC_BYTES>().ok_or(Reject::Crc)?;
    if CRC32.checksum(payload) == u32::from_le_bytes(*checksum) { Ok(payload) } else { Err(Reject::Crc) }
}
