//! The black box: a few words of memory that a reset leaves alone.
//!
//! After power-on they hold anything; a magic word and a checksum tell a record from that.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use fsw_core::link::packet::{RestartReason, RestartReport};

/// Marks the words as a record of this layout.
const MAGIC: u32 = 0xB1AC_0B01;
/// Words of a record: magic, reason, frame, address, restarts, checksum.
const WORDS: usize = 6;

static CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// What the box holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// The failure that has not been reported yet.
    pub failure: Option<RestartReport>,
    /// Restarts by failure since power-on.
    pub restarts: u32,
}

/// A record as it lies in memory.
pub type Words = [u32; WORDS];

fn checksum(words: &Words) -> u32 {
    let mut digest = CHECKSUM.digest();
    for word in words.iter().take(WORDS - 1) {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

impl Record {
    /// As it lies in memory.
    #[must_use]
    pub fn to_words(self) -> Words {
        let (reason, frame, address) = match self.failure {
            Some(RestartReport { reason, frame, address }) => (code(reason), frame, address),
            None => (0, 0, 0),
        };
        let mut words = [MAGIC, reason, frame, address, self.restarts, 0];
        words[WORDS - 1] = checksum(&words);
        words
    }

    /// The record in these words; none when they are not one.
    #[must_use]
    pub fn from_words(words: &Words) -> Option<Self> {
        let [magic, reason, frame, address, restarts, sum] = *words;
        if magic != MAGIC || sum != checksum(words) {
            return None;
        }
        let failure = reason_of(reason).map(|reason| RestartReport { reason, frame, address });
        Some(Self { failure, restarts })
    }

    /// The record after one more failure.
    #[must_use]
    pub fn after(self, failure: RestartReport) -> Self {
        Self { failure: Some(failure), restarts: self.restarts.saturating_add(1) }
    }

    /// The record after its failure has been read.
    #[must_use]
    pub fn told(self) -> Self {
        Self { failure: None, ..self }
    }
}

/// Codes of the reasons in the box; 0 is none.
const REASONS: [(u32, RestartReason); 4] = [
    (1, RestartReason::Panic),
    (2, RestartReason::ProcessorFault),
    (3, RestartReason::StackOverflow),
    (4, RestartReason::Watchdog),
];

fn code(reason: RestartReason) -> u32 {
    REASONS.iter().find(|(_, r)| *r == reason).map_or(0, |(code, _)| *code)
}

fn reason_of(code: u32) -> Option<RestartReason> {
    REASONS.iter().find(|(c, _)| *c == code).map(|(_, reason)| *reason)
}

#[cfg(target_os = "none")]
pub use target::{store, take};

#[cfg(target_os = "none")]
mod target {
    use core::cell::UnsafeCell;
    use core::mem::MaybeUninit;

    use super::{Record, RestartReport, Words};

    struct Memory(UnsafeCell<MaybeUninit<Words>>);

    // SAFETY: one thread; a fault handler that comes in between never returns to what it interrupted.
    unsafe impl Sync for Memory {}

    #[unsafe(link_section = ".uninit.blackbox")]
    static BOX: Memory = Memory(UnsafeCell::new(MaybeUninit::uninit()));

    fn read() -> Record {
        // SAFETY: the words are memory that holds some bits, whatever they are; volatile, because the program that
        // wrote them is another one.
        let words = unsafe { BOX.0.get().cast::<Words>().read_volatile() };
        Record::from_words(&words).unwrap_or_default()
    }

    fn write(record: Record) {
        // SAFETY: as for reading; nobody holds a reference to the words.
        unsafe { BOX.0.get().cast::<Words>().write_volatile(record.to_words()) };
    }

    /// Keeps the reason of a failure for after the reset.
    pub fn store(failure: RestartReport) {
        write(read().after(failure));
    }

    /// What the box holds; the failure is handed out once.
    pub fn take() -> Record {
        let record = read();
        write(record.told());
        record
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAILURE: RestartReport = RestartReport { reason: RestartReason::StackOverflow, frame: 123, address: 0x1234 };

    #[test]
    fn a_record_survives_in_memory() {
        for (_, reason) in REASONS {
            let record = Record::default().after(RestartReport { reason, ..FAILURE });
            assert_eq!(Record::from_words(&record.to_words()), Some(record));
        }
    }

    #[test]
    fn a_failure_is_told_once_and_its_restart_counted_for_ever() {
        let told = Record::default().after(FAILURE).told();
        assert_eq!(Record::from_words(&told.to_words()), Some(Record { failure: None, restarts: 1 }));
        assert_eq!(told.after(FAILURE), Record { failure: Some(FAILURE), restarts: 2 });
    }

    #[test]
    fn memory_after_power_on_is_no_record() {
        for garbage in [[0; WORDS], [u32::MAX; WORDS], [MAGIC; WORDS]] {
            assert_eq!(Record::from_words(&garbage), None);
        }
    }

    #[test]
    fn a_single_wrong_bit_spoils_a_record() {
        let words = Record::default().after(FAILURE).to_words();
        for bit in 0..32 * WORDS {
            let mut wrong = words;
            wrong[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Record::from_words(&wrong), None, "bit {bit}");
        }
    }
}
