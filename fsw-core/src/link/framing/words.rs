//! Bytes searched, compared and copied a word at a time, without any panic path.

use super::{DELIMITER, SHORTEST_STRETCH};

/// Bytes searched for a delimiter at a time.
const WORD: usize = 4;
/// One in each byte of a word.
const ONES: u32 = 0x0101_0101;

/// What lies before the first delimiter and what behind it; none without a delimiter.
pub(super) fn split_at_delimiter(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (words, _) = bytes.as_chunks::<WORD>();
    let mut from = 0;
    for word in words {
        if zeros_of(*word) != 0 {
            break;
        }
        from += WORD;
    }
    let within = bytes.get(from..)?.iter().position(|byte| *byte == DELIMITER)?;
    let (stretch, rest) = bytes.split_at_checked(from + within)?;
    Some((stretch, rest.get(1..)?))
}

/// How many bytes both begin with, four at a time: up to three fewer than there are.
pub(crate) fn common_prefix(one: &[u8], other: &[u8]) -> usize {
    let ((a, _), (b, _)) = (one.as_chunks::<WORD>(), other.as_chunks::<WORD>());
    let same = |(a, b): &(&[u8; WORD], &[u8; WORD])| u32::from_le_bytes(**a) == u32::from_le_bytes(**b);
    WORD * a.iter().zip(b).take_while(same).count()
}

/// Takes stretches too short for any frame off the front of `bytes`, where one begins; how many. At the end of the bytes
/// a few are left.
pub(crate) fn skip_runts(bytes: &mut &[u8]) -> u32 {
    let (mut runts, mut rest) = (0, *bytes);
    // Each turn takes a byte or more.
    while let Some([a, b, c, d, e, f]) = rest.first_chunk::<SHORTEST_STRETCH>() {
        let zeros = zeros_of([*a, *b, *c, *d]);
        let length = if zeros != 0 {
            zeros.trailing_zeros() as usize / 8
        } else if *e == DELIMITER {
            WORD
        } else if *f == DELIMITER {
            WORD + 1
        } else {
            break;
        };
        runts += u32::from(length > 0);
        rest = rest.get(length + 1..).unwrap_or_default();
    }
    *bytes = rest;
    runts
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
