//! Arm MPS2+ with AN500: Cortex-M7 with double-precision FPU at 25 MHz, as QEMU's `mps2-an500` has it.
//!
//! UART 0 is the link, UART 1 the log; LED 0 stands for the mortar arm line, LED 1 for the fire line (the GPIO ports
//! are not emulated).

use cortex_m::peripheral::SCB;

use crate::board::{Board, LINK_BAUD, Peripherals, WATCHDOG_US};
use crate::drivers::cmsdk_uart::CmsdkUart;
use crate::drivers::cmsdk_watchdog::CmsdkWatchdog;
use crate::drivers::fpga_counter::FpgaCounter;
use crate::drivers::systick::SysTick;
use crate::drivers::{Bit, Lines, Register, mpu};
use crate::stack::{self, GUARD_BYTES};

const CLOCK_HZ: u32 = 25_000_000;
/// Under `-icount shift=0` an instruction takes a nanosecond of emulated time, hence a SysTick count 40 of them.
const INSTRUCTIONS_PER_COUNT: u32 = 1_000_000_000 / CLOCK_HZ;

const LINK_UART: usize = 0x4000_4000;
const LOG_UART: usize = 0x4000_5000;
const WATCHDOG: usize = 0x4000_8000;
/// FPGA system block; its first register drives the LEDs.
const FPGA: usize = 0x4002_8000;

const ARM_LED: u8 = 1;
const FIRE_LED: u8 = 2;

/// The board.
pub struct Mps2An500;

fn leds() -> Lines<u32> {
    // SAFETY: the LED register of this board.
    Lines::new(unsafe { Register::at(FPGA) })
}

fn uart(base: usize) -> CmsdkUart {
    // SAFETY: only the two UARTs of this board are asked for.
    unsafe { CmsdkUart::at(base) }
}

impl Board for Mps2An500 {
    const NAME: &'static str = "mps2-an500 (Cortex-M7)";
    type Link = CmsdkUart;
    type Line = Bit<u32>;
    type Watchdog = CmsdkWatchdog;
    type Counter = SysTick;
    type Clock = FpgaCounter;
    type Log = CmsdkUart;

    fn start() -> Peripherals<Self> {
        // SAFETY: `start` is called once, and nothing else takes the core's peripherals.
        let mut core = unsafe { cortex_m::Peripherals::steal() };
        mpu::close(&mut core.MPU, stack::guard_start() as u32, GUARD_BYTES.ilog2());
        let (mut link, mut log) = (uart(LINK_UART), uart(LOG_UART));
        link.start(CLOCK_HZ, LINK_BAUD);
        log.start(CLOCK_HZ, LINK_BAUD);
        // SAFETY: the FPGA block and the watchdog of this board.
        let (mut clock, mut watchdog) = unsafe { (FpgaCounter::at(FPGA), CmsdkWatchdog::at(WATCHDOG)) };
        clock.start(CLOCK_HZ);
        watchdog.start(WATCHDOG_US * (CLOCK_HZ / 1_000_000));
        let counter = SysTick::start(core.SYST, INSTRUCTIONS_PER_COUNT);
        let (arm, fire) = (leds().line(ARM_LED), leds().line(FIRE_LED));
        Peripherals { link, arm, fire, watchdog, counter, clock }
    }

    fn log() -> CmsdkUart {
        uart(LOG_UART)
    }

    fn make_safe() {
        leds().clear(FIRE_LED | ARM_LED);
    }

    fn reset() -> ! {
        SCB::sys_reset()
    }
}
