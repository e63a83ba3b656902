//! The command line: what can be asked for, and how each option is read.

mod names;
mod places;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use fsw_core::link::parameters::NavigationMode;

use crate::campaign::arguments::{MOST_RUNS, threads, whole};
use crate::rank::RankArgs;
use crate::study::StudyCommand;
use crate::sweep::Range;
use crate::wcet::args::WcetArgs;

pub(crate) use names::navigation_name;
pub use names::{GuidanceName, TriggerName};
pub(crate) use places::is_device_and_baud;
pub use places::{ComputerPlace, TruthPlace};

/// Flies Mars entries with the flight software of this repository. Without a command it flies the scenario `msl`.
#[derive(Debug, Parser)]
#[command(name = "aeroshell", version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; `fly` when nothing is said.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Options of the default command `fly`.
    #[command(flatten)]
    pub fly: FlyArgs,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fly one closed-loop entry over the link and write a run folder.
    Fly(FlyArgs),
    /// Fly many dispersed entries and show what they have in common.
    Campaign(CampaignArgs),
    /// Set finished campaigns side by side.
    Compare(CompareArgs),
    /// Repeat an experiment of the papers and set our figures beside theirs.
    #[command(subcommand)]
    Study(StudyCommand),
    /// Vary one field of a scenario over a range.
    Sweep(SweepArgs),
    /// Show what a vehicle can reach, and the entry corridor.
    Footprint(FootprintArgs),
    /// Propagate one open-loop entry of the truth at a constant bank to CSV.
    Propagate(PropagateArgs),
    /// Ranks the navigation filters: all on the same recorded link logs, each in closed loop, beside the physical limit.
    Rank(RankArgs),
    /// Feed recorded link logs to a fresh flight computer and compare every byte of its output.
    Replay(ReplayArgs),
    /// Measure what the flight software costs, per schedule slot and per algorithm, over a set of hard flights.
    Wcet(WcetArgs),
    /// Make the tables of the guidance modes apollo and segmented-table from the onboard model, as Rust source.
    GuidanceTables(GuidanceTablesArgs),
    /// Show and check scenarios.
    #[command(subcommand)]
    Scenario(ScenarioCommand),
}

/// Options that every command shares.
#[derive(Clone, Debug, Default, Args)]
pub struct Common {
    /// Overrides a field of the scenario, for example `entry.speed_mps=5600`; may be repeated.
    #[arg(long = "set", value_name = "FIELD=VALUE")]
    pub set: Vec<String>,
    /// Prints a machine-readable summary on standard output instead of the screen for people.
    #[arg(long)]
    pub json: bool,
    /// Prints nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// The algorithms by name: fields of the scenario too, and stronger than `--set`.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct Selection {
    /// Navigation algorithm.
    #[arg(long, value_parser = navigation_name(), value_name = "NAME")]
    pub nav: Option<NavigationMode>,
    /// Guidance algorithm.
    #[arg(long, value_enum, value_name = "NAME")]
    pub guidance: Option<GuidanceName>,
    /// Parachute trigger.
    #[arg(long, value_enum, value_name = "NAME")]
    pub trigger: Option<TriggerName>,
}

impl Selection {
    /// Every field to set, those of `--set` first.
    #[must_use]
    pub fn sets(&self, set: &[String]) -> Vec<String> {
        let named = [
            self.nav.map(|n| format!("navigation.filter={}", n.name())),
            self.guidance.map(|g| format!("guidance.mode={}", g.field_value())),
            self.trigger.map(|t| format!("deploy.trigger={}", t.field_value())),
        ];
        set.iter().cloned().chain(named.into_iter().flatten()).collect()
    }

