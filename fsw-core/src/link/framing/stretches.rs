//! [`Stretches`]: what lies between two delimiters.

use super::words::{copy, split_at_delimiter};
use super::{LONGEST_STRETCH, Reject};

/// Cuts a byte stream at its delimiters.
///
/// A stretch that lies whole in the bytes given is handed on where it lies; one that comes in pieces is put together
/// first. Every non-empty stretch yields exactly one result, so accepted and rejected frames add up. Two delimiters in
/// a row enclose nothing: a sender may send `0x00` at any time to flush damage.
#[derive(Clone, Debug)]
pub(crate) struct Stretches {
    /// What has come of a stretch so far.
    begun: [u8; LONGEST_STRETCH],
    length: usize,
    /// Too long: reported, waiting for the delimiter.
    skipping: bool,
}

impl Stretches {
    pub(crate) const fn new() -> Self {
        Self { begun: [0; LONGEST_STRETCH], length: 0, skipping: false }
    }

    /// Whether the next byte begins a stretch.
    #[inline(always)]
    pub(crate) const fn is_between(&self) -> bool {
        self.length == 0 && !self.skipping
    }

    /// Takes bytes off the front of `bytes` up to and including the next delimiter. `Some` for what lies before it, or
    /// because that is too long; `None` when the bytes are used up or the delimiter ended nothing.
    pub(crate) fn take<'s, 'b: 's>(&'s mut self, bytes: &mut &'b [u8]) -> Option<Result<&'s [u8], Reject>> {
        let whole = *bytes;
        let Some((stretch, rest)) = split_at_delimiter(whole) else {
            *bytes = &[];
            if self.skipping || self.gather(whole) {
                return None;
            }
            self.skipping = true;
            return Some(Err(Reject::Overflow));
        };
        *bytes = rest;
        if self.is_between() {
            return match stretch.len() {
                0 => None,
                1..=LONGEST_STRETCH => Some(Ok(stretch)),
                _ => Some(Err(Reject::Overflow)),
            };
        }
        if core::mem::take(&mut self.skipping) {
            return None;
        }
        let fits = self.gather(stretch);
        let length = core::mem::take(&mut self.length);
        Some(if fits { Ok(self.begun.get(..length)?) } else { Err(Reject::Overflow) })
    }

    /// Puts bytes behind those that have come; false, and nothing has come, when there is no room for them.
    fn gather(&mut self, bytes: &[u8]) -> bool {
        let end = self.length.saturating_add(bytes.len());
        let room = self.begun.get_mut(self.length..end);
        let fits = room.is_some();
        copy(room.unwrap_or_default(), bytes);
        self.length = if fits { end } else { 0 };
        fits
    }
}
