//! What the studies of navigation filters have in common: options, the TOML file, the folder, threads.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use fsw_study::settings;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::HostError;
use crate::runfolder::write_whole;

/// Folder in which study folders are made when none is named.
const STUDIES: &str = "studies";
/// Most runs of a study: what fits into a day.
const MAX_RUNS: u64 = 1_000_000;

/// Figures of a study.
pub const JSON: &str = "study.json";
/// Its page.
pub const PAGE: &str = "study.html";
/// Its configuration in full.
pub const CONFIG: &str = "study.toml";
/// What a search found.
pub const TUNED: &str = "tuned.toml";

/// Options of a study of filters.
#[derive(Clone, Debug, Args)]
pub struct PaperArgs {
    /// TOML file that sets what the paper leaves open; without it the defaults, which `study.toml` in the study's folder shows.
    #[arg(value_name = "CONFIG")]
    pub config: Option<PathBuf>,
    /// The same as CONFIG.
    #[arg(long = "config", value_name = "F", conflicts_with = "config", id = "config_file")]
    pub config_option: Option<PathBuf>,
    /// Runs of every case.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub runs: Option<u64>,
    /// Seed of all noises.
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    pub seed: u64,
    /// Threads; as many as there are cores when left out. Results do not depend on it.
    #[arg(long, value_name = "J", allow_negative_numbers = true)]
    pub jobs: Option<std::num::NonZeroUsize>,
    /// Study folder; without it studies/NAME-seedS-Nruns. Files of a study in it are replaced.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Prints a machine-readable summary on standard output instead of the screen for people.
    #[arg(long)]
    pub json: bool,
    /// Prints nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

impl PaperArgs {
    /// The number of runs, or `default`.
    ///
    /// # Errors
    /// Out of range.
    pub fn runs(&self, default: u64) -> Result<u64, HostError> {
        match self.runs.unwrap_or(default) {
            runs @ 1..=MAX_RUNS => Ok(runs),
            runs => Err(HostError::Option(format!("--runs {runs} is out of range: 1 to {MAX_RUNS}"))),
        }
    }

    fn config(&self) -> Option<&Path> {
        self.config.as_deref().or(self.config_option.as_deref())
    }

    /// The configuration: defaults where it is silent, then checked by `check`, which gives a sentence for what is wrong.
    ///
    /// # Errors
    /// The file cannot be read, is none, or is refused.
    pub fn load<T: DeserializeOwned + Serialize + Default>(
        &self,
        check: impl Fn(&T) -> Result<(), String>,
    ) -> Result<T, HostError> {
        let Some(path) = self.config() else { return Ok(T::default()) };
        let config = named(path, settings::parse_over_defaults(&text(path)?))?;
        named(path, check(&config))?;
        Ok(config)
    }

    /// The command that repeats the study, without its numbers.
    #[must_use]
    pub fn command(&self, name: &str) -> String {
        let config = self.config().map(|path| format!(" {}", path.display())).unwrap_or_default();
        format!("aeroshell study {name}{config}")
    }

    /// The same with them.
    #[must_use]
    pub fn command_with_numbers(&self, name: &str, runs: u64) -> String {
        format!("{} --runs {runs} --seed {}", self.command(name), self.seed)
    }

    /// The folder, made if it is not there.
    ///
    /// # Errors
    /// It is a file, holds something that is of no study, or cannot be made.
    pub fn folder(&self, name: &str, runs: u64) -> Result<PathBuf, HostError> {
        let own = || Path::new(STUDIES).join(format!("{name}-seed{}-{runs}runs", self.seed));
        let path = self.out.clone().unwrap_or_else(own);
        if path.exists() && !path.is_dir() {
            return Err(HostError::NotAFolder(path));
        }
        if path.exists() {
            for entry in fs::read_dir(&path).map_err(HostError::file("read", &path))? {
                let file = entry.map_err(HostError::file("read", &path))?.file_name();
                let file = file.to_string_lossy();
                if ![JSON, PAGE, CONFIG, TUNED].contains(&file.strip_suffix(".part").unwrap_or(&file)) {
                    return Err(HostError::Option(format!(
                        "output folder {} holds {file}, which is of no study: choose another with --out",
                        path.display()
                    )));
                }
            }
        }
        fs::create_dir_all(&path).map_err(HostError::file("create", &path))?;
        Ok(path)
    }

    /// Does `work` on the threads that were asked for.
    ///
    /// # Errors
    /// The threads cannot be made.
    pub fn on_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> Result<R, HostError> {
        let threads = self.jobs.map_or(0, std::num::NonZeroUsize::get);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        Ok(pool.map_err(|e| HostError::Option(format!("cannot make threads: {e}")))?.install(work))
    }
}

/// A TOML file of which no field may be missing.
///
/// # Errors
/// It cannot be read, is not TOML, or has a field that is missing, unknown or of another type: one sentence with its place.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<T, HostError> {
    named(path, settings::parse(&text(path)?))
}

/// Writes settings as TOML.
///
/// # Errors
/// The file cannot be written.
pub fn write<T: Serialize>(settings: &T, path: &Path) -> Result<(), HostError> {
    let text = settings::write(settings).map_err(HostError::Option)?;
    write_whole(path, |out| out.write_all(text.as_bytes()))
}

fn text(path: &Path) -> Result<String, HostError> {
    fs::read_to_string(path).map_err(HostError::file("read", path))
}

/// What is wrong, with the file in which it is.
///
/// # Errors
/// That.
pub fn named<T>(path: &Path, result: Result<T, String>) -> Result<T, HostError> {
    result.map_err(|what| HostError::Option(format!("{}: {what}", path.display())))
}