    /// Arguments that tell `fly` the same scenario, quoted for a shell where they need it.
    #[must_use]
    pub fn fly_arguments(&self, scenario: &str, set: &[String]) -> Vec<String> {
        let named = [
            self.nav.map(|n| format!("--nav {}", n.name())),
            self.guidance.map(|g| format!("--guidance {}", g.field_value())),
            self.trigger.map(|t| format!("--trigger {}", t.field_value())),
        ];
        let sets = set.iter().map(|set| format!("--set {}", quoted(set)));
        [quoted(scenario)].into_iter().chain(sets).chain(named.into_iter().flatten()).collect()
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Every how many runs of a campaign are flown again for the split of the miss, when nothing is said.
pub const DEFAULT_SPLIT: u64 = 20;

/// Options of `campaign`.
#[derive(Clone, Debug, Args)]
pub struct CampaignArgs {
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options.
    #[command(flatten)]
    pub common: Common,
    /// Algorithms.
    #[command(flatten)]
    pub selection: Selection,
    /// Number of runs.
    #[arg(long, value_name = "N", value_parser = whole(1, MOST_RUNS), allow_negative_numbers = true)]
    pub runs: Option<u64>,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, value_parser = whole(0, u64::MAX), allow_negative_numbers = true)]
    pub seed: u64,
    /// First run: a shard of a larger campaign.
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = whole(0, MOST_RUNS), allow_negative_numbers = true)]
    pub first: u64,
    /// Threads; as many as there are cores when left out. Results do not depend on it.
    #[arg(long, value_name = "J", value_parser = threads, allow_negative_numbers = true)]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Flies every Nth run again with known density, and with ideal navigation too, for the split of the miss; 0 for none.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_SPLIT, value_parser = whole(0, MOST_RUNS), allow_negative_numbers = true)]
    pub split: u64,
    /// Merges the folders of shards into --out instead of flying.
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with_all = ["runs", "first", "jobs", "split"])]
    pub merge: Vec<PathBuf>,
    /// Campaign folder: new, or one in which the same campaign was begun, which then goes on. Without it
    /// campaigns/SCENARIO-seedS-Nruns.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replaces another campaign in the folder.
    #[arg(long)]
    pub force: bool,
}

/// Most dispersed runs at one value of a sweep, which keeps them all in memory.
pub const MOST_SWEPT: u64 = 100_000;

/// Options of `sweep`.
#[derive(Clone, Debug, Args)]
pub struct SweepArgs {
    /// Field and its values: FIELD=FROM:TO:COUNT.
    #[arg(value_name = "FIELD=FROM:TO:COUNT")]
    pub range: Range,
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options.
    #[command(flatten)]
    pub common: Common,
    /// Algorithms.
    #[command(flatten)]
    pub selection: Selection,
    /// Dispersed runs at each value, beside the undispersed flight.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole(0, MOST_SWEPT), allow_negative_numbers = true)]
    pub runs: u64,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, value_parser = whole(0, u64::MAX), allow_negative_numbers = true)]
    pub seed: u64,
    /// Threads; as many as there are cores when left out.
    #[arg(long, value_name = "J", value_parser = threads, allow_negative_numbers = true)]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Page with the plot.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replaces the page when it exists.
    #[arg(long)]
    pub force: bool,
}

/// Options of `footprint`.
#[derive(Clone, Debug, Args)]
pub struct FootprintArgs {
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options.
    #[command(flatten)]
    pub common: Common,
    /// Page with the plots.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replaces the page when it exists.
    #[arg(long)]
    pub force: bool,
}

/// Options of `compare`.
#[derive(Clone, Debug, Args)]
pub struct CompareArgs {
    /// Campaign folders.
    #[arg(required = true, num_args = 1.., value_name = "DIR")]
    pub campaigns: Vec<PathBuf>,
    /// Page with the overlaid distributions.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replaces the page when it exists.
    #[arg(long)]
    pub force: bool,
    /// Prints the figures as JSON.
    #[arg(long)]
    pub json: bool,
}

/// Options of `fly`.
#[derive(Clone, Debug, Default, Args)]
pub struct FlyArgs {
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options.
    #[command(flatten)]
    pub common: Common,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Index of the run under that seed.
    #[arg(long, default_value_t = 0, allow_negative_numbers = true)]
    pub run: u64,
    /// Turns the dispersions and sensor errors off.
    #[arg(long)]
    pub nominal: bool,
    /// Algorithms.
    #[command(flatten)]
    pub selection: Selection,
    /// Where the truth simulator runs: in-process, tcp:HOST:PORT, or pty (a hil-sim process of its own).
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    pub truth: TruthPlace,
    /// Where the flight computer runs: in-process, qemu:m7, qemu:rv64, or serial:DEVICE:BAUD (a board).
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    pub computer: ComputerPlace,
    /// Image for QEMU to run; without it the workspace's own is built.
    #[arg(long, value_name = "FILE")]
    pub image: Option<PathBuf>,
    /// Shows the board's log on standard error.
    #[arg(long)]
    pub verbose: bool,
    /// Paces the frames at 50 per second of wall time.
    #[arg(long)]
    pub realtime: bool,
    /// Asks for real-time scheduling and locked memory, and flies on without if it may not.
    #[arg(long, requires = "realtime")]
    pub rt: bool,
    /// Run folder; must not exist or be empty. Without it a fresh runs/SCENARIO-seedN is made.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replaces a run folder that is occupied.
    #[arg(long)]
    pub force: bool,
    /// Writes telemetry.csv beside telemetry.parquet.
    #[arg(long)]
    pub csv: bool,
}

