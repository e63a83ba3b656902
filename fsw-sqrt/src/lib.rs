//! One function: the square root of an `f64`, by the processor's own instruction.
//!
//! `libm::sqrt` is a software routine (91 instructions on a Cortex-M7); the FPU instruction is correctly rounded
//! by IEEE 754, hence gives the same bits everywhere. This crate holds the only `unsafe` code that flies.
//!
//! The stable compiler does not show the features `vfp2` and `d` to `cfg`, so the choice is by architecture and ABI. Built for a
//! processor without double precision (a forgotten `target-cpu=cortex-m7`), the instruction does not assemble: better than
//! silently flying soft-float.
#![no_std]

/// Square root of `x`; NaN for negative `x`, `-0.0` for `-0.0`. Correctly rounded on every target.
#[inline(always)]
#[must_use]
pub fn sqrt(x: f64) -> f64 {
    imp(x)
}

#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
fn imp(x: f64) -> f64 {
    let y: f64;
    // SAFETY: VSQRT.F64 reads one double register and writes another; no memory, no flags, no stack.
    unsafe {
        core::arch::asm!("vsqrt.f64 {y}, {x}", x = in(dreg_low16) x, y = lateout(dreg_low16) y, options(pure, nomem, nostack))
    };
    y
}

#[cfg(target_arch = "riscv64")]
#[inline(always)]
fn imp(x: f64) -> f64 {
    let y: f64;
    // SAFETY: FSQRT.D reads one floating-point register and writes another; no memory, no stack.
    unsafe { core::arch::asm!("fsqrt.d {y}, {x}", x = in(freg) x, y = lateout(freg) y, options(pure, nomem, nostack)) };
    y
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn imp(x: f64) -> f64 {
    use core::arch::x86_64::{_mm_cvtsd_f64, _mm_set_sd, _mm_sqrt_sd};
    // SAFETY: SSE2 is part of the x86-64 baseline.
    unsafe {
        let v = _mm_set_sd(x);
        _mm_cvtsd_f64(_mm_sqrt_sd(v, v))
    }
}

#[cfg(not(any(all(target_arch = "arm", target_abi = "eabihf"), target_arch = "riscv64", target_arch = "x86_64")))]
#[inline(always)]
fn imp(x: f64) -> f64 {
    libm::sqrt(x)
}

#[cfg(test)]
mod tests {
    /// A 64-bit linear congruential generator followed by a xor-shift: enough to visit all exponents.
    fn pattern(state: &mut u64) -> u64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let x = *state;
        (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) ^ (x >> 32)
    }

    #[test]
    fn fpu_root_equals_the_software_root_on_ten_million_patterns() {
        let mut state = 1;
        for _ in 0..10_000_000 {
            let x = f64::from_bits(pattern(&mut state));
            let (a, b) = (super::sqrt(x), libm::sqrt(x));
            assert!(a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()), "sqrt({x:e}): {a:e} against {b:e}");
        }
    }
}
