//! The place of a record in the flash.

/// Bytes of a place for a record. A sector has several places, one after the other.
pub const SLOT: usize = 2048;

/// The number of places in a sector. The smallest sector has 16 KiB (RM0090 table 5).
pub const SLOTS: usize = 8;

/// The least room that a board must have for the program, in bytes. The smallest boards have this
/// much: a chip of 512 KiB behind a bootloader, its record and its settings.
pub const PROGRAM: u32 = 192 << 10;

/// Returns the sector of the record, for an image that begins in sector `start`. It is sector 3,
/// which is small and which every chip has. An image that begins in sector 3 or later has the
/// record in the sector behind its vector table. The program's code is behind the record.
#[must_use]
pub const fn sector(start: u8) -> u8 {
    if start < 3 {
        3
    } else {
        start + 1
    }
}

/// Returns the place of the record in force: the last record in front of empty flash. `None` if
/// there is no record. `first_word` gives the first word of a place.
#[must_use]
pub fn slot(first_word: impl Fn(usize) -> u32) -> Option<usize> {
    let used = (0..SLOTS).take_while(|slot| first_word(*slot) != u32::MAX);
    used.filter(|slot| first_word(*slot) == crate::MAGIC).last()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MAGIC;

    #[test]
    fn the_last_whole_record_counts() {
        let (empty, spoilt) = (u32::MAX, 0);
        let cases = [
            ([empty; SLOTS], None),
            ([MAGIC; SLOTS], Some(7)),
            (
                [MAGIC, empty, MAGIC, empty, empty, empty, empty, empty],
                Some(0),
            ),
            (
                [MAGIC, spoilt, MAGIC, spoilt, empty, empty, empty, empty],
                Some(2),
            ),
            (
                [spoilt, spoilt, spoilt, empty, empty, empty, empty, empty],
                None,
            ),
        ];
        for (words, expected) in cases {
            assert_eq!(slot(|slot| words[slot]), expected, "{words:x?}");
        }
    }

    #[test]
    fn a_record_has_a_sector_behind_the_vectors() {
        assert_eq!([0, 2, 3, 4].map(sector), [3, 3, 4, 5]);
    }
}
