//! Test image: its stack grows until it meets its guard.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    firmware::doomed::fly(|| {
        core::hint::black_box(dig(0));
    })
}

/// Every call takes another kilobyte.
#[cfg(target_os = "none")]
#[allow(unconditional_recursion)] // on purpose
fn dig(depth: u32) -> u32 {
    let ballast = core::hint::black_box([depth; 256]);
    dig(depth + 1) + ballast[depth as usize % ballast.len()]
}

#[cfg(not(target_os = "none"))]
fn main() {}
