//! [`Computer`]: the flight computer of this board, from boot on. What every image runs.

use embedded_io::{Read, Write};
use fsw_core::executive::{Board as FlightBoard, BoardError, Dormant, FlightComputer, Room};
use fsw_core::link::discretes::Discretes;
use fsw_core::link::packet::{Mode, RestartReason};
use fsw_core::probe::{FrameMeter, Meter};
use static_cell::ConstStaticCell;

use crate::blackbox::{self, Record};
use crate::board::{Board, Peripherals};
use crate::boards::Present;
use crate::failure;
use crate::stack::{self, HighWater};

type Line = <Present as Board>::Line;
type Watchdog = <Present as Board>::Watchdog;
type Clock = <Present as Board>::Clock;
type Link = <Present as Board>::Link;
/// The cost meter of this board.
pub type BoardMeter = FrameMeter<<Present as Board>::Counter>;

/// Identity of this build as it says hello: that of the package's version.
const BUILD_ID: u64 = fsw_core::link::handshake::build_id(env!("CARGO_PKG_VERSION"));

/// The flight software; large, hence never on the stack.
static CORE: ConstStaticCell<Dormant> = ConstStaticCell::new(Dormant::new());
/// Room for its exchanges.
static ROOM: ConstStaticCell<Room> = ConstStaticCell::new(Room::new());

/// The flight software on its hardware.
pub struct Computer<S, M = BoardMeter> {
    board: FlightBoard<'static, S, Line, Line, Watchdog>,
    meter: M,
    clock: Clock,
    stack: HighWater,
    record: Record,
    mode: Mode,
    trouble: Option<BoardError>,
}

impl<S: Read + Write, M: Meter> Computer<S, M> {
    /// Boots: stack painted, black box read, peripherals started, flight software in `Standby`, and the reason of a
    /// restart told. `stream` makes the link's byte stream of the board's link, watchdog and clock; `meter` may put
    /// something before the board's cost meter.
    pub fn boot(stream: impl FnOnce(Link, Watchdog, Clock) -> S, meter: impl FnOnce(BoardMeter) -> M) -> Self {
        let stack = stack::paint();
        let record = blackbox::take();
        let Peripherals { link, arm, fire, watchdog, counter, clock } = Present::start();
        defmt::info!("flight software {=str} on {=str}", env!("CARGO_PKG_VERSION"), Present::NAME);
        // Without its core and its lines the computer is of no use.
        let (Some(core), Some(room), Ok(lines)) =
            (CORE.try_take(), ROOM.try_take(), Discretes::new(arm, fire, watchdog))
        else {
            failure::restart(RestartReason::Panic, 0)
        };
        let board = FlightBoard::new(stream(link, watchdog, clock), lines, core.wake(BUILD_ID), room);
        let (meter, mode) = (meter(FrameMeter::new(counter)), Mode::Standby);
        let mut computer = Self { board, meter, clock, stack, record, mode, trouble: None };
        if let Some(report) = record.failure {
            defmt::error!("restart {=u32} since power-on, because of {}", record.restarts, report);
            let told = computer.board.announce(report);
            computer.log_trouble(told);
        }
        computer
    }

    /// What the black box held at boot.
    pub const fn record(&self) -> Record {
        self.record
    }

    /// The flight software.
    pub const fn core(&mut self) -> &mut FlightComputer {
        self.board.computer_mut()
    }

    /// The byte stream of the link.
    pub const fn stream(&mut self) -> &mut S {
        self.board.stream_mut()
    }

    /// One turn of the board loop: waits for bytes and does all that follows, then looks after stack and log.
    ///
    /// # Errors
    /// Those of stream and lines, already logged; the loop goes on.
    pub fn step(&mut self) -> Result<(), BoardError> {
        let outcome = self.board.step(&mut self.meter, &mut self.clock);
        self.meter.note_stack(self.stack.look());
        let executive = self.board.computer_mut().executive();
        failure::note_frame(executive.frame());
        let mode = executive.mode();
        if mode != self.mode {
            defmt::info!("{} after {}", mode, self.mode);
            self.mode = mode;
        }
        self.log_trouble(outcome);
        outcome
    }

    /// A trouble is logged when it begins, not as long as it lasts.
    fn log_trouble(&mut self, outcome: Result<(), BoardError>) {
        let trouble = outcome.err();
        if let Some(error) = trouble.filter(|_| trouble != self.trouble) {
            defmt::warn!("{}", error);
        }
        self.trouble = trouble;
    }
}
