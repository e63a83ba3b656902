//! An estimate of Cortex-M7 cycles per minor frame, from executed basic blocks.
//!
//! QEMU executes the image and counts blocks (plugin `qemu-blocks`), exactly; this module puts cycles to the blocks.
//! Two figures are made for each: by LLVM's scheduling model ([`mca`]) and by published measurements of a real core
//! ([`published`]), and the larger is taken. `doc/cycles.md` has the method, its assumptions, and what it gives on
//! kernels whose cycle counts are public. It is an estimate, not a measurement: a board with a cycle counter has the
//! last word.
//!
//! ```no_run
//! # use fsw_host::cycles::{CycleError, estimate};
//! # use std::path::Path;
//! let report = estimate(Path::new("flight.elf"), |plugin| {
//!     // Start QEMU with the arguments `-plugin` and `plugin`, and let the image run to its end.
//!     Ok::<(), CycleError>(())
//! })?;
//! println!("{}", report.text(20));
//! # Ok::<(), CycleError>(())
//! ```

mod blocks;
pub mod counts;
pub mod listing;
pub mod mca;
pub mod published;
pub mod registers;
pub mod report;
pub mod tools;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

use thiserror::Error;

pub use report::{ASSUMPTIONS, CycleReport, FrameCost, FunctionCost};

/// The functions of the flight core's meter by which frames are found in an image.
const METER: &str = "probe::FrameMeter";

/// Why there is no estimate.
#[derive(Debug, Error)]
pub enum CycleError {
    /// A program that is not installed.
    #[error("{program} is not installed: apt-get install --no-install-recommends {package}")]
    MissingProgram {
        /// The program.
        program: &'static str,
        /// Debian's package that has it.
        package: &'static str,
    },
    /// The plugin has not been built.
    #[error(
        "the block-counting plugin is not there and could not be built: cargo build --release --package qemu-blocks"
    )]
    MissingPlugin,
    /// A QEMU built without plugins.
    #[error("{0} cannot load plugins: install Debian's package qemu-system-arm, which can")]
    NoPlugins(&'static str),
    /// A program failed.
    #[error("{program} failed: {reason}")]
    Tool {
        /// The program.
        program: &'static str,
        /// Its own words.
        reason: String,
    },
    /// An image without a meter, or without symbols.
    #[error("{} has no function FrameMeter::{name}: frames cannot be told apart in it", image.display())]
    NoMarker {
        /// The image.
        image: PathBuf,
        /// The function.
        name: &'static str,
    },
    /// A listing that cannot be read.
    #[error("the disassembler does not know an instruction: {0}")]
    Listing(String),
    /// A counts file that cannot be read.
    #[error("QEMU left no block counts at {}: {source}", path.display())]
    NoCounts {
        /// Where it should have been.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A counts file with wrong content.
    #[error("the file of block counts is not one: {0}")]
    Counts(&'static str),
}

/// Estimates what the frames of a run cost. `run` starts QEMU with `-plugin` and the value it is given, and returns
/// when QEMU has ended.
pub fn estimate<E: From<CycleError>>(image: &Path, run: impl FnOnce(&str) -> Result<(), E>) -> Result<CycleReport, E> {
    let estimator = Estimator::new(image)?;
    let counts = TemporaryFile::new();
    run(&estimator.plugin_argument(&tools::plugin()?, &counts.0))?;
    Ok(estimator.report(&counts.0)?)
}

/// The estimate in its steps, for several runs of one image.
#[derive(Debug)]
pub struct Estimator {
    listing: listing::Listing,
    markers: Markers,
}

/// Addresses of the functions at which the plugin acts.
#[derive(Clone, Copy, Debug)]
struct Markers {
    begin: u32,
    end: u32,
    close: u32,
}

impl Estimator {
    /// Disassembles the image and finds its markers.
    pub fn new(image: &Path) -> Result<Self, CycleError> {
        let listing = listing::Listing::parse(&tools::disassemble(image)?)?;
        let marker = |name: &'static str| {
            let address = listing.address_of_method(METER, name);
            address.ok_or_else(|| CycleError::NoMarker { image: image.to_owned(), name })
        };
        let markers = Markers { begin: marker("resume")?, end: marker("pause")?, close: marker("frame_done")? };
        Ok(Self { listing, markers })
    }

    /// The value for QEMU's option `-plugin`.
    pub fn plugin_argument(&self, plugin: &Path, counts: &Path) -> String {
        // QEMU separates arguments by commas and reads two as one that belongs to the text.
        let escape = |path: &Path| path.display().to_string().replace(',', ",,");
        let Markers { begin, end, close } = self.markers;
        format!("{},out={},begin={begin:#x},end={end:#x},close={close:#x}", escape(plugin), escape(counts))
    }

    /// Reads the counts of a run and puts cycles to them.
    pub fn report(&self, counts: &Path) -> Result<CycleReport, CycleError> {
        self.report_after(counts, 0)
    }

    /// The same without the first frames: before a flight, loading and arming go into the first.
    pub fn report_after(&self, counts: &Path, frames: usize) -> Result<CycleReport, CycleError> {
        let bytes = std::fs::read(counts).map_err(|source| CycleError::NoCounts { path: counts.to_owned(), source })?;
        let mut counts = counts::BlockCounts::parse(bytes)?;
        counts.skip_frames(frames);
        Ok(CycleReport::new(&counts, &blocks::costs(&self.listing, counts.blocks())?))
    }
}

/// A path of our own in the system's folder for temporary files, empty again when this goes away.
struct TemporaryFile(PathBuf);

impl TemporaryFile {
    fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("aeroshell-blocks-{}-{number}.bin", std::process::id())))
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_in_paths_are_doubled_for_qemu() {
        let listing = listing::Listing::parse(listing::tests::LISTING).unwrap();
        let estimator = Estimator { listing, markers: Markers { begin: 0x41c, end: 0x420, close: 0x424 } };
        let argument = estimator.plugin_argument(Path::new("a,b.so"), Path::new("c.bin"));
        assert_eq!(argument, "a,,b.so,out=c.bin,begin=0x41c,end=0x420,close=0x424");
    }

    #[test]
    fn a_run_that_leaves_no_counts_is_an_error_that_says_where_they_should_be() {
        let listing = listing::Listing::parse(listing::tests::LISTING).unwrap();
        let estimator = Estimator { listing, markers: Markers { begin: 0, end: 0, close: 0 } };
        let error = estimator.report(Path::new("no-such-folder/counts.bin")).unwrap_err().to_string();
        assert!(error.contains("no-such-folder/counts.bin"), "{error}");
    }
}
