//! Test image: meets an instruction that the processor does not know.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    firmware::doomed::fly(firmware::trap::unknown_instruction)
}

#[cfg(not(target_os = "none"))]
fn main() {}
