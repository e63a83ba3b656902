//! The image that flies.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    let mut computer = firmware::Computer::boot(firmware::Patient::new, core::convert::identity);
    loop {
        // A trouble of link or lines is logged; the flight goes on.
        let _ = computer.step();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
