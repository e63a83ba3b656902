//! `aeroshell`: the command line of the host harness. Exit code 0 is success, 1 a run that failed, 2 bad input.

use std::process::ExitCode;

use clap::Parser;
use fsw_host::cli::{Cli, Command};
use fsw_host::error::HostError;
use fsw_host::{campaign, fly, footprint, propagate, rank, replay, scenarios, study, sweep, tables, wcet};

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match cli.command {
        None => fly::run(&cli.fly),
        Some(Command::Fly(args)) => fly::run(&args),
        Some(Command::Campaign(args)) => campaign::run(&args),
        Some(Command::Compare(args)) => campaign::compare::run(&args),
        Some(Command::Study(command)) => study::run(&command),
        Some(Command::Sweep(args)) => sweep::run(&args),
        Some(Command::Footprint(args)) => footprint::run(&args),
        Some(Command::Propagate(args)) => propagate::run(&args),
        Some(Command::Rank(args)) => rank::run(&args),
        Some(Command::Replay(args)) => replay::run(&args),
        Some(Command::GuidanceTables(args)) => tables::run(&args),
        Some(Command::Wcet(args)) => wcet::run(&args),
        Some(Command::Scenario(command)) => scenarios::run(&command),
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => refuse(&error),
    }
}

fn refuse(error: &HostError) -> ExitCode {
    eprintln!("aeroshell: {error}");
    ExitCode::from(2)
}
