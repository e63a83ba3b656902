//! Shards of one campaign, flown apart, become the campaign.

use std::io;
use std::path::{Path, PathBuf};

use super::columns::Columns;
use super::folder::{Folder, RUNS, SCENARIO, read_scenario};
use super::identity::{Identity, read_identity};
use super::runs::Runs;
use super::table::{Heading, Reader};
use crate::cli::CampaignArgs;
use crate::error::HostError;
use crate::record::ScenarioFacts;

/// One shard.
struct Shard {
    path: PathBuf,
    identity: Identity,
}

impl Shard {
    /// Whether it has the runs that it says, under these headings, and does not lie where the whole shall be.
    fn check(&self, out: &Path, headings: &[Heading]) -> Result<(), HostError> {
        let place = |path: &Path| path.canonicalize().ok();
        if place(out).is_some_and(|out| place(&self.path) == Some(out)) {
            let out = out.display();
            return Err(HostError::Option(format!(
                "--out {out} is a shard itself: choose another folder for the whole"
            )));
        }
        let table = self.path.join(RUNS);
        Runs::open(&table, &self.identity)?;
        let read = || {
            let reader = Reader::open(&table)?;
            if reader.headings() != headings {
                return Err(io::Error::other("its columns are not those of this program"));
            }
            reader.for_each_row(|_| Ok(()))
        };
        read().map_err(HostError::file("read", &table))
    }
}

/// Merges the shards named on the command line.
///
/// # Errors
/// They do not fit together: another scenario, seed or split, a gap, an overlap, or a shard that is not complete.
pub fn run(args: &CampaignArgs) -> Result<bool, HostError> {
    let Some(out) = &args.out else {
        return Err(HostError::Option("--merge needs --out DIR: the folder of the whole campaign".into()));
    };
    let shards = fitting(&args.merge)?;
    let Some(first) = shards.first() else { return Ok(true) };
    let whole = Identity {
        first: first.identity.first,
        runs: shards.iter().map(|shard| shard.identity.runs).sum(),
        ..first.identity.clone()
    };
    let scenario = read_scenario(&first.path, &whole)?;
    let headings = Columns::of(&scenario, &ScenarioFacts::of(&scenario)).headings();
    // Everything is read once before anything is made or replaced.
    shards.iter().try_for_each(|shard| shard.check(out, &headings))?;
    let folder = Folder::at(out, &whole, args.force)?;
    folder.write(SCENARIO, |file| std::io::Write::write_all(file, scenario.to_toml().as_bytes()))?;
    let tables: Vec<PathBuf> = shards.iter().map(|shard| shard.path.join(RUNS)).collect();
    folder.concatenate(&headings, &tables)?;
    folder.gather(&[])?;
    super::conclude(folder, scenario, None)?.tell(args)
}

/// The shards in the order of their runs, when they make one campaign without gap or overlap.
fn fitting(paths: &[PathBuf]) -> Result<Vec<Shard>, HostError> {
    let open = |path: &PathBuf| {
        let shard = Shard { path: path.clone(), identity: read_identity(path)? };
        if shard.path.join(RUNS).is_file() {
            return Ok(shard);
        }
        let path = path.display();
        Err(HostError::Option(format!("{path} is not complete: run its campaign again to the end before merging")))
    };
    let mut shards = paths.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    shards.sort_by_key(|shard| shard.identity.first);
    shards.windows(2).try_for_each(|pair| fit(&pair[0], &pair[1]))?;
    Ok(shards)
}

fn fit(a: &Shard, b: &Shard) -> Result<(), HostError> {
    let (x, y) = (a.path.display(), b.path.display());
    let alike = Identity { first: a.identity.first, runs: a.identity.runs, ..b.identity.clone() };
    if let Some(difference) = alike.differs_from(&a.identity) {
        return Err(HostError::Option(format!("{x} and {y} are not shards of one campaign: {difference}")));
    }
    let refuse = |what: &str, from: u64, to: u64| {
        Err(HostError::Option(format!("{x} and {y} {what} runs {from} to {}", to.saturating_sub(1))))
    };
    match a.identity.end().cmp(&b.identity.first) {
        std::cmp::Ordering::Less => refuse("leave a gap:", a.identity.end(), b.identity.first),
        std::cmp::Ordering::Greater => refuse("overlap in", b.identity.first, a.identity.end().min(b.identity.end())),
        std::cmp::Ordering::Equal => Ok(()),
    }
}