/// Options of `propagate`.
#[derive(Clone, Debug, Args)]
pub struct PropagateArgs {
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Shared options.
    #[command(flatten)]
    pub common: Common,
    /// Constant bank, deg, positive to the right.
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    pub bank: f64,
    /// Where to stop: altitude_km=, speed_mps=, time_s= or range_km=.
    #[arg(long, value_name = "QUANTITY=VALUE", default_value = "altitude_km=10")]
    pub until: String,
    /// Spacing of the rows, s.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.1, allow_negative_numbers = true)]
    pub every: f64,
    /// CSV file; standard output when left out.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replaces the file when it exists.
    #[arg(long)]
    pub force: bool,
}

/// Options of `guidance-tables`.
#[derive(Clone, Debug, Args)]
pub struct GuidanceTablesArgs {
    /// Built-in scenario or TOML file.
    #[arg(default_value = "msl")]
    pub scenario: String,
    /// Overrides a field of the scenario; may be repeated.
    #[arg(long = "set", value_name = "FIELD=VALUE")]
    pub set: Vec<String>,
    /// File to write; standard output when left out.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// Options of `replay`.
#[derive(Clone, Debug, Args)]
pub struct ReplayArgs {
    /// Run folder, or a link.bin; several on an emulated processor are replayed in one boot.
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// Where the fresh flight computer runs: in-process, qemu:m7 or qemu:rv64.
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    pub computer: ComputerPlace,
    /// The image `bench` for QEMU to run; without it the workspace's own is built.
    #[arg(long, value_name = "FILE")]
    pub image: Option<PathBuf>,
    /// Prints a machine-readable verdict.
    #[arg(long)]
    pub json: bool,
    /// Prints nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// The commands about scenarios.
#[derive(Clone, Debug, Subcommand)]
pub enum ScenarioCommand {
    /// List the built-in scenarios.
    List,
    /// Print a scenario, resolved, as TOML.
    Show {
        /// Built-in scenario or TOML file.
        name: String,
        /// Overrides a field; may be repeated.
        #[arg(long = "set", value_name = "FIELD=VALUE")]
        set: Vec<String>,
    },
    /// Check a scenario file and say what is wrong with it.
    Check {
        /// TOML file or built-in scenario.
        file: String,
        /// Overrides a field; may be repeated.
        #[arg(long = "set", value_name = "FIELD=VALUE")]
        set: Vec<String>,
    },
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_of_the_command_line_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn no_arguments_fly_the_default_scenario() {
        let cli = Cli::try_parse_from(["aeroshell"]).unwrap();
        assert!(cli.command.is_none());
        assert_eq!((cli.fly.scenario.as_str(), cli.fly.seed), ("msl", 1));
    }

    #[test]
    fn options_without_a_command_are_those_of_fly() {
        let cli = Cli::try_parse_from(["aeroshell", "msl-beacon", "--seed", "7", "--nav", "dead-reckoning"]).unwrap();
        assert!(cli.command.is_none());
        assert_eq!(
            (cli.fly.scenario.as_str(), cli.fly.seed, cli.fly.selection.nav),
            ("msl-beacon", 7, Some(NavigationMode::DeadReckoning))
        );
    }

    #[test]
    fn arguments_for_another_flight_are_quoted_for_a_shell() {
        let selection = Selection { nav: Some(NavigationMode::Ideal), ..Selection::default() };
        let arguments = selection.fly_arguments("my entry.toml", &["a.b=1".into(), "c={d=\"e's\"}".into()]);
        let expected = ["'my entry.toml'", "--set a.b=1", "--set 'c={d=\"e'\\''s\"}'", "--nav ideal"];
        assert_eq!(arguments, expected);
    }

    #[test]
    fn a_computer_is_named_with_its_processor_or_its_line() {
        for good in ["in-process", "qemu:m7", "qemu:rv64", "serial:/dev/ttyUSB0:921600"] {
            assert_eq!(good.parse::<ComputerPlace>().unwrap().to_string(), good);
        }
        for bad in ["qemu", "qemu:m4", "serial:/dev/ttyUSB0", "serial::9600", "serial:/dev/x:0", "serial:a:b", ""] {
            assert!(bad.parse::<ComputerPlace>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_truth_address_needs_a_host_and_a_port() {
        assert_eq!("tcp:localhost:4000".parse(), Ok(TruthPlace::Tcp("localhost:4000".into())));
        for bad in ["tcp:", "tcp:4000", "tcp::4000", "tcp:host:0", "tcp:host:70000", "udp:a:1", ""] {
            assert!(bad.parse::<TruthPlace>().is_err(), "{bad}");
        }
    }
}
