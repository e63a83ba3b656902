//! [`Board`]: all that differs from one flight computer to another. A port to a new board is one implementation of it.

use embedded_hal::digital::OutputPin;
use embedded_io::{Read, ReadReady, Write};
use fsw_core::executive::Clock;
use fsw_core::probe::Counter;

/// Speed of the link, bits per second: what the link budget of the interface document is made for.
pub const LINK_BAUD: u32 = 921_600;
/// Longest time without food before the watchdog bites, microseconds: five minor frames.
pub const WATCHDOG_US: u32 = 100_000;

/// A flight computer.
///
/// Everything else is reached through the types of its peripherals, which are drivers behind `embedded-hal` and
/// `embedded-io`. `make_safe` and `reset` are called from fault handlers, at any time and on a stack of a few hundred
/// bytes: they wait for nothing, log nothing, and rely on nothing that `start` has done. `doc/porting.md` has the road to
/// a new board.
pub trait Board: Sized {
    /// Its name in the log.
    const NAME: &'static str;
    /// Byte stream of the link. It is read once it has said that it is ready, and then gives at least one byte.
    type Link: Read + ReadReady + Write;
    /// A discrete output line.
    type Line: OutputPin;
    /// The watchdog, as a line that is fed by every edge; it is fed from two places.
    type Watchdog: OutputPin + Copy;
    /// Counter of execution cost.
    type Counter: Counter;
    /// Clock of microseconds.
    type Clock: Clock + Copy;
    /// Byte stream of the log.
    type Log: Write;

    /// Closes the stack guard, starts clocks, link, log and watchdog. Called once, at boot.
    fn start() -> Peripherals<Self>;

    /// The log; asked for anew for each piece of a message, hence without state of its own.
    fn log() -> Self::Log;

    /// Drives the mortar lines low.
    fn make_safe();

    /// Begins again as after power-on, with the memory kept.
    fn reset() -> !;
}

/// The peripherals of a [`Board`], started.
pub struct Peripherals<B: Board> {
    /// Byte stream of the link.
    pub link: B::Link,
    /// Mortar arm line.
    pub arm: B::Line,
    /// Mortar fire line.
    pub fire: B::Line,
    /// Watchdog.
    pub watchdog: B::Watchdog,
    /// Counter of execution cost.
    pub counter: B::Counter,
    /// Clock.
    pub clock: B::Clock,
}
