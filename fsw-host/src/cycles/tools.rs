//! The programs that the estimate needs beside QEMU, and one clear sentence for each that is missing.

use std::ffi::OsStr;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde::Deserialize;

use super::CycleError;

/// Debian's package with the disassembler and the pipeline simulator.
pub const LLVM_PACKAGE: &str = "llvm-19";
/// The disassembler, of the simulator's version, so that the one reads what the other writes.
pub const DISASSEMBLER: &str = "llvm-objdump-19";
/// File of the plugin.
const PLUGIN: &str = "libqemu_blocks.so";

/// What a program printed.
pub struct Output {
    /// On standard output.
    pub stdout: String,
    /// On standard error.
    pub stderr: String,
}

/// Runs one of LLVM's programs to its end.
pub fn run<I, S>(program: &'static str, arguments: I, input: Vec<u8>) -> Result<Output, CycleError>
where
    I: IntoIterator<Item = S>,
    S: AsRef<OsStr>,
{
    let wrong = |reason: String| CycleError::Tool { program, reason };
    let mut command = Command::new(program);
    command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => CycleError::MissingProgram { program, package: LLVM_PACKAGE },
        _ => wrong(error.to_string()),
    })?;
    let mut stdin = child.stdin.take();
    // The programs read all input before they print, but may complain before: so feed them from the side.
    let feeder = std::thread::spawn(move || stdin.as_mut().map_or(Ok(()), |stdin| stdin.write_all(&input)));
    let output = child.wait_with_output().map_err(|error| wrong(error.to_string()))?;
    // A program that ended before it read all has said why; its exit status speaks below.
    let _ = feeder.join();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    if !output.status.success() {
        let first = stderr.lines().find(|line| line.contains("error")).unwrap_or("it failed and did not say why");
        return Err(wrong(first.to_owned()));
    }
    Ok(Output { stdout: String::from_utf8_lossy(&output.stdout).into_owned(), stderr })
}

/// The listing of an image.
pub fn disassemble(image: &Path) -> Result<String, CycleError> {
    let flags = ["--disassemble", "--no-show-raw-insn", "--mcpu=cortex-m7"].map(OsStr::new);
    let arguments = flags.into_iter().chain([image.as_os_str()]);
    Ok(run(DISASSEMBLER, arguments, Vec::new())?.stdout)
}

/// The plugin: built from the sources where they are, else what lies beside this program.
pub fn plugin() -> Result<PathBuf, CycleError> {
    match crate::target::image::workspace() {
        Ok(workspace) => build_plugin(&workspace),
        Err(_) => beside_this_program().ok_or(CycleError::MissingPlugin),
    }
}

fn build_plugin(workspace: &Path) -> Result<PathBuf, CycleError> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let build = Command::new(cargo)
        .current_dir(workspace)
        .args(["build", "--release", "--package", "qemu-blocks", "--message-format", "json-render-diagnostics"])
        .stdin(Stdio::null())
        .output();
    let Some(output) = build.ok().filter(|output| output.status.success()) else {
        return beside_this_program().ok_or(CycleError::MissingPlugin);
    };
    library(&output.stdout).ok_or(CycleError::MissingPlugin)
}

/// The library that cargo's messages name.
fn library(messages: &[u8]) -> Option<PathBuf> {
    #[derive(Deserialize)]
    struct Message {
        #[serde(default)]
        filenames: Vec<PathBuf>,
    }
    let messages = messages.split(|byte| *byte == b'\n');
    let mut files = messages.filter_map(|line| serde_json::from_slice::<Message>(line).ok()).flat_map(|m| m.filenames);
    files.rfind(|path| path.file_name() == Some(OsStr::new(PLUGIN)))
}

fn beside_this_program() -> Option<PathBuf> {
    let program = std::env::current_exe().ok()?;
    let folders = program.ancestors().skip(1).take(2);
    folders.map(|folder| folder.join(PLUGIN)).find(|path| path.is_file())
}

/// Makes sure that a QEMU can load plugins at all.
pub fn check_qemu(program: &'static str) -> Result<(), CycleError> {
    let help = Command::new(program).arg("-help").output();
    match help {
        Err(_) => Err(CycleError::MissingProgram { program, package: "qemu-system-arm" }),
        Ok(help) if !String::from_utf8_lossy(&help.stdout).contains("-plugin") => Err(CycleError::NoPlugins(program)),
        Ok(_) => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_program_is_one_sentence_that_names_the_package() {
        let no_arguments: [&OsStr; 0] = [];
        let error = run("llvm-mca-that-is-not-there", no_arguments, Vec::new()).err().unwrap().to_string();
        assert!(error.contains("llvm-mca-that-is-not-there") && error.contains(LLVM_PACKAGE), "{error}");
        let error = check_qemu("qemu-that-is-not-there").unwrap_err().to_string();
        assert!(error.contains("qemu-system-arm"), "{error}");
    }

    #[test]
    fn a_qemu_that_does_not_know_plugins_is_named() {
        let error = check_qemu("true").unwrap_err().to_string();
        assert!(error.contains("plugin"), "{error}");
    }
}
