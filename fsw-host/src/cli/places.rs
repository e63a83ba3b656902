//! Where flight computer and truth run, as the command line names it.

use std::fmt;
use std::str::FromStr;

use crate::target::Target;

/// Where the flight computer runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ComputerPlace {
    /// In this process.
    #[default]
    InProcess,
    /// On an emulated processor.
    Qemu(Target),
    /// On a board behind a serial line, `DEVICE:BAUD`.
    Serial(String),
}

impl FromStr for ComputerPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let bad = || "expected in-process, qemu:m7, qemu:rv64 or serial:DEVICE:BAUD".to_owned();
        match text.split_once(':') {
            None if text == "in-process" => Ok(Self::InProcess),
            Some(("qemu", target)) => target.parse().map(Self::Qemu).map_err(|_| bad()),
            Some(("serial", line)) if is_device_and_baud(line) => Ok(Self::Serial(line.to_owned())),
            _ => Err(bad()),
        }
    }
}

impl fmt::Display for ComputerPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InProcess => f.write_str("in-process"),
            Self::Qemu(target) => write!(f, "qemu:{target}"),
            Self::Serial(line) => write!(f, "serial:{line}"),
        }
    }
}

pub(crate) fn is_device_and_baud(line: &str) -> bool {
    line.rsplit_once(':').is_some_and(|(device, baud)| !device.is_empty() && baud.parse::<u32>().is_ok_and(|b| b > 0))
}

/// Where the truth simulator runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum TruthPlace {
    /// In this process.
    #[default]
    InProcess,
    /// A `hil-sim --listen` at `HOST:PORT`.
    Tcp(String),
    /// A `hil-sim` process started for this flight, over a pseudo-terminal.
    Pty,
}

impl FromStr for TruthPlace {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.split_once(':') {
            None if text == "in-process" => Ok(Self::InProcess),
            None if text == "pty" => Ok(Self::Pty),
            Some(("tcp", address)) if is_host_and_port(address) => Ok(Self::Tcp(address.to_owned())),
            _ => Err("expected in-process, tcp:HOST:PORT or pty".to_owned()),
        }
    }
}

fn is_host_and_port(address: &str) -> bool {
    address.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok_and(|p| p > 0))
}
