//! The program `host-bench` is the bench image of this machine: it flies a recorded uplink and writes what comes down
//! the link, with the cost of each minor frame, to its standard output. It runs under Callgrind, whose log is its
//! standard input:
//!
//! ```text
//! valgrind --tool=callgrind --collect-atstart=no host-bench UPLINK 2>&0
//! ```
//!
//! `aeroshell wcet --target host` starts it so. This library is what needs no Valgrind: what Callgrind says.

use std::io::{self, BufRead};

use fsw_core::link::framing::DELIMITER;

/// Asks Callgrind for what it has counted …
pub const ASK: &std::ffi::CStr = c"status internal";
/// … and for a line that tells where the answer ends.
pub const ASK_FOR_END: &std::ffi::CStr = c"status";
/// Bytes that a board takes from its stream at a time.
const READ_BYTES: usize = 256;
const COUNT: &str = "events-1: ";
const END: &str = "thread(s) running.";

/// Instructions that Callgrind has counted, from its answer to [`ASK`] and [`ASK_FOR_END`].
///
/// # Errors
/// The log ends, or the answer has no count in it.
pub fn instructions(log: &mut impl BufRead) -> io::Result<u64> {
    let (mut counted, mut line) = (None, String::new());
    while {
        line.clear();
        log.read_line(&mut line)? > 0
    } {
        let text = line.trim_end();
        if let Some(count) = text.strip_prefix(COUNT) {
            counted = count.parse().ok();
        } else if text.ends_with(END) {
            return counted.ok_or_else(|| io::Error::other("Callgrind's status has no count of instructions"));
        }
    }
    Err(io::Error::new(io::ErrorKind::UnexpectedEof, "Callgrind's log ended"))
}

/// How many bytes a board takes at once of what there is: up to the last delimiter of a read, or of the first frame where
/// that is longer.
#[must_use]
pub fn end_of_read(bytes: &[u8]) -> usize {
    let read = bytes.get(..READ_BYTES).unwrap_or(bytes);
    let last = read.iter().rposition(|byte| *byte == DELIMITER);
    last.or_else(|| bytes.iter().position(|byte| *byte == DELIMITER)).map_or(bytes.len(), |last| last + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_read_ends_at_its_last_delimiter_and_holds_a_frame_at_least() {
        assert_eq!(end_of_read(&[1, 0, 2, 2, 0, 3]), 5);
        assert_eq!(end_of_read(&[1, 2]), 2);
        let long = [[1; 300].as_slice(), &[0, 1, 0]].concat();
        assert_eq!(end_of_read(&long), 301);
    }

    const ANSWER: &str = "==7== Command: x\nevents: Ir\nthreads: 1\nevents-1: 48082\nframes-1: 1\nfunction-1-0: main\n\
                          events-1-0: 77\n1 thread(s) running.\nevents-1: 48100\n1 thread(s) running.\n";

    #[test]
    fn each_answer_ends_with_its_marker_and_holds_the_count_of_the_whole_thread() {
        let mut log = ANSWER.as_bytes();
        assert_eq!(instructions(&mut log).unwrap(), 48_082);
        assert_eq!(instructions(&mut log).unwrap(), 48_100);
        assert_eq!(instructions(&mut log).unwrap_err().kind(), io::ErrorKind::UnexpectedEof);
    }

    #[test]
    fn an_answer_without_a_count_is_an_error_and_no_zero() {
        assert!(instructions(&mut "1 thread(s) running.\n".as_bytes()).is_err());
    }
}
