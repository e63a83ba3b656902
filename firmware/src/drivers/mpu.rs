//! Memory protection unit of the Cortex-M7: one region that nothing may touch.

use cortex_m::peripheral::MPU;

const REGION_VALID: u32 = 1 << 4;
const EXECUTE_NEVER: u32 = 1 << 28;
const REGION_ON: u32 = 1;
const UNIT_ON: u32 = 1;
/// All that no region covers stays as the processor's default map has it.
const DEFAULT_MAP: u32 = 1 << 2;

/// Closes the `1 << log2_bytes` bytes from `base`, which must be aligned to their size.
pub fn close(unit: &mut MPU, base: u32, log2_bytes: u32) {
    // SAFETY: the region takes access away and gives none; the code and data in use lie outside by the memory map.
    unsafe {
        unit.rbar.write(base | REGION_VALID);
        // Access permission 0: none, not even privileged.
        unit.rasr.write(EXECUTE_NEVER | (log2_bytes - 1) << 1 | REGION_ON);
        unit.ctrl.write(UNIT_ON | DEFAULT_MAP);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
