//! Looks into the compiled core for what must not be there.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use xshell::{Shell, cmd};

/// Fails when the core's bare-metal library calls software floating point or an allocator.
pub fn check_core(shell: &Shell, target: &str) -> Result<()> {
    let library = library(shell, target)?;
    let nm = llvm_tool(shell, "llvm-nm")?;
    let undefined =
        cmd!(shell, "{nm} --undefined-only --just-symbol-name --quiet {library}").quiet().ignore_stderr().read()?;
    let forbidden: Vec<&str> = undefined.lines().filter(|symbol| is_forbidden(symbol)).collect();
    if !forbidden.is_empty() {
        bail!("{target}: the core calls {}", forbidden.join(", "));
    }
    Ok(())
}

/// Double-precision software routines (`__aeabi_dadd`, `__adddf3`, …) and the allocator.
fn is_forbidden(symbol: &str) -> bool {
    symbol.starts_with("__aeabi_d") && symbol != "__aeabi_d2ulz" && symbol != "__aeabi_d2lz"
        || (symbol.starts_with("__") && symbol.ends_with("df3"))
        || symbol.contains("__rust_alloc")
}

fn library(shell: &Shell, target: &str) -> Result<PathBuf> {
    Ok(target_directory(shell)?.join(target).join("release").join("libfsw_core.rlib"))
}

/// Where cargo builds.
pub fn target_directory(shell: &Shell) -> Result<PathBuf> {
    let folder = cmd!(shell, "cargo metadata --no-deps --format-version 1").quiet().read()?;
    let marker = "\"target_directory\":\"";
    let start = folder.find(marker).context("cargo metadata names no target directory")? + marker.len();
    let end = folder[start..].find('"').context("cargo metadata is cut")? + start;
    Ok(PathBuf::from(&folder[start..end]))
}

/// A tool of the toolchain's `llvm-tools` component.
pub fn llvm_tool(shell: &Shell, tool: &str) -> Result<PathBuf> {
    let root = cmd!(shell, "rustc --print sysroot").quiet().read()?;
    let host = cmd!(shell, "rustc --print host-tuple").quiet().read()?;
    let path = PathBuf::from(root).join("lib/rustlib").join(host).join("bin").join(tool);
    if !path.exists() {
        bail!("{} is missing: rustup component add llvm-tools", path.display());
    }
    Ok(path)
}
