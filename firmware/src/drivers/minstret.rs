//! Counter of retired instructions of RISC-V as the counter of execution cost: exact, one instruction a count.

use fsw_core::probe::Counter;
use riscv::register::minstret;

/// The counter.
#[derive(Default)]
pub struct InstructionCounter {
    began: usize,
}

impl Counter for InstructionCounter {
    fn restart(&mut self) {
        self.began = minstret::read();
    }

    fn read(&mut self) -> u32 {
        minstret::read().wrapping_sub(self.began) as u32
    }
}
