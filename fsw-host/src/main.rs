//! `aeroshell`: the command line of the host harness.

use std::process::ExitCode;

use clap::Parser;
use fsw_host::cli::Cli;

fn main() -> ExitCode {
    let _cli = Cli::parse();
    ExitCode::SUCCESS
}
