//! Bytes searched, compared and copied a word at a time, without any panic path.

use super::{DELIMITER, SHORTEST_STRETCH};
use crate::link::packet::RejectCounters;

/// Bytes searched for a delimiter at a time.
const WORD: usize = 4;
/// One in each byte of a word.
const ONES: u32 = 0x0101_0101;

/// What lies before the first delimiter and what behind it; none without a delimiter.
pub(crate) fn split_at_delimiter(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (words, _) = bytes.as_chunks::<WORD>();
    let mut from = 0;
    for word in words {
        let zeros = zeros_of(*word);
        if zeros != 0 {
            return split_around(bytes, from + zeros.trailing_zeros() as usize / 8);
        }
        from += WORD;
    }
    let within = bytes.get(from..)?.iter().position(|byte| *byte == DELIMITER)?;
    split_around(bytes, from + within)
}

/// What lies before the byte at `place` and what behind it.
#[inline(always)]
fn split_around(bytes: &[u8], place: usize) -> Option<(&[u8], &[u8])> {
    let (before, rest) = bytes.split_at_checked(place)?;
    Some((before, rest.get(1..)?))
}

/// How many bytes both begin with, four at a time: up to three fewer than there are.
pub(crate) fn common_prefix(one: &[u8], other: &[u8]) -> usize {
    let ((a, _), (b, _)) = (one.as_chunks::<WORD>(), other.as_chunks::<WORD>());
    let same = |(a, b): &(&[u8; WORD], &[u8; WORD])| u32::from_le_bytes(**a) == u32::from_le_bytes(**b);
    WORD * a.iter().zip(b).take_while(same).count()
}

/// Takes short stretches that are no frames off the front of `bytes`, where one begins, and counts them: those too short for
/// any, and those whose first block would end behind them. At the end of the bytes a few are left.
#[inline(never)]
pub(crate) fn skip_short_noise(bytes: &mut &[u8], counters: &mut RejectCounters) {
    let (mut runts, mut broken, mut rest) = (0_u32, 0_u32, *bytes);
    // Each turn takes a byte or more.
    while let Some([code, b, c, d, e, f, g, h, i, j, k, l]) = rest.first_chunk::<{ 3 * WORD }>() {
        let Some(length) = first_zero_of([[*code, *b, *c, *d], [*e, *f, *g, *h], [*i, *j, *k, *l]]) else { break };
        if length < SHORTEST_STRETCH {
            runts += u32::from(length > 0);
        } else if usize::from(*code) > length {
            broken += 1;
        } else {
            break;
        }
        rest = rest.get(length + 1..).unwrap_or_default();
    }
    *bytes = rest;
    counters.crc = counters.crc.saturating_add(runts);
    counters.cobs = counters.cobs.saturating_add(broken);
}

/// Place of the first zero in three words.
#[inline(always)]
const fn first_zero_of([first, second, third]: [[u8; WORD]; 3]) -> Option<usize> {
    let (zeros, before) = match (zeros_of(first), zeros_of(second), zeros_of(third)) {
        (0, 0, 0) => return None,
        (0, 0, zeros) => (zeros, 2 * WORD),
        (0, zeros, _) => (zeros, WORD),
        (zeros, _, _) => (zeros, 0),
    };
    Some(before + zeros.trailing_zeros() as usize / 8)
}

/// The highest bit of each byte that is zero, up to the first of them; higher ones may be wrong. A byte of a word is
/// zero when taking one from it borrows: found for all four at once.
#[inline]
const fn zeros_of(bytes: [u8; WORD]) -> u32 {
    let word = u32::from_le_bytes(bytes);
    word.wrapping_sub(ONES) & !word & (ONES << 7)
}

/// Whether both hold the same bytes, four at a time.
#[inline(always)]
pub(crate) fn are_same(one: &[u8], other: &[u8]) -> bool {
    let ((a, a_rest), (b, b_rest)) = (one.as_chunks::<WORD>(), other.as_chunks::<WORD>());
    one.len() == other.len()
        && a.iter().zip(b).all(|(a, b)| u32::from_le_bytes(*a) == u32::from_le_bytes(*b))
        && a_rest.iter().zip(b_rest).all(|(a, b)| a == b)
}

/// Copies as many bytes as there are and as there is room for. (`copy_from_slice` keeps a panic for unequal lengths.)
#[inline]
pub(crate) fn copy(room: &mut [u8], bytes: &[u8]) {
    room.iter_mut().zip(bytes).for_each(|(slot, byte)| *slot = *byte);
}
