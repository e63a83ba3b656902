//! Counts what a step of every filter of the studies costs on the Cortex-M7, and prints it: a line for each filter, with
//! its study, its name, the instructions of a step, and the steps that were flown of how many: a filter that stops on its
//! way is counted up to the step that stops it.
//!
//! Run by QEMU's `mps2-an500` under `-icount shift=0`, with semihosting: `cargo xtask study-cost`.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(all(target_os = "none", target_arch = "arm")))]
fn main() {}

#[cfg(all(target_os = "none", target_arch = "arm"))]
mod image {
    use core::ptr::addr_of_mut;

    // What keeps the heap to itself.
    use cortex_m as _;
    use cortex_m_rt::entry;
    use embedded_alloc::LlffHeap;
    use fsw_study::counted::{self, Counted};
    use semihosting::println;

    /// What the filters do not need, and their draws do.
    #[global_allocator]
    static HEAP: LlffHeap = LlffHeap::empty();
    const HEAP_BYTES: usize = 3 << 20;
    static mut ROOM: [u8; HEAP_BYTES] = [0; HEAP_BYTES];

    /// The free-running counter of the board's FPGA, and the register that divides its clock.
    const COUNTER: *mut u32 = 0x4002_8018 as *mut u32;
    const PRESCALE: *mut u32 = 0x4002_801C as *mut u32;
    /// Under `-icount shift=0` an instruction takes a nanosecond of emulated time; the clock has 25 MHz.
    const INSTRUCTIONS_PER_COUNT: u64 = 40;

    #[entry]
    fn main() -> ! {
        // SAFETY: called once, before anything is allocated; nothing else names the room.
        unsafe { HEAP.init(addr_of_mut!(ROOM) as usize, HEAP_BYTES) };
        // SAFETY: a register of this board; counts are not divided.
        unsafe { PRESCALE.write_volatile(0) };
        counted::each(report);
        semihosting::process::exit(0)
    }

    /// Counts since the last reset of the counter, which wraps after 171 s of emulated time: no flight is so long.
    fn now() -> u32 {
        // SAFETY: a register of this board.
        unsafe { COUNTER.read_volatile() }
    }

    /// Whether a flight of so many steps came through, and its instructions.
    fn fly(filter: &Counted<'_>, steps: usize) -> (bool, u64) {
        let mut flown = (false, 0);
        (filter.ready)(steps, &mut |fly| {
            let before = now();
            let came_through = fly();
            flown = (came_through, u64::from(now().wrapping_sub(before)) * INSTRUCTIONS_PER_COUNT);
        });
        flown
    }

    fn report(filter: &Counted<'_>) {
        let (_, nothing) = fly(filter, 0);
        let (steps, instructions) = match fly(filter, filter.steps) {
            (true, instructions) => (filter.steps, instructions),
            (false, instructions) => (filter.longest() + 1, instructions),
        };
        let each = instructions.saturating_sub(nothing).checked_div(steps as u64).unwrap_or(0);
        println!("{}\t{}\t{each}\t{steps}\t{}", filter.study, filter.filter, filter.steps);
    }
}
