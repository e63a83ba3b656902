//! The global logger of `defmt` on the board's log channel. It writes and waits, hence is never used inside the
//! measured part of a frame.

use core::cell::UnsafeCell;

use embedded_io::Write;

use crate::board::Board;
use crate::boards::Present;

#[defmt::global_logger]
struct Logger;

struct Encoder(UnsafeCell<defmt::Encoder>);

// SAFETY: one thread logs, and no handler does.
unsafe impl Sync for Encoder {}

static ENCODER: Encoder = Encoder(UnsafeCell::new(defmt::Encoder::new()));

fn encode(run: impl FnOnce(&mut defmt::Encoder)) {
    // SAFETY: one thread logs, and `defmt` calls neither of the functions below from within another.
    run(unsafe { &mut *ENCODER.0.get() });
}

/// A log that cannot be written is lost: there is no one to tell.
fn send(bytes: &[u8]) {
    let _ = Present::log().write(bytes);
}

// SAFETY: nothing to acquire, because one thread logs.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        encode(|encoder| encoder.start_frame(send));
    }

    unsafe fn flush() {
        let _ = Present::log().flush();
    }

    unsafe fn release() {
        encode(|encoder| encoder.end_frame(send));
    }

    unsafe fn write(bytes: &[u8]) {
        encode(|encoder| encoder.write(bytes, send));
    }
}

defmt::timestamp!("frame {=u32}", crate::failure::frame());
