//! Test image: guidance really takes longer than its budget, for some frames of a flight.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    use firmware::{BoardMeter, Burning, Computer, Patient};

    let mut computer = Computer::boot(Patient::new, Burning::<BoardMeter>::new);
    loop {
        let _ = computer.step();
    }
}

#[cfg(not(target_os = "none"))]
fn main() {}
