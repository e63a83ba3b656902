//! The developers' commands: `cargo xtask test` runs every gate, and is all that CI runs.

mod budgets;
mod debian;
mod flights;
mod gates;
mod image;
mod navigation;
mod on_target;
mod study_cost;
mod symbols;

use anyhow::Result;
use clap::{Parser, Subcommand};
use xshell::Shell;

/// Developer commands of the workspace.
#[derive(Parser)]
#[command(name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run every quality gate, as CI does.
    Test {
        /// Run only the gates whose name contains this text.
        #[arg(long)]
        only: Option<String>,
    },
    /// Hammer the link decoder with mutated frames.
    Fuzz {
        /// Mutated frames to send.
        #[arg(long, default_value_t = 20_000_000)]
        frames: u64,
        /// Seed of the mutations.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Measure the firmware and hold it against `firmware/budgets.toml`.
    Budgets {
        /// Only this part.
        #[arg(long)]
        only: Option<budgets::Part>,
        /// Record what was measured instead of comparing with it; the limits stay.
        #[arg(long)]
        bless: bool,
    },
    /// Measure what every navigation mode costs and hold it against `firmware/navigation-cost.toml`.
    Navigation {
        /// Whole flights.
        #[arg(long)]
        long: bool,
        /// Record what was measured instead of comparing with it.
        #[arg(long)]
        bless: bool,
    },
    /// Count what a step of every filter of the studies costs on the Cortex-M7, and compare it with what is recorded.
    StudyCost {
        /// Record what was counted instead of comparing with it.
        #[arg(long)]
        bless: bool,
    },
    /// Show what an image holds, what it must not, and its deepest stack.
    Inspect {
        /// The linked image.
        image: std::path::PathBuf,
        /// What the compiler said with `-C remark=prologepilog`; without it frame sizes come from the instructions.
        #[arg(long)]
        notes: Option<std::path::PathBuf>,
    },
    /// Rewrite the golden files after an intended change of results.
    Bless,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let shell = Shell::new()?;
    shell.change_dir(workspace_root());
    match arguments.command {
        Command::Test { only } => gates::run(&shell, only.as_deref()),
        Command::Fuzz { frames, seed } => gates::fuzz(&shell, frames, seed),
        Command::Budgets { only, bless } => budgets::run(&shell, only, bless),
        Command::Navigation { long, bless } => navigation::run(&shell, long, bless),
        Command::StudyCost { bless } => study_cost::run(&shell, bless),
        Command::Inspect { image, notes } => image::report::show(&shell, &image, notes.as_deref()),
        Command::Bless => gates::bless(&shell),
    }
}

fn workspace_root() -> std::path::PathBuf {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    here.parent().unwrap_or(here).to_path_buf()
}
