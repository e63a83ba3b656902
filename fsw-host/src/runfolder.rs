//! The run folder: chosen fresh, refused when occupied, and every file in it either whole or absent.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::HostError;
use crate::linklog::LinkLogWriter;
use crate::output::json_text;
use crate::record::FlightRecord;
use crate::{report, telemetry};

/// Files of a run folder; `--force` removes these and nothing else.
pub const FILES: [&str; 8] = [
    "summary.json",
    "telemetry.parquet",
    "telemetry.csv",
    "link.bin",
    "scenario.toml",
    "report.html",
    "overview.svg",
    BOARD_LOG,
];

/// What a flight computer outside this process says about itself beside the link.
pub const BOARD_LOG: &str = "board.log";

/// Ends the name of a file that is not whole yet.
const PART: &str = ".part";

/// An empty folder for one run.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// The folder the user asked for. `force` replaces an earlier run in it.
    ///
    /// # Errors
    /// The folder is occupied or cannot be made.
    pub fn at(path: &Path, force: bool) -> Result<Self, HostError> {
        if path.exists() && !path.is_dir() {
            return Err(HostError::NotAFolder(path.to_owned()));
        }
        let contents = contents(path)?;
        // Nothing is removed unless all of it is an earlier run.
        if contents.iter().any(|found| !(force && is_of_a_run(found))) {
            return Err(HostError::Occupied(path.to_owned()));
        }
        for old in &contents {
            fs::remove_file(old).map_err(HostError::file("replace", old))?;
        }
        fs::create_dir_all(path).map_err(HostError::file("create", path))?;
        Ok(Self { path: path.to_owned() })
    }

    /// A folder that did not exist before: `NAME`, `NAME-2`, `NAME-3`, … inside `parent`.
    ///
    /// # Errors
    /// No folder can be made there.
    pub fn fresh(parent: &Path, name: &str) -> Result<Self, HostError> {
        fs::create_dir_all(parent).map_err(HostError::file("create", parent))?;
        let mut path = parent.join(name);
        let mut number = 2u32;
        loop {
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self { path }),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {
                    path = parent.join(format!("{name}-{number}"));
                    number = number.saturating_add(1);
                }
                Err(e) => return Err(HostError::file("create", path)(e)),
            }
        }
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Starts `link.bin`. It grows with the flight and is readable at any length, so it needs no temporary name.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn link_log(&self, schema_hash: u64) -> Result<LinkLogWriter<BufWriter<File>>, HostError> {
        let path = self.path.join("link.bin");
        let start = || LinkLogWriter::new(BufWriter::new(File::create(&path)?), schema_hash);
        start().map_err(HostError::file("write", &path))
    }

    /// Writes the resolved scenario.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write_scenario(&self, toml: &str) -> Result<(), HostError> {
        self.whole("scenario.toml", |out| out.write_all(toml.as_bytes()))
    }

    /// Writes everything that is known once the flight is over.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_record(&self, record: &FlightRecord, csv: bool) -> Result<(), HostError> {
        // The shortest and most telling file first: on a disk that is nearly full it is the one to have.
        self.whole("summary.json", |out| out.write_all(json_text(&record.summary)?.as_bytes()))?;
        let columns = telemetry::table(record);
        self.whole("telemetry.parquet", |out| telemetry::write_parquet(&columns, out))?;
        if csv {
            self.whole("telemetry.csv", |out| telemetry::write_csv(&columns, out))?;
        }
        self.drawn("report.html", |path| report::write(record, path))?;
        self.drawn("overview.svg", |path| report::write_overview(record, path))
    }

    /// The same as [`RunFolder::whole`] for what the report draws.
    fn drawn(&self, name: &str, write: impl FnOnce(&Path) -> Result<(), report::ReportError>) -> Result<(), HostError> {
        let (path, temporary) = (self.path.join(name), self.path.join(format!("{name}{PART}")));
        let written = write(&temporary).map_err(HostError::from);
        let written = written.and_then(|()| fs::rename(&temporary, &path).map_err(HostError::file("write", &path)));
        written.inspect_err(|_| {
            let _ = fs::remove_file(&temporary);
        })
    }

    /// Writes a file under a temporary name and gives it its own once it is whole.
    fn whole(&self, name: &str, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), HostError> {
        write_whole(&self.path.join(name), fill)
    }
}

/// Whether something exists there that is neither a plain file nor a folder.
#[must_use]
pub fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

