//! Physical memory protection of RISC-V: one locked region that nothing may touch, not even machine mode.

use riscv::register::{pmpaddr0, pmpcfg0};

/// Locked, naturally aligned power of two, no permission.
const CLOSED: usize = 0x80 | 0x18;

/// Closes the `1 << log2_bytes` bytes from `base`, which must be aligned to their size, until the next reset.
pub fn close(base: usize, log2_bytes: u32) {
    // SAFETY: the region takes access away and gives none; the code and data in use lie outside by the memory map.
    unsafe {
        pmpaddr0::write(base >> 2 | ((1 << (log2_bytes - 3)) - 1));
        pmpcfg0::write(CLOSED);
    }
}
