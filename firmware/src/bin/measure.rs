//! Test image: what flies, and begins again when told to over the link, so that the cost of several flights is measured
//! in one boot.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    let mut computer = firmware::Computer::boot(firmware::Patient::new, core::convert::identity);
    computer.core().allow_restart();
    loop {
        // A trouble of link or lines is logged; the flight goes on.
        let _ = computer.step();
        computer.core().restart_if_asked();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
