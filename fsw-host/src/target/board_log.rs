//! What the board says about itself, beside the link: `defmt` frames, decoded against the image that said them.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use defmt_decoder::{DecodeError, Table};
use hil_sim::transport::Stream;

use super::TargetError;

/// Pieces in which silence is waited for.
const STEP: Duration = Duration::from_millis(100);

/// Shows a line while the flight goes on.
pub type Show = Box<dyn Fn(&str) + Send>;

/// Where a board's log comes from, and the image that explains it.
pub struct LogStream {
    /// The bytes.
    pub stream: Box<dyn Stream>,
    /// What was read of them already.
    pub begun: Vec<u8>,
    /// The image.
    pub elf: Vec<u8>,
}

impl LogStream {
    /// The log of an image that is about to boot.
    #[must_use]
    pub fn new(stream: Box<dyn Stream>, elf: Vec<u8>) -> Self {
        Self { stream, begun: Vec::new(), elf }
    }

    /// Waits for the first word, for at most `patience`: a board that speaks has booted.
    pub fn wait_for_boot(&mut self, patience: Duration) {
        let mut buffer = [0u8; 256];
        // A board without a log is waited for in vain, and one that is gone shows on the link.
        if let Ok(n) = self.stream.read_some(&mut buffer, patience) {
            self.begun.extend_from_slice(&buffer[..n]);
        }
    }

    /// Writes the log to `path` from now on, and to `show` if it is given.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_to(self, path: &Path, show: Option<Show>) -> Result<BoardLog, TargetError> {
        let failed = || TargetError::system(format!("write {}", path.display()));
        let lines = Lines { out: BufWriter::new(File::create(path).map_err(failed())?), show, start: Instant::now() };
        let stop = Arc::new(AtomicBool::new(false));
        let writer = Writer { stream: self.stream, begun: self.begun, lines, stop: Arc::clone(&stop) };
        let thread = std::thread::spawn(move || writer.run(&self.elf));
        Ok(BoardLog { stop, thread })
    }
}

/// A log that is being written.
#[derive(Debug)]
pub struct BoardLog {
    stop: Arc<AtomicBool>,
    thread: JoinHandle<io::Result<()>>,
}

impl BoardLog {
    /// Writes what has come until now, and no more.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(self) -> io::Result<()> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_else(|_| Err(io::Error::other("the decoder stumbled over the board's log")))
    }
}

struct Writer {
    stream: Box<dyn Stream>,
    begun: Vec<u8>,
    lines: Lines,
    stop: Arc<AtomicBool>,
}

impl Writer {
    fn run(mut self, elf: &[u8]) -> io::Result<()> {
        match Table::parse(elf) {
            Ok(Some(table)) => self.decode(&table)?,
            Ok(None) => self.lines.write("-", "the image has no defmt messages: nothing to decode with")?,
            Err(e) => self.lines.write("-", &format!("the image's defmt messages cannot be read: {e:#}"))?,
        }
        self.lines.out.flush()
    }

    fn decode(&mut self, table: &Table) -> io::Result<()> {
        let mut decoder = table.new_stream_decoder();
        decoder.received(&self.begun);
        let mut buffer = [0u8; 1024];
        loop {
            loop {
                match decoder.decode() {
                    Ok(frame) => {
                        let board_time = frame.display_timestamp().map(|t| format!("[board {t}] ")).unwrap_or_default();
                        let level = frame.level().map_or("-", |level| level.as_str());
                        self.lines.write(level, &format!("{board_time}{}", frame.display_message()))?;
                    }
                    Err(DecodeError::UnexpectedEof) => break,
                    Err(DecodeError::Malformed) => {
                        self.lines.write("-", "bytes that are no message of this image")?;
                        if !table.encoding().can_recover() {
                            return Ok(());
                        }
                    }
                }
            }
            match self.stream.read_some(&mut buffer, STEP) {
                Ok(0) if self.stop.load(Ordering::Relaxed) => return Ok(()),
                Ok(0) => self.lines.out.flush()?,
                Ok(n) => decoder.received(&buffer[..n]),
                // The board is gone, and with it its log.
                Err(_) => return Ok(()),
            }
        }
    }
}

struct Lines {
    out: BufWriter<File>,
    show: Option<Show>,
    start: Instant,
}

impl Lines {
    /// One line: seconds since the board was started, level, message.
    fn write(&mut self, level: &str, message: &str) -> io::Result<()> {
        let line = format!("{:10.3} s  {level:<5}  {message}", self.start.elapsed().as_secs_f64());
        if let Some(show) = &self.show {
            show(&line);
        }
        writeln!(self.out, "{line}")
    }
}