/// What lies in a folder; nothing in one that does not exist.
fn contents(folder: &Path) -> Result<Vec<PathBuf>, HostError> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let list = || fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>();
    list().map_err(HostError::file("read", folder))
}

/// Whether a path is a file that a run leaves: one of [`FILES`], or its unfinished beginning.
fn is_of_a_run(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    let name = name.strip_suffix(PART).unwrap_or(name);
    FILES.contains(&name) && path.symlink_metadata().is_ok_and(|found| !found.is_dir())
}

/// Writes a file under a temporary name beside it and gives it its own once it is whole. What is no plain file, such
/// as a device or a pipe, is written as it stands: a rename would put a file in its place.
///
/// # Errors
/// It cannot be written; nothing half-written is left behind.
pub fn write_whole(path: &Path, fill: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), HostError> {
    if path.is_dir() {
        return Err(HostError::NotAFile(path.to_owned()));
    }
    if is_special(path) {
        let write = || {
            let mut out = BufWriter::new(File::options().write(true).open(path)?);
            fill(&mut out)?;
            out.flush()
        };
        return write().map_err(HostError::file("write", path));
    }
    let mut temporary = path.as_os_str().to_owned();
    temporary.push(PART);
    let temporary = PathBuf::from(temporary);
    let write = || {
        let mut out = BufWriter::new(File::create(&temporary)?);
        fill(&mut out)?;
        out.flush()?;
        fs::rename(&temporary, path)
    };
    write().map_err(|e| {
        let _ = fs::remove_file(&temporary);
        HostError::file("write", path)(e)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let path = std::env::temp_dir().join(format!("aeroshell-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&path);
        path
    }

    #[test]
    fn an_occupied_folder_is_refused_and_left_alone() {
        let path = scratch("occupied");
        fs::create_dir_all(&path).unwrap();
        fs::write(path.join("thesis.txt"), "mine").unwrap();
        for force in [false, true] {
            assert!(matches!(RunFolder::at(&path, force), Err(HostError::Occupied(_))));
        }
        assert_eq!(fs::read_to_string(path.join("thesis.txt")).unwrap(), "mine");
        fs::remove_dir_all(&path).unwrap();
    }

    #[test]
    fn force_replaces_an_earlier_run() {
        let path = scratch("force");
        RunFolder::at(&path, false).unwrap().write_scenario("name = \"a\"").unwrap();
        assert!(matches!(RunFolder::at(&path, false), Err(HostError::Occupied(_))));
        RunFolder::at(&path, true).unwrap();
        assert!(!path.join("scenario.toml").exists());
        fs::remove_dir_all(&path).unwrap();
    }

    #[test]
    fn force_removes_nothing_when_it_cannot_remove_everything_and_clears_unfinished_files() {
        let path = scratch("mixed");
        RunFolder::at(&path, false).unwrap().write_scenario("name = \"a\"").unwrap();
        fs::write(path.join("report.html.part"), "half").unwrap();
        fs::write(path.join("thesis.txt"), "mine").unwrap();
        assert!(matches!(RunFolder::at(&path, true), Err(HostError::Occupied(_))));
        assert_eq!(fs::read_dir(&path).unwrap().count(), 3);
        fs::remove_file(path.join("thesis.txt")).unwrap();
        RunFolder::at(&path, true).unwrap();
        assert_eq!(fs::read_dir(&path).unwrap().count(), 0);
        fs::remove_dir_all(&path).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_is_written_and_stays_a_pipe() {
        use std::os::unix::fs::FileTypeExt;
        let folder = scratch("pipe");
        fs::create_dir_all(&folder).unwrap();
        let pipe = folder.join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || fs::read_to_string(pipe).unwrap()
        });
        write_whole(&pipe, |out| out.write_all(b"rows")).unwrap();
        assert_eq!(reader.join().unwrap(), "rows");
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn fresh_folders_never_repeat() {
        let parent = scratch("fresh");
        let names: Vec<_> = (0..3).map(|_| RunFolder::fresh(&parent, "msl-seed1").unwrap().path().to_owned()).collect();
        assert_eq!(names, ["msl-seed1", "msl-seed1-2", "msl-seed1-3"].map(|n| parent.join(n)));
        fs::remove_dir_all(&parent).unwrap();
    }

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let path = scratch("whole");
        fs::create_dir_all(&path).unwrap();
        let file = path.join("x.csv");
        assert!(write_whole(&file, |_| Err(io::Error::other("disk full"))).is_err());
        assert_eq!(fs::read_dir(&path).unwrap().count(), 0);
        fs::remove_dir_all(&path).unwrap();
    }
}
