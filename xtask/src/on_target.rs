//! The gates on emulated processors: tests of `fsw-host/tests/on_target`, which a plain `cargo test` passes over.

use anyhow::Result;
use xshell::{Shell, cmd};

use crate::image::{IMAGES, TARGETS};

/// Builds every image that the gates run, once: what asks for one later finds it.
pub fn build_images(shell: &Shell) -> Result<()> {
    let images = IMAGES.iter().flat_map(|image| ["--bin", image]);
    for target in TARGETS {
        let (triple, images) = (target.triple, images.clone());
        cmd!(shell, "cargo build --quiet --package firmware {images...} --profile flight --target {triple}")
            .quiet()
            .run()?;
    }
    Ok(())
}

/// The default flight, whole, on each processor and in process. One at a time: the tests print what each takes.
pub fn flights(shell: &Shell) -> Result<()> {
    tests(shell, "flights::", "1")
}

/// Every algorithm that can be chosen, replayed on each processor in one boot.
pub fn modes(shell: &Shell) -> Result<()> {
    tests(shell, "modes::", "1")
}

/// The images that fail on purpose.
pub fn failures(shell: &Shell) -> Result<()> {
    tests(shell, "failures::", "2")
}

/// What a board reports over its line that its frames cost.
pub fn costs(shell: &Shell) -> Result<()> {
    tests(shell, "costs::", "1")
}

fn tests(shell: &Shell, module: &str, threads: &str) -> Result<()> {
    // The whole workspace, so that what the tests before have built is taken as it is.
    let cargo = ["--quiet", "--workspace", "--release", "--test", "on_target"];
    let which = ["--ignored", "--nocapture", "--test-threads", threads, module];
    Ok(cmd!(shell, "cargo test {cargo...} -- {which...}").quiet().run()?)
}
