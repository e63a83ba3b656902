//! [`Slot`]: an optional value that is all zero bytes when there is none.

/// A value or none, as in `Option`, for what stands in the static state of the flight software.
///
/// `Option` hides its tag among the bits that the value does not use, and then *none* is not zero. A single such byte puts
/// the whole state, 19 KB of zeros, into the flash of the computer instead of into memory that is cleared at boot.
#[derive(Clone, Debug, Default, PartialEq)]
#[repr(u8)]
pub enum Slot<T> {
    /// None.
    #[default]
    Empty = 0,
    /// The value.
    Full(T) = 1,
}

impl<T> Slot<T> {
    /// The value, if there is one.
    #[must_use]
    pub const fn get(&self) -> Option<&T> {
        match self {
            Self::Empty => None,
            Self::Full(value) => Some(value),
        }
    }

    /// The value, if there is one, to be changed.
    #[must_use]
    pub const fn get_mut(&mut self) -> Option<&mut T> {
        match self {
            Self::Empty => None,
            Self::Full(value) => Some(value),
        }
    }

    /// Holds this value from now on.
    #[inline]
    pub fn put(&mut self, value: T) {
        *self = Self::Full(value);
    }

    /// Takes the value out, if there is one.
    #[inline]
    pub fn take(&mut self) -> Option<T> {
        match core::mem::take(self) {
            Self::Empty => None,
            Self::Full(value) => Some(value),
        }
    }

    /// Holds nothing from now on.
    #[inline]
    pub fn clear(&mut self) {
        *self = Self::Empty;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slot_gives_back_what_was_put_into_it_once() {
        let mut slot = Slot::default();
        assert_eq!(slot.get(), None);
        assert_eq!(slot.take(), None);
        slot.put(7);
        slot.get_mut().into_iter().for_each(|value| *value += 1);
        assert_eq!(slot.get(), Some(&8));
        assert_eq!(slot.take(), Some(8));
        assert_eq!(slot.take(), None);
        slot.put(9);
        slot.clear();
        assert_eq!(slot, Slot::Empty);
    }
}
