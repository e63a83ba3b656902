//! Programs that the gates need and that Debian packages.

use anyhow::{Result, bail, ensure};
use xshell::{Shell, cmd};

/// Makes sure that a program can be started: installs its Debian package if it is missing and this machine allows it.
pub fn ensure(shell: &Shell, program: &str, package: &str) -> Result<()> {
    if is_installed(program) {
        return Ok(());
    }
    if !is_installed("apt-get") {
        bail!("{program} is missing and there is no apt-get to install it with: install what Debian calls {package}");
    }
    let administrator = if is_root(shell) {
        None
    } else if is_installed("sudo") {
        // Never asks for a password: a gate that waits for one would hang.
        Some(["sudo", "--non-interactive"])
    } else {
        bail!("{program} is missing: install it with apt-get install {package}, as root");
    };
    eprintln!("   {program} is missing: installing {package}");
    let before: Vec<&str> =
        administrator.into_iter().flatten().chain(["env", "DEBIAN_FRONTEND=noninteractive"]).collect();
    let (first, rest) = (before[0], &before[1..]);
    let run =
        |arguments: &[&str]| cmd!(shell, "{first} {rest...} apt-get --quiet --quiet {arguments...}").quiet().run();
    let installed = run(&["update"]).and_then(|()| run(&["install", "--yes", "--no-install-recommends", package]));
    if let Err(error) = installed {
        bail!("{program} is missing and {package} could not be installed: {error}");
    }
    ensure!(is_installed(program), "{package} is installed and still there is no {program}");
    Ok(())
}

fn is_root(shell: &Shell) -> bool {
    cmd!(shell, "id --user").quiet().read().is_ok_and(|id| id == "0")
}

fn is_installed(program: &str) -> bool {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_program_that_is_there_needs_no_package() {
        let shell = Shell::new().unwrap();
        ensure(&shell, "cargo", "no-such-package").unwrap();
        assert!(!is_installed("no-such-program"));
    }
}
