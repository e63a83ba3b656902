//! What the images that fail on purpose have in common: the normal board loop, up to a minor frame of the first life.

use core::convert::identity;

use crate::{Computer, Patient};

/// The minor frame after which they fail.
pub const FAILS_AFTER_FRAME: u32 = 100;

/// Flies like the flight image, but calls `fail` once frame [`FAILS_AFTER_FRAME`] has been answered, unless the black
/// box tells that it has failed before: after its restart the computer is a healthy one.
pub fn fly(fail: impl Fn()) -> ! {
    let mut computer = Computer::boot(Patient::new, identity);
    let healthy = computer.record().restarts > 0;
    loop {
        let _ = computer.step();
        if !healthy && computer.core().executive().frame() >= FAILS_AFTER_FRAME {
            fail();
        }
    }
}
