//! Block counters, and the file they go to.
//!
//! The file is a line of text that names format and version, then records of a tag byte and varints (LEB128):
//!
//! | Tag | Then | Means |
//! |---|---|---|
//! | `B` | start address, instructions | a block; blocks are numbered from 0 in this order |
//! | `F` | entries, then per entry: block number less the one before it, executions | a frame |
//! | `O` | as `F` | all that ran outside frames |
//! | `E` | nothing | the guest ended in good order |
//!
//! A frame is the sum of the spans since the frame before it was closed; only what runs in a span belongs to one. It is
//! flushed when it is closed: a QEMU that is killed leaves a file that is whole up to its last frame.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};

/// First line of the file.
pub const HEADER: &[u8] = b"aeroshell-blocks 1\n";

/// All blocks seen so far, with their counters.
pub struct Recorder<W: Write> {
    out: W,
    numbers: HashMap<(u64, u64), usize>,
    blocks: Vec<Block>,
    in_span: bool,
}

/// One block: the counter that translated code increments, and what has been accounted for of it.
struct Block {
    executions: &'static AtomicU64,
    accounted: u64,
    in_frame: u64,
    outside: u64,
}

impl<W: Write> Recorder<W> {
    /// Starts a file.
    pub fn new(mut out: W) -> io::Result<Self> {
        out.write_all(HEADER)?;
        Ok(Self { out, numbers: HashMap::new(), blocks: Vec::new(), in_span: false })
    }

    /// The counter of a block, which lives as long as the process because translated code may.
    pub fn counter(&mut self, start: u64, instructions: u64) -> io::Result<&'static AtomicU64> {
        if let Some(&number) = self.numbers.get(&(start, instructions)) {
            return Ok(self.blocks[number].executions);
        }
        self.out.write_all(b"B")?;
        write_varint(&mut self.out, start)?;
        write_varint(&mut self.out, instructions)?;
        let executions: &'static AtomicU64 = Box::leak(Box::default());
        self.numbers.insert((start, instructions), self.blocks.len());
        self.blocks.push(Block { executions, accounted: 0, in_frame: 0, outside: 0 });
        Ok(executions)
    }

    /// The guest begins a span.
    pub fn begin_span(&mut self) {
        self.account();
        self.in_span = true;
    }

    /// The guest ends a span.
    pub fn end_span(&mut self) {
        self.account();
        self.in_span = false;
    }

    /// The guest closes a frame: what comes next, in this span or the next, belongs to another.
    pub fn close_frame(&mut self) -> io::Result<()> {
        self.account();
        let counts: Vec<u64> = self.blocks.iter_mut().map(|block| std::mem::take(&mut block.in_frame)).collect();
        self.write_counts(b"F", &counts)?;
        self.out.flush()
    }

    /// The guest has ended.
    pub fn finish(&mut self) -> io::Result<()> {
        self.account();
        let counts: Vec<u64> = self.blocks.iter().map(|block| block.outside + block.in_frame).collect();
        self.write_counts(b"O", &counts)?;
        self.out.write_all(b"E")?;
        self.out.flush()
    }

    /// Puts what ran since the last call where it belongs.
    fn account(&mut self) {
        for block in &mut self.blocks {
            let now = block.executions.load(Ordering::Relaxed);
            let ran = now - std::mem::replace(&mut block.accounted, now);
            *if self.in_span { &mut block.in_frame } else { &mut block.outside } += ran;
        }
    }

    fn write_counts(&mut self, tag: &[u8], counts: &[u64]) -> io::Result<()> {
        self.out.write_all(tag)?;
        write_varint(&mut self.out, counts.iter().filter(|&&count| count > 0).count() as u64)?;
        let mut previous = 0;
        for (number, &count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            write_varint(&mut self.out, (number - previous) as u64)?;
            write_varint(&mut self.out, count)?;
            previous = number;
        }
        Ok(())
    }
}

/// Seven bits a byte, the lowest first; the top bit says that more follow.
fn write_varint(out: &mut impl Write, mut value: u64) -> io::Result<()> {
    while value >= 0x80 {
        out.write_all(&[value as u8 | 0x80])?;
        value >>= 7;
    }
    out.write_all(&[value as u8])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(counter: &AtomicU64, times: u64) {
        counter.fetch_add(times, Ordering::Relaxed);
    }

    #[test]
    fn the_file_holds_blocks_frames_and_what_ran_outside_in_the_documented_bytes() {
        let mut file = Vec::new();
        let mut recorder = Recorder::new(&mut file).unwrap();
        let boot = recorder.counter(0x400, 3).unwrap();
        run(boot, 1);
        recorder.begin_span();
        let kernel = recorder.counter(0x500, 9).unwrap();
        run(kernel, 200);
        recorder.close_frame().unwrap();
        recorder.end_span();
        run(boot, 2);
        recorder.finish().unwrap();

        let mut expected = HEADER.to_vec();
        expected.extend(b"B\x80\x08\x03"); // 0x400, 3 instructions: block 0
        expected.extend(b"B\x80\x0a\x09"); // 0x500, 9 instructions: block 1
        expected.extend(b"F\x01\x01\xc8\x01"); // one entry: block 1, 200 times
        expected.extend(b"O\x01\x00\x03"); // one entry: block 0, three times
        expected.extend(b"E");
        assert_eq!(file, expected);
    }

    #[test]
    fn a_block_that_is_translated_again_keeps_its_counter_and_a_shorter_one_is_another_block() {
        let mut recorder = Recorder::new(Vec::new()).unwrap();
        let first = recorder.counter(0x400, 3).unwrap();
        assert!(std::ptr::eq(first, recorder.counter(0x400, 3).unwrap()));
        assert!(!std::ptr::eq(first, recorder.counter(0x400, 2).unwrap()));
    }

    #[test]
    fn a_frame_is_the_sum_of_its_spans_and_one_that_was_never_closed_counts_as_outside() {
        let mut file = Vec::new();
        let mut recorder = Recorder::new(&mut file).unwrap();
        let counter = recorder.counter(0x10, 1).unwrap();
        for (inside, outside) in [(5, 1), (7, 1)] {
            recorder.begin_span();
            run(counter, inside);
            recorder.end_span();
            run(counter, outside);
        }
        recorder.begin_span();
        run(counter, 1);
        recorder.close_frame().unwrap();
        run(counter, 3);
        recorder.end_span();
        recorder.finish().unwrap();
        let mut expected = HEADER.to_vec();
        expected.extend(b"B\x10\x01F\x01\x00\x0dO\x01\x00\x05E");
        assert_eq!(file, expected);
    }
}
