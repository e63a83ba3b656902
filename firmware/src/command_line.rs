//! The command line that a debugger or an emulator hands to an image: words between blanks.

use core::ffi::CStr;

/// The word of this index, the program being word 0; made a C string in place, so that each word can be asked for once.
pub fn word(line: &mut [u8], index: usize) -> Option<&CStr> {
    let is_blank = |byte: &u8| matches!(byte, b' ' | 0);
    let word = line.split(is_blank).filter(|word| !word.is_empty()).nth(index)?;
    let start = word.as_ptr().addr() - line.as_ptr().addr();
    let end = start + word.len();
    // The blank behind the word, or the end of the line, becomes the terminator.
    *line.get_mut(end)? = 0;
    CStr::from_bytes_until_nul(line.get(start..)?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_found_between_blanks() {
        let mut line = *b"bench  job.bin answer.bin\0";
        assert_eq!(word(&mut line, 1), Some(c"job.bin"));
        assert_eq!(word(&mut line, 2), Some(c"answer.bin"));
        assert_eq!(word(&mut line, 0), Some(c"bench"));
        assert_eq!(word(&mut line, 3), None);
    }

    #[test]
    fn a_word_that_leaves_no_room_for_its_terminator_is_none() {
        assert_eq!(word(&mut b"bench".to_owned(), 0), None);
    }
}
