//! [`Patient`]: a stream whose reader may wait as long as it takes without the watchdog biting.

use embedded_hal::digital::{OutputPin, PinState};
use embedded_io::{ErrorKind, ErrorType, Read, ReadReady, Write};
use fsw_core::executive::Clock;

/// A read without a byte gives up after so long, microseconds: the board loop looks at its clock then.
pub const READ_TIMEOUT_US: u32 = 1_000;
/// The stream is asked so often between two looks at watchdog and clock, because asking is what a byte waits for.
const POLLS_PER_LOOK: u32 = 64;

/// Why nothing was read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitError<E> {
    /// No byte came in [`READ_TIMEOUT_US`].
    TimedOut,
    /// The stream failed.
    Stream(E),
}

impl<E: embedded_io::Error> core::fmt::Display for WaitError<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TimedOut => f.write_str("no byte came in time"),
            Self::Stream(error) => write!(f, "{error:?}"),
        }
    }
}

impl<E: embedded_io::Error> core::error::Error for WaitError<E> {}

impl<E: embedded_io::Error> embedded_io::Error for WaitError<E> {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::TimedOut => ErrorKind::TimedOut,
            Self::Stream(error) => error.kind(),
        }
    }
}

/// The stream, the watchdog that is fed while it waits, and the clock that ends the wait.
#[derive(Clone, Debug)]
pub struct Patient<S, W, C> {
    stream: S,
    watchdog: W,
    clock: C,
    watchdog_high: bool,
}

impl<S, W: OutputPin, C> Patient<S, W, C> {
    /// A stream that waits.
    pub const fn new(stream: S, watchdog: W, clock: C) -> Self {
        Self { stream, watchdog, clock, watchdog_high: false }
    }

    /// A line that cannot be driven is left to the kick after the frame, which reports it.
    fn feed(&mut self) {
        self.watchdog_high = !self.watchdog_high;
        let _ = self.watchdog.set_state(PinState::from(self.watchdog_high));
    }
}

impl<S: ErrorType, W, C> ErrorType for Patient<S, W, C> {
    type Error = WaitError<S::Error>;
}

impl<S: Read + ReadReady, W: OutputPin, C: Clock> Read for Patient<S, W, C> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        let began_us = self.clock.now_us();
        loop {
            for _ in 0..POLLS_PER_LOOK {
                if self.stream.read_ready().map_err(WaitError::Stream)? {
                    return self.stream.read(buffer).map_err(WaitError::Stream);
                }
            }
            self.feed();
            if self.clock.now_us().wrapping_sub(began_us) >= READ_TIMEOUT_US {
                return Err(WaitError::TimedOut);
            }
        }
    }
}

impl<S: Write, W: OutputPin, C> Write for Patient<S, W, C> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.feed();
        self.stream.write(bytes).map_err(WaitError::Stream)
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        self.stream.flush().map_err(WaitError::Stream)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// A line that brings its byte after a number of polls.
    struct Slow(u32);

    impl ErrorType for Slow {
        type Error = Infallible;
    }

    impl ReadReady for Slow {
        fn read_ready(&mut self) -> Result<bool, Infallible> {
            self.0 = self.0.saturating_sub(1);
            Ok(self.0 == 0)
        }
    }

    impl Read for Slow {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
            buffer[0] = 0x5A;
            Ok(1)
        }
    }

    #[derive(Default)]
    struct Dog {
        high: bool,
        edges: u32,
    }

    impl embedded_hal::digital::ErrorType for Dog {
        type Error = Infallible;
    }

    impl OutputPin for Dog {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.edges += u32::from(self.high);
            self.high = false;
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.edges += u32::from(!self.high);
            self.high = true;
            Ok(())
        }
    }

    /// A clock that goes on by so many microseconds each time it is looked at.
    struct Step {
        now_us: u32,
        by_us: u32,
    }

    impl Clock for Step {
        fn now_us(&mut self) -> u32 {
            self.now_us = self.now_us.wrapping_add(self.by_us);
            self.now_us
        }
    }

    #[test]
    fn a_wait_feeds_the_watchdog_with_edges_until_the_byte_comes() {
        let mut link = Patient::new(Slow(10 * POLLS_PER_LOOK), Dog::default(), Step { now_us: 0, by_us: 1 });
        let mut byte = [0; 1];
        assert_eq!((link.read(&mut byte), byte), (Ok(1), [0x5A]));
        assert_eq!(link.watchdog.edges, 9);
    }

    #[test]
    fn a_wait_ends_by_the_clock_even_when_it_wraps() {
        let clock = Step { now_us: u32::MAX - 500, by_us: 100 };
        let mut link = Patient::new(Slow(u32::MAX), Dog::default(), clock);
        assert_eq!(link.read(&mut [0; 1]), Err(WaitError::TimedOut));
        assert_eq!(embedded_io::Error::kind(&WaitError::<Infallible>::TimedOut), ErrorKind::TimedOut);
        assert_eq!(link.watchdog.edges, READ_TIMEOUT_US / 100);
    }
}
