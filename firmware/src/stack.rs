//! How deep the stack has been: painted at boot, read a little after each frame.

/// What unused stack holds.
pub const PAINT: u32 = 0xCCCC_CCCC;
/// Bytes below the stack that nothing may touch: more than any function's frame, so that none steps over them.
pub const GUARD_BYTES: u32 = 64 * 1024;
/// Words looked at in one go; the whole of a 16 KiB stack is seen every 16 frames.
const WORDS_PER_LOOK: usize = 256;

const WORD_BYTES: usize = size_of::<u32>();

/// The high-water mark of a painted stack.
///
/// It goes up from the bottom in pieces, looking for the first word that is no paint. A piece may have been used since
/// it was looked at; the next round finds it.
#[derive(Clone, Debug)]
pub struct HighWater {
    bottom: *const u32,
    words: usize,
    /// The lowest word found used.
    deepest: usize,
    /// The word to look at next.
    next: usize,
}

impl HighWater {
    /// The mark of the stack of `words` words from `bottom` up.
    ///
    /// # Safety
    /// All these words must be readable for as long as the value lives.
    #[must_use]
    pub const unsafe fn over(bottom: *const u32, words: usize) -> Self {
        Self { bottom, words, deepest: words, next: 0 }
    }

    /// Looks at one more piece; the deepest use found so far, bytes.
    pub fn look(&mut self) -> u32 {
        let end = self.deepest.min(self.next + WORDS_PER_LOOK);
        match (self.next..end).find(|word| self.read(*word) != PAINT) {
            Some(used) => {
                self.deepest = used;
                self.next = 0;
            }
            None if end == self.deepest => self.next = 0,
            None => self.next = end,
        }
        ((self.words - self.deepest) * WORD_BYTES) as u32
    }

    fn read(&self, word: usize) -> u32 {
        // SAFETY: `word` lies below `words`, which the caller of `over` vouched for.
        unsafe { self.bottom.add(word).read_volatile() }
    }
}

#[cfg(target_os = "none")]
pub use target::{guard_start, is_in_guard, paint};

#[cfg(target_os = "none")]
mod target {
    use super::{GUARD_BYTES, HighWater, PAINT, WORD_BYTES};

    unsafe extern "C" {
        static _stack_guard: u32;
        static _stack_end: u32;
        static _stack_start: u32;
    }

    /// Bytes below the caller's frame that are left unpainted: the frame that paints.
    const MARGIN_BYTES: usize = 256;

    /// Lowest address of the guard; the stack ends where the guard does.
    pub fn guard_start() -> usize {
        (&raw const _stack_guard).expose_provenance()
    }

    /// Whether an address lies in the guard.
    pub fn is_in_guard(address: usize) -> bool {
        address.wrapping_sub(guard_start()) < GUARD_BYTES as usize
    }

    /// Paints the unused part of the stack. Called at boot.
    #[inline(never)]
    pub fn paint() -> HighWater {
        let (bottom, top) = (&raw const _stack_end, &raw const _stack_start);
        let here = core::cell::Cell::new(0u32);
        let unused_bytes = here.as_ptr().addr().saturating_sub(MARGIN_BYTES).saturating_sub(bottom.addr());
        for word in 0..unused_bytes / WORD_BYTES {
            // SAFETY: the words between the end of the stack and this frame, which nothing uses.
            unsafe { bottom.cast_mut().add(word).write_volatile(PAINT) };
        }
        // SAFETY: the memory between these two symbols is the stack, for ever.
        unsafe { HighWater::over(bottom, (top.addr() - bottom.addr()) / WORD_BYTES) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORDS: usize = 1_000;

    fn rounds(mark: &mut HighWater) -> u32 {
        (0..2 * WORDS.div_ceil(WORDS_PER_LOOK)).map(|_| mark.look()).last().unwrap()
    }

    #[test]
    fn the_mark_follows_the_deepest_use_and_never_comes_back() {
        let mut stack = vec![PAINT; WORDS];
        let memory = stack.as_mut_ptr();
        // SAFETY: the vector outlives the mark.
        let mut mark = unsafe { HighWater::over(memory, WORDS) };
        let set = |word: usize, value: u32| {
            // SAFETY: a word of the vector.
            unsafe { memory.add(word).write_volatile(value) };
        };
        assert_eq!(rounds(&mut mark), 0);
        set(990, 1);
        assert_eq!(rounds(&mut mark), 40);
        // A hole left unwritten by a deep frame does not hide the word below it.
        set(300, 1);
        assert_eq!(rounds(&mut mark), 2_800);
        set(300, PAINT);
        assert_eq!(rounds(&mut mark), 2_800);
        set(0, 0);
        assert_eq!(rounds(&mut mark), 4_000);
    }
}
