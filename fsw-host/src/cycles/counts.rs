//! The file of block counts that the plugin wrote (its format is described in the crate `qemu-blocks`).

use super::CycleError;

const HEADER: &[u8] = b"aeroshell-blocks 1\n";

/// A translation block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Address of its first instruction.
    pub start: u32,
    /// How many instructions it has.
    pub instructions: usize,
}

/// Executions of one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executions {
    /// Number of the block, in the order of [`BlockCounts::blocks`].
    pub block: usize,
    /// How often it ran.
    pub times: u64,
}

/// Which blocks there are and how often each ran in each frame. Frames stay encoded until they are asked for: a flight
/// has millions of counts.
#[derive(Debug, Default)]
pub struct BlockCounts {
    bytes: Vec<u8>,
    blocks: Vec<Block>,
    /// Where the counts of each frame begin.
    frames: Vec<usize>,
    complete: bool,
}

impl BlockCounts {
    /// Reads a file; one that was cut in the middle of a record is whole up to that record.
    pub fn parse(bytes: Vec<u8>) -> Result<Self, CycleError> {
        let mut counts = Self::default();
        let mut rest = bytes.strip_prefix(HEADER).ok_or(CycleError::Counts("it does not begin with its header"))?;
        while !counts.complete && counts.take_record(&mut rest, bytes.len()).map_err(CycleError::Counts)? {}
        counts.bytes = bytes;
        Ok(counts)
    }

    /// All blocks.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// The frames, in order; each by block number, without the blocks that did not run in it.
    pub fn frames(&self) -> impl Iterator<Item = Vec<Executions>> + '_ {
        self.frames.iter().map(|&start| take_entries(&mut &self.bytes[start..]).unwrap_or_default())
    }

    /// Forgets the first frames.
    pub fn skip_frames(&mut self, count: usize) {
        self.frames.drain(..count.min(self.frames.len()));
    }

    /// Whether the guest ended in good order; otherwise the frames are those until it was killed.
    pub fn complete(&self) -> bool {
        self.complete
    }

    /// Takes one record off the front of what is left of `length` bytes; `false` when they end before the record does.
    fn take_record(&mut self, rest: &mut &[u8], length: usize) -> Result<bool, &'static str> {
        let Some((&tag, mut fields)) = rest.split_first() else { return Ok(false) };
        match tag {
            b'B' => {
                let (Some(start), Some(count)) = (take_varint(&mut fields), take_varint(&mut fields)) else {
                    return Ok(false);
                };
                let start = u32::try_from(start).map_err(|_| "a block lies above 4 GiB")?;
                let instructions = usize::try_from(count).map_err(|_| "a block has too many instructions")?;
                self.blocks.push(Block { start, instructions });
            }
            b'F' | b'O' => {
                let start = length - fields.len();
                let Some(entries) = take_entries(&mut fields) else { return Ok(false) };
                if entries.iter().any(|entry| entry.block >= self.blocks.len()) {
                    return Err("a count is for a block that is not there");
                }
                if tag == b'F' {
                    self.frames.push(start);
                }
            }
            b'E' => self.complete = true,
            _ => return Err("it has a record of unknown kind"),
        }
        *rest = fields;
        Ok(true)
    }
}

fn take_entries(rest: &mut &[u8]) -> Option<Vec<Executions>> {
    let mut block = 0;
    let entries = take_varint(rest)?;
    (0..entries)
        .map(|_| {
            block += usize::try_from(take_varint(rest)?).ok()?;
            Some(Executions { block, times: take_varint(rest)? })
        })
        .collect()
}

/// Seven bits a byte, the lowest first; the top bit says that more follow.
fn take_varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, tail) = rest.split_first()?;
        *rest = tail;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same bytes as in the tests of `qemu-blocks`.
    const FILE: &[u8] = b"aeroshell-blocks 1\nB\x80\x08\x03B\x80\x0a\x09F\x01\x01\xc8\x01O\x01\x00\x03E";

    #[test]
    fn a_file_in_the_documented_bytes_is_read_back() {
        let counts = BlockCounts::parse(FILE.to_vec()).unwrap();
        assert_eq!(counts.blocks(), [Block { start: 0x400, instructions: 3 }, Block { start: 0x500, instructions: 9 }]);
        assert_eq!(counts.frames().collect::<Vec<_>>(), [[Executions { block: 1, times: 200 }]]);
        assert!(counts.complete());
        let mut later = counts;
        later.skip_frames(7);
        assert_eq!(later.frames().count(), 0);
    }

    #[test]
    fn a_file_cut_anywhere_is_whole_up_to_its_last_record_and_says_that_it_is_cut() {
        for length in HEADER.len()..FILE.len() {
            let counts = BlockCounts::parse(FILE[..length].to_vec()).unwrap();
            assert!(!counts.complete(), "cut at {length}");
            assert!(counts.frames().all(|frame| frame.len() == 1), "cut at {length}");
        }
        assert_eq!(BlockCounts::parse(FILE[..FILE.len() - 2].to_vec()).unwrap().frames().count(), 1);
    }

    #[test]
    fn another_file_and_a_count_for_no_block_are_errors() {
        assert!(BlockCounts::parse(b"something else".to_vec()).is_err());
        assert!(BlockCounts::parse(b"aeroshell-blocks 1\nF\x01\x00\x01".to_vec()).is_err());
        assert!(BlockCounts::parse(b"aeroshell-blocks 1\nX".to_vec()).is_err());
    }
}
