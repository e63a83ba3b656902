//! The folder of a study: one campaign folder for each mode, and the files of the study beside them.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use hil_sim::scenario::Scenario;

use super::{JSON, MODES, Mode, PAGE, POINTS, StudyArgs, campaign_of};
use crate::campaign::folder::read_identity;
use crate::campaign::identify;
use crate::error::HostError;

/// Folder in which study folders are made when none is named.
const STUDIES: &str = "studies";

/// The folder to fly in: the one that the user named, or the first free one, or the one where this study was begun.
///
/// # Errors
/// It holds something else, or cannot be made.
pub fn open(args: &StudyArgs, scenarios: &[(Mode, Scenario)]) -> Result<PathBuf, HostError> {
    let path = match &args.out {
        Some(path) => named(path)?,
        None => fresh(args, scenarios)?,
    };
    fs::create_dir_all(&path).map_err(HostError::file("create", &path))?;
    Ok(path)
}

fn named(path: &Path) -> Result<PathBuf, HostError> {
    if path.exists() && !path.is_dir() {
        return Err(HostError::NotAFolder(path.to_owned()));
    }
    if path.exists() {
        let list = || fs::read_dir(path)?.map(|entry| Ok(entry?.file_name())).collect::<io::Result<Vec<_>>>();
        let names = list().map_err(HostError::file("read", path))?;
        if let Some(stranger) = names.iter().find(|name| !is_of_a_study(&name.to_string_lossy())) {
            return Err(HostError::Option(format!(
                "output folder {} holds {}, which is of no study: choose another with --out",
                path.display(),
                stranger.to_string_lossy()
            )));
        }
    }
    Ok(path.to_owned())
}

fn is_of_a_study(name: &str) -> bool {
    let name = name.strip_suffix(".part").unwrap_or(name);
    [JSON, PAGE, POINTS].contains(&name) || MODES.iter().any(|mode| mode.name() == name)
}

/// `NAME`, or `NAME-2`, … when another study is there.
fn fresh(args: &StudyArgs, scenarios: &[(Mode, Scenario)]) -> Result<PathBuf, HostError> {
    let scenario = scenarios.first().map_or("", |(_, scenario)| scenario.name.as_str());
    let name = format!("npc-{}-seed{}-{}runs", crate::fly::file_name(scenario), args.seed, args.runs);
    let ours = |path: &Path| -> Result<bool, HostError> {
        for (mode, scenario) in scenarios {
            let identity = identify(&campaign_of(args, *mode, None), scenario)?;
            // A mode that has not been begun is nobody else's.
            if read_identity(&path.join(mode.name())).is_ok_and(|found| found != identity) {
                return Ok(false);
            }
        }
        Ok(true)
    };
    let mut number = 1u32;
    loop {
        let path = Path::new(STUDIES).join(if number == 1 { name.clone() } else { format!("{name}-{number}") });
        if !path.exists() || ours(&path)? && named(&path).is_ok() {
            return Ok(path);
        }
        number = number.saturating_add(1);
    }
}
