//! The gates, in the order in which they are cheapest to fail.

use std::time::Instant;

use anyhow::{Result, bail};
use xshell::{Shell, cmd};

use crate::image::{self, TARGETS};
use crate::{budgets, debian, flights, navigation as cost_of_navigation, on_target, study_cost, symbols};

/// Programs beyond the Rust toolchain that the gates start, and the Debian packages that hold them.
const PROGRAMS: [(&str, &str); 3] =
    [("qemu-system-arm", "qemu-system-arm"), ("qemu-system-riscv64", "qemu-system-misc"), ("llvm-mca-19", "llvm-19")];

type Gate = (&'static str, fn(&Shell) -> Result<()>);

const GATES: [Gate; 19] = [
    ("emulators and analysis tools", programs),
    ("format", format),
    ("lints", lints),
    ("documentation without broken links", documentation),
    ("core, debug build with overflow checks", core_debug),
    ("unit and system tests, release build", tests),
    ("examples in the documentation", doc_tests),
    ("core builds without std for both processors", bare_metal),
    ("log formatting feature builds", log_feature),
    ("images build for both processors", on_target::build_images),
    ("budgets, and images without panic, heap, software floating point, recursion or indirect call", budgets),
    ("cost of every navigation mode", navigation),
    ("cost of the filters of the studies on the M7", study_cost),
    ("default flight from the command line", flights::default_flight),
    ("flights against a simulator in a process of its own", flights::separate_processes),
    ("every mode, the same bits", on_target::modes),
    ("images that fail on purpose", on_target::failures),
    ("cost over a board's line", on_target::costs),
    ("flights on both processors", on_target::flights),
];

/// Runs the gates whose name contains `only`; the first failure ends the run.
pub fn run(shell: &Shell, only: Option<&str>) -> Result<()> {
    let start = Instant::now();
    for (name, gate) in GATES {
        if only.is_some_and(|text| !name.contains(text)) {
            continue;
        }
        let gate_start = Instant::now();
        eprintln!("── {name}");
        if let Err(error) = gate(shell) {
            bail!("gate failed: {name}: {error:#}");
        }
        eprintln!("   passed in {:.0} s", gate_start.elapsed().as_secs_f64());
    }
    eprintln!("All gates passed in {:.0} s.", start.elapsed().as_secs_f64());
    Ok(())
}

fn format(shell: &Shell) -> Result<()> {
    Ok(cmd!(shell, "cargo fmt --all --check").quiet().run()?)
}

fn lints(shell: &Shell) -> Result<()> {
    Ok(cmd!(shell, "cargo clippy --quiet --workspace --all-targets --release -- -D warnings").quiet().run()?)
}

fn core_debug(shell: &Shell) -> Result<()> {
    Ok(cmd!(shell, "cargo test --quiet --package fsw-core --lib --tests").quiet().run()?)
}

fn tests(shell: &Shell) -> Result<()> {
    // Some tests start the programs that users start.
    flights::programs(shell)?;
    Ok(cmd!(shell, "cargo test --quiet --workspace --release --lib --bins --tests").quiet().run()?)
}

fn doc_tests(shell: &Shell) -> Result<()> {
    Ok(cmd!(shell, "cargo test --quiet --workspace --release --doc").quiet().run()?)
}

fn bare_metal(shell: &Shell) -> Result<()> {
    for image::Target { triple: target, .. } in TARGETS {
        cmd!(shell, "cargo build --quiet --package fsw-core --release --target {target}").quiet().run()?;
        symbols::check_core(shell, target)?;
    }
    Ok(())
}

fn programs(shell: &Shell) -> Result<()> {
    toolchain(shell)?;
    PROGRAMS.iter().try_for_each(|(program, package)| debian::ensure(shell, program, package))
}

/// A toolchain that was there before this checkout does not fetch by itself what `rust-toolchain.toml` asks for.
fn toolchain(shell: &Shell) -> Result<()> {
    let Ok(installed) = cmd!(shell, "rustup target list --installed").quiet().ignore_stderr().read() else {
        return Ok(()); // not one of rustup's: what is missing, the builds will say
    };
    if TARGETS.iter().all(|target| installed.lines().any(|line| line == target.triple)) {
        return Ok(());
    }
    let targets = TARGETS.map(|target| target.triple);
    cmd!(shell, "rustup --quiet target add {targets...}").quiet().run()?;
    Ok(cmd!(shell, "rustup --quiet component add llvm-tools").quiet().run()?)
}

fn budgets(shell: &Shell) -> Result<()> {
    budgets::run(shell, None, false)
}

fn navigation(shell: &Shell) -> Result<()> {
    cost_of_navigation::run(shell, false, false)
}

fn study_cost(shell: &Shell) -> Result<()> {
    study_cost::run(shell, false)
}

fn log_feature(shell: &Shell) -> Result<()> {
    Ok(cmd!(shell, "cargo check --quiet --release --package fsw-core --features defmt").quiet().run()?)
}

fn documentation(shell: &Shell) -> Result<()> {
    let _flags = shell.push_env("RUSTDOCFLAGS", "-D warnings");
    Ok(cmd!(shell, "cargo doc --quiet --workspace --no-deps --release").quiet().run()?)
}

/// Sends `frames` mutated frames through the decoder; the test itself is part of the core's tests with fewer frames.
pub fn fuzz(shell: &Shell, frames: u64, seed: u64) -> Result<()> {
    let _frames = shell.push_env("AEROSHELL_FUZZ_FRAMES", frames.to_string());
    let _seed = shell.push_env("AEROSHELL_FUZZ_SEED", seed.to_string());
    Ok(cmd!(shell, "cargo test --release --package fsw-core --test link_robustness -- --nocapture").run()?)
}

/// Rewrites the golden files; the diff goes into the commit that explains why results changed.
pub fn bless(shell: &Shell) -> Result<()> {
    let _bless = shell.push_env("AEROSHELL_BLESS", "1");
    Ok(cmd!(shell, "cargo test --release --package system-tests --test change_indicator").run()?)
}
