//! What can be asked of `study`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::campaign::arguments::threads;
use crate::cli::Common;

/// Runs of a study when nothing is said.
const DEFAULT_RUNS: u64 = 1_000;

/// The papers' experiments.
#[derive(Clone, Debug, Subcommand)]
pub enum StudyCommand {
    /// P4 (Xia et al. 2015): the predictor-corrector against its segmented forms.
    Npc(StudyArgs),
    /// P1 (Fu et al. 2015): the self-calibrating Kalman filter against others under an unknown input.
    Sekf(super::sekf::SekfArgs),
    /// P2 (Deng, Yu 2018): desensitized divided-difference filters of adaptive order against others in unknown air.
    Ddf(super::ddf::DdfArgs),
    /// P3 (Deng et al. 2017): multiple-model filters against density errors, and the Cramér–Rao bound.
    Mmae(super::mmae::MmaeArgs),
}

/// Options of a study.
#[derive(Clone, Debug, Args)]
pub struct StudyArgs {
    /// Dispersed runs of each guidance mode.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_RUNS, allow_negative_numbers = true)]
    pub runs: u64,
    /// Seed of the dispersions.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Built-in scenario or TOML file that the study starts from.
    #[arg(long, value_name = "F", default_value = "msl")]
    pub config: String,
    /// Threads; as many as there are cores when left out. Results do not depend on it.
    #[arg(long, value_name = "J", value_parser = threads, allow_negative_numbers = true)]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Study folder: new, or one in which the same study was begun, which then goes on. Without it
    /// studies/npc-SCENARIO-seedS-Nruns.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replaces another study in the folder.
    #[arg(long)]
    pub force: bool,
    /// Shared options; `--set` is stronger than the conditions of the study.
    #[command(flatten)]
    pub common: Common,
}
