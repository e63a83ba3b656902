//! Why a flight computer somewhere else cannot be had; each is one sentence that says what to do.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

/// See the module.
#[derive(Debug, Error)]
pub enum TargetError {
    /// The emulator is not installed.
    #[error("{program} is not installed: `sudo apt-get install {package}` installs it on Debian and Ubuntu")]
    EmulatorMissing {
        /// The program.
        program: &'static str,
        /// The package that has it.
        package: &'static str,
    },
    /// The emulator cannot be started.
    #[error("{program} cannot be started: {source}")]
    EmulatorStart {
        /// The program.
        program: &'static str,
        /// Why.
        source: io::Error,
    },
    /// The sources of the image are not there.
    #[error(
        "the image cannot be built: there is no firmware at {}, where this program was built; give one with --image",
        .0.display()
    )]
    NoSources(PathBuf),
    /// Cargo cannot be started.
    #[error("the image cannot be built: cargo cannot be started ({0}); give an image with --image")]
    NoCargo(io::Error),
    /// The compiler has no library for the target.
    #[error(
        "the image cannot be built: the compiler's target {triple} is not installed: `rustup target add {triple}` \
         installs it"
    )]
    NoCompilerTarget {
        /// The target.
        triple: &'static str,
    },
    /// Instructions of this machine cannot be counted.
    #[error("instructions of this machine are not counted: `sudo apt-get install {0}` installs what that needs")]
    NoCallgrind(&'static str),
    /// The image does not build.
    #[error("the image `{image}` for {triple} cannot be built; cargo says:\n{said}")]
    Build {
        /// Which image.
        image: String,
        /// For what.
        triple: &'static str,
        /// Cargo's own words.
        said: String,
    },
    /// The image cannot be read.
    #[error("the image {} cannot be read: {source}", .path.display())]
    ImageFile {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The image is not one for this processor.
    #[error("the image {} is no program for {target}: {reason}", .path.display())]
    WrongImage {
        /// The file.
        path: PathBuf,
        /// The processor.
        target: &'static str,
        /// What it is instead.
        reason: String,
    },
    /// A port, file or socket that a flight with a target needs.
    #[error("cannot {action}: {source}")]
    System {
        /// What was tried.
        action: String,
        /// Why it failed.
        source: io::Error,
    },
    /// An image was named for a computer that takes none.
    #[error("--image is for --computer qemu:m7 or qemu:rv64: {0} takes no image from here")]
    ImageNotTaken(String),
    /// The user does not want to wait any longer.
    #[error("interrupted")]
    Interrupted,
    /// The bench image did not do its job.
    #[error("the bench on {target} failed: {reason}")]
    Bench {
        /// The processor.
        target: &'static str,
        /// What went wrong.
        reason: String,
    },
}

impl TargetError {
    /// Wraps an error of the system with what was tried.
    pub(crate) fn system(action: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let action = action.into();
        move |source| Self::System { action, source }
    }
}
