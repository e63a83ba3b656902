//! Test image: replays recorded uplinks from a file at full speed and writes what comes down the link to another.
//!
//! `Inject(Restart)` separates one flight from the next. The emulator ends with status 0 at the end of the job, with
//! that of [`firmware::job::JobError`] when a file fails, and with 20 when the computer restarted by itself.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
#[firmware::entry]
fn main() -> ! {
    use core::convert::identity;
    use firmware::job::{self, Job};

    let mut computer = firmware::Computer::boot(|_, watchdog, _| Job::open(watchdog), identity);
    if computer.record().failure.is_some() {
        job::exit(job::RESTARTED);
    }
    computer.core().allow_restart();
    while computer.step().is_ok() {
        computer.core().restart_if_asked();
    }
    job::exit(computer.stream().finish().map_or_else(|error| error as u8, |()| job::DONE))
}

#[cfg(not(target_os = "none"))]
fn main() {}
