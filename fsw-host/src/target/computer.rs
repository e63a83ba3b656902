//! Opens the flight computer that the user asked for, wherever it is.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use hil_sim::session::SessionError;
use hil_sim::transport::{Listener, open_serial};

use super::board_log::LogStream;
use super::{Image, Qemu, RemoteComputer, Target, TargetError, wait_for_peer};
use crate::record::Computer;

/// Binary that flies over a serial line.
const FLIGHT_IMAGE: &str = "flight";

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
    /// One sentence: no image, no emulator, or one that ends at once.
    pub fn emulator(&self, target: Target) -> Result<Remote, TargetError> {
        let image = match self.image {
            Some(path) => Image::open(target, path)?,
            None => {
                (self.say)(&format!("building the image for {} …", target.title()));
                Image::build(target, FLIGHT_IMAGE)?
            }
        };
        (self.say)(&format!("starting {} …", target.emulator()));
        let (link_port, log_port) = (local_port()?, local_port()?);
        let devices = devices(target, &link_port, &log_port)?;
        let mut qemu = Qemu::start(target, &image, &devices)?;
        let link = wait_for_peer(&mut qemu, &link_port)?;
        let log = wait_for_peer(&mut qemu, &log_port)?;
        let place = format!("qemu:{target}");
        let facts = Computer {
            place: place.clone(),
            image: Some(image.path.display().to_string()),
            image_sha256: Some(image.sha256),
            build_id: None,
        };
        let end = RemoteComputer::new(Box::new(link), place, self.interrupt).in_emulator(qemu);
        Ok(Remote { end, facts, log: Some(LogStream { stream: Box::new(log), elf: image.elf }) })
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

/// Bound before the emulator starts, so that nobody else can take it in between.
fn local_port() -> Result<Listener, TargetError> {
    Listener::bind("127.0.0.1:0").map_err(|e| TargetError::System {
        action: "open a port for the emulator".into(),
        source: std::io::Error::other(e.to_string()),
    })
}

/// Where the serial lines of the board lead: the link and, apart from it, the log.
fn devices(target: Target, link: &Listener, log: &Listener) -> Result<Vec<String>, TargetError> {
    let socket = |id: &str, port: &Listener| -> Result<[String; 2], TargetError> {
        let port = port.local_address().map_err(TargetError::system("ask for a port's number"))?.port();
        let socket = format!("socket,id={id},host=127.0.0.1,port={port},server=off,nodelay=on");
        Ok(["-chardev".into(), socket])
    };
    let mut devices = Vec::from(socket("link", link)?);
    devices.extend(socket("log", log)?);
    devices.extend(["-serial".into(), "chardev:link".into()]);
    devices.extend(match target {
        Target::M7 => ["-serial".into(), "chardev:log".into()],
        // The board has a single serial line.
        Target::Rv64 => ["-semihosting-config".into(), "enable=on,target=native,chardev=log".into()],
    });
    Ok(devices)
}
