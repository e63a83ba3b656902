//! What `wcet` can be asked for.

use std::fmt;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use fsw_core::link::parameters::NavigationMode;

use super::navigation::Extent;
use crate::cli::{is_device_and_baud, navigation_name};
use crate::error::HostError;
use crate::target::Target;

/// Options of `wcet`.
#[derive(Clone, Debug, Args)]
pub struct WcetArgs {
    /// Where the flight software runs: m7 or rv64 (emulated, instructions), host (instructions by Callgrind, and wall
    /// time), or serial:DEVICE:BAUD (a board, by its own counter).
    #[arg(long, value_name = "WHERE", default_value = "m7")]
    pub target: WcetPlace,
    /// Flies only the first N of the hard flights.
    #[arg(long, value_name = "N")]
    pub flights: Option<NonZeroUsize>,
    /// What the counter of a board counts, and so which budgets its figures are held against; none when left out.
    #[arg(long, value_enum, value_name = "UNIT")]
    pub unit: Option<Unit>,
    /// Image for the emulator to run; without it the workspace's own bench image is built.
    #[arg(long, value_name = "FILE")]
    pub image: Option<PathBuf>,
    /// Measures every navigation algorithm instead, and holds its worst frame against its budget: on ten seconds of two
    /// flights each, or on three whole flights each. For m7 and rv64.
    #[arg(long, value_name = "EXTENT", value_enum, num_args = 0..=1, default_missing_value = "short",
          conflicts_with_all = ["flights", "cycles", "search"])]
    pub navigation: Option<Extent>,
    /// With --navigation: only these algorithms, separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = navigation_name(), requires = "navigation")]
    pub filters: Vec<NavigationMode>,
    /// Estimates cycles too, from executed blocks; for m7.
    #[arg(long)]
    pub cycles: bool,
    /// Searches for a worse frame with this many flights, and writes the worst found as worst-frame.toml to --out.
    #[arg(long, value_name = "N", requires = "out")]
    pub search: Option<usize>,
    /// Seed of the search.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Folder for wcet.txt and wcet.json; files of an earlier run are replaced.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Prints a machine-readable report.
    #[arg(long)]
    pub json: bool,
    /// Prints nothing but errors and broken budgets.
    #[arg(long)]
    pub quiet: bool,
}

impl WcetArgs {
    /// Refuses options that the target knows nothing of.
    ///
    /// # Errors
    /// One sentence with the option and what it is for.
    pub fn check(&self) -> Result<(), HostError> {
        let emulated = matches!(self.target, WcetPlace::Emulated(_));
        let asks = self.image.is_some() || self.cycles || self.search.is_some() || self.navigation.is_some();
        if !emulated && asks {
            let which = "--image, --cycles, --search and --navigation";
            return Err(HostError::Option(format!("{which} are for --target m7 or rv64")));
        }
        if self.unit.is_some() && !matches!(self.target, WcetPlace::Serial(_)) {
            let known = "the unit of the others is known";
            return Err(HostError::Option(format!("--unit is for --target serial:DEVICE:BAUD: {known}")));
        }
        Ok(())
    }
}

/// Where execution cost is measured.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WcetPlace {
    /// In this process.
    Host,
    /// On an emulated processor.
    Emulated(Target),
    /// On a board behind a serial line, `DEVICE:BAUD`.
    Serial(String),
}

impl FromStr for WcetPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.split_once(':') {
            None if text == "host" => Ok(Self::Host),
            Some(("serial", line)) if is_device_and_baud(line) => Ok(Self::Serial(line.to_owned())),
            _ => {
                text.parse().map(Self::Emulated).map_err(|_| "expected host, m7, rv64 or serial:DEVICE:BAUD".to_owned())
            }
        }
    }
}

impl fmt::Display for WcetPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Host => f.write_str("host"),
            Self::Emulated(target) => target.fmt(f),
            Self::Serial(line) => write!(f, "serial:{line}"),
        }
    }
}

/// What the counter of a board counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Unit {
    /// Cycles of its processor: a frame may take 400,000.
    Cycles,
    /// Instructions: the budgets of the schedule apply.
    Instructions,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: WcetArgs,
    }

    fn checked(arguments: &[&str]) -> Result<(), String> {
        let line = [&["wcet"], arguments].concat();
        Line::try_parse_from(line).map_err(|e| e.to_string())?.args.check().map_err(|e| e.to_string())
    }

    #[test]
    fn a_target_is_named_with_its_processor_or_its_line() {
        for good in ["host", "m7", "rv64", "serial:/dev/ttyUSB0:921600"] {
            assert_eq!(good.parse::<WcetPlace>().unwrap().to_string(), good);
        }
        for bad in ["qemu:m7", "serial", "serial:/dev/ttyUSB0", "serial::9600", "host:1", ""] {
            assert!(bad.parse::<WcetPlace>().unwrap_err().ends_with("serial:DEVICE:BAUD"), "{bad}");
        }
    }

    #[test]
    fn options_that_the_target_knows_nothing_of_are_refused_by_name() {
        let board = ["--target", "serial:/dev/ttyUSB0:921600"];
        assert_eq!(checked(&[&board[..], &["--unit", "cycles", "--flights", "2"]].concat()), Ok(()));
        assert_eq!(checked(&["--target", "m7", "--cycles", "--flights", "1"]), Ok(()));
        for bad in [["--image", "a.elf"].as_slice(), &["--cycles"], &["--search", "9", "--out", "x"], &["--navigation"]]
        {
            let refused = checked(&[&board[..], bad].concat()).unwrap_err();
            assert!(refused.contains("are for --target m7 or rv64"), "{refused}");
        }
        assert!(checked(&["--unit", "cycles"]).unwrap_err().starts_with("--unit is for --target serial:"));
        assert!(checked(&["--flights", "0"]).is_err());
    }
}
