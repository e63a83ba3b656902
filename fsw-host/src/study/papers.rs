//! What the studies of navigation filters have in common: options, the TOML file, the folder, threads, and how they end.

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use fsw_study::settings::Stored;
use serde::Serialize;

use crate::campaign::arguments::threads;
use crate::error::HostError;
use crate::output::{json_text, print};
use crate::report::PlotError;
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
    #[arg(long, value_name = "J", value_parser = threads, allow_negative_numbers = true)]
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
    fn runs(&self, default: u64) -> Result<u64, HostError> {
        match self.runs.unwrap_or(default) {
            runs @ 1..=MAX_RUNS => Ok(runs),
            runs => Err(HostError::Option(format!("--runs {runs} is out of range: 1 to {MAX_RUNS}"))),
        }
    }

    fn config(&self) -> Option<&Path> {
        self.config.as_deref().or(self.config_option.as_deref())
    }

    /// The configuration, of which the file may leave out anything; and the number of runs, or `default_runs`.
    ///
    /// # Errors
    /// The file cannot be read, is none, or is refused; the number is out of range.
    pub fn begin<C: Stored>(&self, default_runs: u64) -> Result<(C, u64), HostError> {
        let config = self.config().map_or_else(|| Ok(C::default()), read)?;
        Ok((config, self.runs(default_runs)?))
    }

    /// The folder, with the configuration in it.
    ///
    /// # Errors
    /// As of [`Self::folder`], or the file cannot be written.
    pub fn open(&self, name: &str, runs: u64, config: &impl Stored) -> Result<PathBuf, HostError> {
        let folder = self.folder(name, runs)?;
        write(config, &folder.join(CONFIG))?;
        Ok(folder)
    }

    /// What every study's figures begin with.
    #[must_use]
    pub fn head(&self, study: &'static str, paper: &'static str, runs: u64) -> Head {
        Head { study, paper, command: self.command_with_numbers(study, runs), seed: self.seed, runs }
    }

    /// Leaves page and figures in the folder, and prints what was asked for: the figures, `screen`, or nothing.
    ///
    /// # Errors
    /// A plot cannot be drawn, or a file cannot be written.
    pub fn leave(
        &self,
        folder: &Path,
        study: &impl Serialize,
        page: Result<String, PlotError>,
        screen: impl FnOnce() -> String,
    ) -> Result<(), HostError> {
        let page = page.map_err(|e| HostError::Option(e.to_string()))?;
        write_whole(&folder.join(PAGE), |out| out.write_all(page.as_bytes()))?;
        let path = folder.join(JSON);
        let json = json_text(study).map_err(HostError::file("write", &path))?;
        write_whole(&path, |out| out.write_all(json.as_bytes()))?;
        if self.json {
            print(&json)
        } else if self.quiet {
            Ok(())
        } else {
            print(&screen())
        }
    }

    /// The command that repeats the study, without its numbers.
    #[must_use]
    pub fn command(&self, name: &str) -> String {
        let config = self.config().map(|path| format!(" {}", path.display())).unwrap_or_default();
        format!("aeroshell study {name}{config}")
    }

    /// The same with them.
    fn command_with_numbers(&self, name: &str, runs: u64) -> String {
        format!("{} --runs {runs} --seed {}", self.command(name), self.seed)
    }

    /// The folder, made if it is not there.
    ///
    /// # Errors
    /// It is a file, holds something that is of no study, or cannot be made.
    fn folder(&self, name: &str, runs: u64) -> Result<PathBuf, HostError> {
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

/// What every study's figures begin with.
#[derive(Serialize)]
pub struct Head {
    study: &'static str,
    paper: &'static str,
    /// Repeats it.
    pub command: String,
    /// Of all noises.
    pub seed: u64,
    /// Of every case.
    pub runs: u64,
}

/// Settings from a TOML file.
///
/// # Errors
/// It cannot be read, or is refused: one sentence with the place of what is wrong.
pub fn read<T: Stored>(path: &Path) -> Result<T, HostError> {
    let text = fs::read_to_string(path).map_err(HostError::file("read", path))?;
    T::from_toml(&text).map_err(|what| HostError::Option(format!("{}: {what}", path.display())))
}

/// Writes settings as TOML.
///
/// # Errors
/// The file cannot be written.
pub fn write(settings: &impl Stored, path: &Path) -> Result<(), HostError> {
    let text = settings.to_toml().map_err(HostError::Option)?;
    write_whole(path, |out| out.write_all(text.as_bytes()))
}
