//! QEMU's `virt` with a `riscv64gc` hart in machine mode, no firmware below.
//!
//! The one UART is the link, its auxiliary outputs are the mortar lines (OUT1 arm, OUT2 fire); the log goes out by
//! semihosting; the timer serves as watchdog.

use core::num::NonZeroU64;

use riscv::interrupt::machine::Interrupt;
use riscv::register::{mie, mstatus};

use crate::board::{Board, LINK_BAUD, Peripherals, WATCHDOG_US};
use crate::drivers::clint::{ClintClock, ClintWatchdog};
use crate::drivers::minstret::InstructionCounter;
use crate::drivers::ns16550::{Ns16550, OUT1, OUT2};
use crate::drivers::semihosting_log::SemihostingLog;
use crate::drivers::{Bit, Register, pmp};
use crate::stack::{self, GUARD_BYTES};

const UART: usize = 0x1000_0000;
const UART_CLOCK_HZ: u32 = 3_686_400;
const CLINT: usize = 0x0200_0000;
const CLINT_TICKS_PER_US: NonZeroU64 = NonZeroU64::new(10).unwrap();
/// Test device of the board: a value written to it ends or resets the emulation.
const FINISHER: usize = 0x0010_0000;
const RESET: u32 = 0x7777;

/// The board.
pub struct VirtRv64;

fn uart() -> Ns16550 {
    // SAFETY: the UART of this board.
    unsafe { Ns16550::at(UART) }
}

impl Board for VirtRv64 {
    const NAME: &'static str = "virt (riscv64gc)";
    type Link = Ns16550;
    type Line = Bit<u8>;
    type Watchdog = ClintWatchdog;
    type Counter = InstructionCounter;
    type Clock = ClintClock;
    type Log = SemihostingLog;

    fn start() -> Peripherals<Self> {
        pmp::close(stack::guard_start(), GUARD_BYTES.ilog2());
        let mut link = uart();
        link.start(UART_CLOCK_HZ, LINK_BAUD);
        let ticks = u64::from(WATCHDOG_US) * CLINT_TICKS_PER_US.get();
        // SAFETY: the core-local interruptor of this board.
        let (mut watchdog, clock) =
            unsafe { (ClintWatchdog::at(CLINT, ticks), ClintClock::at(CLINT, CLINT_TICKS_PER_US)) };
        watchdog.feed();
        // SAFETY: the only interrupt is the watchdog's, whose handler never returns: it can tear no access apart.
        unsafe {
            mie::enable(Interrupt::MachineTimer);
            mstatus::set_mie();
        }
        let (arm, fire) = (link.outputs().line(OUT1), link.outputs().line(OUT2));
        Peripherals { link, arm, fire, watchdog, counter: InstructionCounter::default(), clock }
    }

    fn log() -> SemihostingLog {
        SemihostingLog
    }

    fn make_safe() {
        uart().outputs().clear(OUT1 | OUT2);
    }

    fn reset() -> ! {
        // SAFETY: the test device of this board.
        let finisher: Register<u32> = unsafe { Register::at(FINISHER) };
        finisher.write(RESET);
        loop {
            core::hint::spin_loop();
        }
    }
}
