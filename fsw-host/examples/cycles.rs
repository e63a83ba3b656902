//! Estimated Cortex-M7 cycles of an image that runs by itself and ends QEMU by semihosting, frame by frame:
//!
//! ```text
//! cargo run --release --package fsw-host --example cycles -- IMAGE
//! ```

use std::path::Path;
use std::process::{Command, ExitCode};

use fsw_host::cycles::{CycleError, CycleReport, estimate, tools};

/// Rows of the tables of functions.
const ROWS: usize = 20;
const QEMU: &str = "qemu-system-arm";

fn main() -> ExitCode {
    let Some(image) = std::env::args().nth(1) else {
        eprintln!("name the image: cycles IMAGE");
        return ExitCode::from(2);
    };
    match tools::check_qemu(QEMU).and_then(|()| estimate(Path::new(&image), |plugin| run(&image, plugin))) {
        Ok(report) => {
            print(&report);
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

fn run(image: &str, plugin: &str) -> Result<(), CycleError> {
    let wrong = |reason: String| CycleError::Tool { program: QEMU, reason };
    let machine = ["-M", "mps2-an500", "-display", "none", "-monitor", "none", "-serial", "none", "-icount", "shift=0"];
    let mut qemu = Command::new(QEMU);
    qemu.args(machine).args(["-semihosting", "-kernel", image, "-plugin", plugin]);
    let status = qemu.status().map_err(|error| wrong(error.to_string()))?;
    if status.success() { Ok(()) } else { Err(wrong(status.to_string())) }
}

fn print(report: &CycleReport) {
    println!("{}", report.text(ROWS));
    println!("{:>6} {:>12} {:>12} {:>6} {:>12} {:>12}", "frame", "instructions", "cycles", "CPI", "LLVM", "published");
    for (number, cost) in report.frames.iter().enumerate() {
        let (ratio, llvm, published) = (cost.cycles_per_instruction(), cost.llvm_cycles, cost.published_cycles);
        println!("{number:>6} {:>12} {:>12} {ratio:>6.2} {llvm:>12} {published:>12}", cost.instructions, cost.cycles);
    }
}
