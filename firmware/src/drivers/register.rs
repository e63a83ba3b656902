//! [`Register`]: a memory-mapped register, read and written whole, exactly once each time.

/// A register at an address.
#[derive(Debug)]
pub struct Register<T>(*mut T);

impl<T> Clone for Register<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Register<T> {}

impl<T: Copy> Register<T> {
    /// The register at `address`.
    ///
    /// # Safety
    /// For as long as the value lives, `address` must be that of a register (or of a variable of a test) of type `T`
    /// which may be read and written at any time.
    #[must_use]
    pub const unsafe fn at(address: usize) -> Self {
        Self(core::ptr::with_exposed_provenance_mut(address))
    }

    /// Reads it.
    #[must_use]
    pub fn read(self) -> T {
        // SAFETY: `at` demands an address that may be read.
        unsafe { self.0.read_volatile() }
    }

    /// Writes it.
    pub fn write(self, value: T) {
        // SAFETY: `at` demands an address that may be written.
        unsafe { self.0.write_volatile(value) }
    }
}

/// Memory that stands for a block of registers in the tests of drivers.
#[cfg(test)]
pub(crate) struct Bank(*mut [u32; 16]);

#[cfg(test)]
impl Bank {
    pub(crate) fn new() -> Self {
        Self(Box::into_raw(Box::new([0; 16])))
    }

    pub(crate) fn base(&self) -> usize {
        self.0.expose_provenance()
    }

    pub(crate) fn register(&self, offset: usize) -> Register<u32> {
        // SAFETY: the box lives until the bank is dropped, and tests ask for offsets inside it.
        unsafe { Register::at(self.base() + offset) }
    }
}

#[cfg(test)]
impl Drop for Bank {
    fn drop(&mut self) {
        // SAFETY: the pointer came out of a box in `new` and is given back once.
        drop(unsafe { Box::from_raw(self.0) });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_register_reads_what_was_written_to_its_address_and_to_no_other() {
        let bank = Bank::new();
        bank.register(4).write(7);
        assert_eq!([bank.register(0).read(), bank.register(4).read(), bank.register(8).read()], [0, 7, 0]);
    }
}
