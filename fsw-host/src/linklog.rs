//! `link.bin`: every frame that crossed the link, in order. A log cut off anywhere reads up to its last whole record.
//!
//! Layout, little-endian: the header is `AEROLINK`, format version `u16`, schema hash `u64`. Each record is a direction
//! byte (0 to the flight computer, 1 from it), the number of bytes `u32`, and the bytes as they crossed the link,
//! delimiter included. Truth packets that only the recorder hears are not part of it.

use std::io::{self, Read, Write};

use thiserror::Error;

use crate::tap::LONGEST_PIECE;

/// First bytes of the file.
pub const MAGIC: [u8; 8] = *b"AEROLINK";
/// Version of the layout.
pub const FORMAT_VERSION: u16 = 1;
const HEADER_BYTES: usize = 18;
const RECORD_HEADER_BYTES: usize = 5;

/// Which way a frame went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// To the flight computer.
    Up,
    /// From the flight computer.
    Down,
}

/// Writes a log as the flight goes on.
pub struct LinkLogWriter<W: Write> {
    out: W,
}

impl<W: Write> LinkLogWriter<W> {
    /// Starts a log with its header.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn new(mut out: W, schema_hash: u64) -> io::Result<Self> {
        out.write_all(&MAGIC)?;
        out.write_all(&FORMAT_VERSION.to_le_bytes())?;
        out.write_all(&schema_hash.to_le_bytes())?;
        Ok(Self { out })
    }

    /// Appends one record.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn record(&mut self, direction: Direction, bytes: &[u8]) -> io::Result<()> {
        let length = u32::try_from(bytes.len()).map_err(|_| io::ErrorKind::InvalidInput)?;
        self.out.write_all(&[u8::from(direction == Direction::Down)])?;
        self.out.write_all(&length.to_le_bytes())?;
        self.out.write_all(bytes)
    }

    /// The medium, with what has been written.
    pub fn into_inner(self) -> W {
        self.out
    }

    /// Hands everything to the operating system.
    ///
    /// # Errors
    /// When `out` cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

/// Why a log cannot be read at all.
#[derive(Debug, Error)]
pub enum LinkLogError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It does not start like a log.
    #[error("not a link log: it does not start with \"AEROLINK\"")]
    NotALog,
    /// Written by another version of this program.
    #[error("link log of format {found}; this program reads format {FORMAT_VERSION}")]
    Format {
        /// Version found.
        found: u16,
    },
    /// Not cut off but damaged: what follows cannot be told apart any more.
    #[error("the log is garbled at byte {at}, after {records} whole records")]
    Garbled {
        /// Where the bad record begins.
        at: usize,
        /// Records before it.
        records: usize,
    },
    /// Nothing to replay.
    #[error("the log holds no whole record")]
    Empty,
}

/// A log read back.
#[derive(Debug)]
pub struct LinkLog {
    /// Hash of the packet types at the time of writing.
    pub schema_hash: u64,
    bytes: Vec<u8>,
    records: Vec<(Direction, std::ops::Range<usize>)>,
    /// True when the file ends inside a record.
    pub truncated: bool,
}

impl LinkLog {
    /// Reads a whole log; stops without complaint at a record that is cut off.
    ///
    /// # Errors
    /// See [`LinkLogError`].
    pub fn read(mut input: impl Read) -> Result<Self, LinkLogError> {
        let mut bytes = Vec::new();
        input.read_to_end(&mut bytes)?;
        let header = bytes.get(..HEADER_BYTES).ok_or(LinkLogError::NotALog)?;
        if header[..8] != MAGIC {
            return Err(LinkLogError::NotALog);
        }
        let found = u16::from_le_bytes([header[8], header[9]]);
        if found != FORMAT_VERSION {
            return Err(LinkLogError::Format { found });
        }
        let schema_hash = u64::from_le_bytes(header[10..18].try_into().map_err(|_| LinkLogError::NotALog)?);
        let mut records = Vec::new();
        let mut at = HEADER_BYTES;
        loop {
            match record_at(&bytes, at) {
                Found::Whole(direction, range) => {
                    at = range.end;
                    records.push((direction, range));
                }
                Found::End => break,
                Found::Garbled => return Err(LinkLogError::Garbled { at, records: records.len() }),
            }
        }
        let truncated = at != bytes.len();
        Ok(Self { schema_hash, bytes, records, truncated })
    }

    /// The records in order.
    pub fn records(&self) -> impl Iterator<Item = (Direction, &[u8])> {
        self.records.iter().filter_map(|(direction, range)| Some((*direction, self.bytes.get(range.clone())?)))
    }
}

/// What stands at a place of a log.
enum Found {
    Whole(Direction, std::ops::Range<usize>),
    /// Nothing, or the beginning of a record.
    End,
    /// Nothing that was ever written.
    Garbled,
}

fn record_at(bytes: &[u8], at: usize) -> Found {
    let direction = match bytes.get(at) {
        None => return Found::End,
        Some(0) => Direction::Up,
        Some(1) => Direction::Down,
        Some(_) => return Found::Garbled,
    };
    let start = at + RECORD_HEADER_BYTES;
    let Some(&[_, a, b, c, d]) = bytes.get(at..start) else { return Found::End };
    let length = u32::from_le_bytes([a, b, c, d]) as usize;
    if length > LONGEST_PIECE {
        return Found::Garbled;
    }
    if bytes.len() - start < length { Found::End } else { Found::Whole(direction, start..start + length) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut log = LinkLogWriter::new(&mut bytes, 0x1234).unwrap();
        log.record(Direction::Up, &[1, 2, 3, 0]).unwrap();
        log.record(Direction::Down, &[9, 0]).unwrap();
        bytes
    }

    #[test]
    fn what_is_written_is_read() {
        let log = LinkLog::read(sample().as_slice()).unwrap();
        let records: Vec<_> = log.records().collect();
        assert_eq!(records, [(Direction::Up, &[1, 2, 3, 0][..]), (Direction::Down, &[9, 0][..])]);
        assert_eq!((log.schema_hash, log.truncated), (0x1234, false));
    }

    #[test]
    fn a_log_cut_anywhere_yields_its_whole_records() {
        let whole = sample();
        for cut in HEADER_BYTES..whole.len() {
            let log = LinkLog::read(&whole[..cut]).unwrap();
            let expected = if cut < HEADER_BYTES + 9 { 0 } else { 1 };
            assert_eq!(log.records().count(), expected, "cut at {cut}");
            assert_eq!(log.truncated, cut != HEADER_BYTES && cut != HEADER_BYTES + 9);
        }
    }

    #[test]
    fn a_damaged_record_header_is_told_from_a_cut() {
        let first_header = HEADER_BYTES;
        for (offset, value) in [(0, 7), (3, 1), (4, 0xff)] {
            let mut bytes = sample();
            bytes[first_header + 9 + offset] = value;
            let error = LinkLog::read(bytes.as_slice()).unwrap_err();
            assert!(matches!(error, LinkLogError::Garbled { at, records: 1 } if at == first_header + 9), "{error}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        assert!(matches!(LinkLog::read(&b"short"[..]), Err(LinkLogError::NotALog)));
        assert!(matches!(LinkLog::read(&[7u8; 40][..]), Err(LinkLogError::NotALog)));
        let mut newer = sample();
        newer[8] = 9;
        assert!(matches!(LinkLog::read(newer.as_slice()), Err(LinkLogError::Format { found: 9 })));
    }
}
