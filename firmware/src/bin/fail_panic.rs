//! Test image: panics in flight.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    firmware::doomed::fly(|| panic!("on purpose"))
}

#[cfg(not(target_os = "none"))]
fn main() {}
