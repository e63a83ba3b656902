//! The two ends of the link inside this process.

use fsw_core::executive::FlightComputer;

use crate::pump::ComputerEnd;

/// Identity of this build as it says hello: the version of the package, FNV-1a.
pub const BUILD_ID: u64 = {
    let (text, mut hash, mut at) = (env!("CARGO_PKG_VERSION").as_bytes(), 0xcbf2_9ce4_8422_2325u64, 0);
    while at < text.len() {
        hash = (hash ^ text[at] as u64).wrapping_mul(0x0000_0100_0000_01b3);
        at += 1;
    }
    hash
};

/// A fresh flight computer in this process.
pub struct LocalComputer(Box<FlightComputer>);

impl Default for LocalComputer {
    fn default() -> Self {
        Self(Box::new(FlightComputer::new(BUILD_ID)))
    }
}

impl ComputerEnd for LocalComputer {
    fn exchange(&mut self, to_computer: &[u8], from_computer: &mut Vec<u8>) {
        self.0.receive(to_computer, |bytes| from_computer.extend_from_slice(bytes));
    }
}
