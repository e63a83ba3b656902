//! Opens the flight computer that the user asked for, wherever it is.

use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use hil_sim::session::SessionError;
use hil_sim::transport::{Local, open_serial};

use super::board_log::LogStream;
use super::{Image, Qemu, RemoteComputer, Target, TargetError};
use crate::record::Computer;

/// Binary that flies over a serial line.
const FLIGHT_IMAGE: &str = "flight";
/// Longest wait for the first word of a board's log; one that keeps none is greeted then.
const BOOT_PATIENCE: Duration = Duration::from_secs(5);

/// A flight computer outside this process, ready to be greeted.
pub struct Remote {
    /// Its end of the link.
    pub end: RemoteComputer,
    /// What it is.
    pub facts: Computer,
    /// Its log, where it has one that can be read.
    pub log: Option<LogStream>,
}

/// How to open a flight computer.
pub struct Opening<'a> {
    /// An image of the user's instead of one built now.
    pub image: Option<&'a Path>,
    /// Set when the user does not want to wait any longer.
    pub interrupt: &'static AtomicBool,
    /// Told what is being done, where it may take a while.
    pub say: &'a dyn Fn(&str),
}

impl Opening<'_> {
    /// Builds or takes an image and starts it in QEMU.
    ///
    /// # Errors
    /// One sentence: no image or no emulator.
    pub fn emulator(&self, target: Target) -> Result<Remote, TargetError> {
        let image = match self.image {
            Some(path) => Image::open(target, path)?,
            None => {
                (self.say)(&format!("building the image for {} …", target.title()));
                Image::build(target, FLIGHT_IMAGE)?
            }
        };
        (self.say)(&format!("starting {} …", target.emulator()));
        let pair = || Local::pair().map_err(TargetError::system("open a line to the emulator"));
        let ((link, link_end), (log, log_end)) = (pair()?, pair()?);
        let devices = devices(target).map(str::to_owned);
        let emulator = Qemu::start(target, &image, &devices, [link_end.into(), log_end.into()])?;
        let mut log = LogStream::new(Box::new(log), image.elf);
        // QEMU's UART may never tell of a byte that came before the board had switched it on.
        log.wait_for_boot(BOOT_PATIENCE);
        let place = format!("qemu:{target}");
        let facts = Computer {
            place: place.clone(),
            image: Some(image.path.display().to_string()),
            image_sha256: Some(image.sha256),
            build_id: None,
        };
        let end = RemoteComputer::new(Box::new(link), place, self.interrupt).in_emulator(emulator);
        Ok(Remote { end, facts, log: Some(log) })
    }

    /// Opens a serial line with a board at its other end.
    ///
    /// # Errors
    /// One sentence with the device.
    pub fn serial(&self, device_and_baud: &str) -> Result<Remote, SessionError> {
        let place = format!("serial:{device_and_baud}");
        let stream = open_serial(device_and_baud)?;
        let end = RemoteComputer::new(stream, place.clone(), self.interrupt);
        Ok(Remote { end, facts: Computer { place, ..Computer::default() }, log: None })
    }
}

/// The board's serial lines: the link is the emulator's standard input, a socket both ways, and the log its output.
fn devices(target: Target) -> [&'static str; 8] {
    let [option, log] = match target {
        Target::M7 => ["-serial", "chardev:log"],
        // This board has a single serial line.
        Target::Rv64 => ["-semihosting-config", "enable=on,target=native,chardev=log"],
    };
    ["-chardev", "socket,id=link,fd=0", "-chardev", "socket,id=log,fd=1", "-serial", "chardev:link", option, log]
}
