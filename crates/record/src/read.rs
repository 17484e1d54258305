//! Makes a record from its content, and reads it again.
use crate::{Content, Head, Image, Record, Setting, MAGIC, OLDEST, SETTINGS, SLOT, VERSION};
use core::fmt;
use zerocopy::{
    little_endian::{U16, U32},
    FromBytes, IntoBytes,
};

/// The number of bytes at the beginning of a record that the checksum does not protect.
pub const UNPROTECTED: usize = 8;

/// Returns the checksum of whole words, as the chip's CRC unit makes it (RM0090 section 4.3):
/// CRC-32 with Ethernet's polynomial, the highest bit of a word first. Bytes behind the last whole
/// word do not count.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    const POLYNOMIAL: u32 = 0x04C1_1DB7;
    let bit = |crc: u32, _| (crc << 1) ^ (POLYNOMIAL * (crc >> 31));
    let (words, _) = bytes.as_chunks::<4>();
    words.iter().fold(u32::MAX, |crc, word| {
        (0..32).fold(crc ^ u32::from_le_bytes(*word), bit)
    })
}

/// The reason why a record is not used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// There is no record.
    Missing,
    /// The record has another version of the layout.
    Version,
    /// The length that the record gives does not fit the number of its settings, or the bytes that
    /// are there.
    Length,
    /// The checksum is wrong: the record is damaged.
    Checksum,
    /// The record is for other axes, motors or kinematics.
    Shape,
    /// The record puts the settings onto the program, or beyond the flash.
    Sectors,
}

impl Refusal {
    /// Returns the operator's message: what is wrong, and what to do. At most 64 characters.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Missing => "No board record, locked: leadscrew board pack, then flash it",
            Self::Version => "Board record of another version, locked: pack and flash it again",
            Self::Length => "Board record has a wrong length, locked: pack and flash it again",
            Self::Checksum => "Board record is damaged, locked: pack and flash it again",
            Self::Shape => "Board record is for other motors, locked: flash their firmware",
            Self::Sectors => "Board record: settings lie in the program, locked: change them",
        }
    }
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl core::error::Error for Refusal {}

/// The bytes of a record without settings.
pub const FIXED: usize = size_of::<Record>();

impl Record {
    /// Makes a record from its content and a new machine's settings, in `bytes`. Returns its length
    /// in bytes. `None` if there are more settings than [`SETTINGS`], or if
    /// `content.shape.defaults` is not their number.
    pub fn pack(content: &Content, defaults: &[Setting], bytes: &mut [u8; SLOT]) -> Option<usize> {
        let length = FIXED + size_of_val(defaults);
        let counted = usize::from(content.shape.defaults) == defaults.len();
        if !counted || defaults.len() > SETTINGS {
            return None;
        }
        let mut record = Record {
            head: Head {
                magic: U32::new(MAGIC),
                checksum: U32::ZERO,
                version: U16::new(content.version()),
                length: U16::new(length as u16),
            },
            content: *content,
        };
        bytes.fill(0xFF);
        bytes[..FIXED].copy_from_slice(record.as_bytes());
        bytes[FIXED..length].copy_from_slice(defaults.as_bytes());
        record.head.checksum = U32::new(checksum(&bytes[UNPROTECTED..length]));
        bytes[..FIXED].copy_from_slice(record.as_bytes());
        Some(length)
    }

    /// Returns the content of a record. This checks nothing: [`Self::read`] must have found the
    /// record whole.
    #[must_use]
    pub fn content(bytes: &[u8; SLOT]) -> &Content {
        Self::ref_from_prefix(bytes).map_or(&Content::NONE, |(record, _)| &record.content)
    }

    /// Returns the record that `bytes` begin with, and its settings.
    ///
    /// # Errors
    /// There is no record, or it is damaged, or its layout has another version.
    pub fn read(bytes: &[u8]) -> Result<(&Self, &[Setting]), Refusal> {
        let (record, _) = Self::ref_from_prefix(bytes).map_err(|_| Refusal::Missing)?;
        let head = &record.head;
        if head.magic.get() != MAGIC {
            return Err(Refusal::Missing);
        }
        if !(OLDEST..=VERSION).contains(&head.version.get()) {
            return Err(Refusal::Version);
        }
        let length = usize::from(head.length.get());
        let settings = bytes.get(FIXED..length).ok_or(Refusal::Length)?;
        let defaults = <[Setting]>::ref_from_bytes(settings).map_err(|_| Refusal::Length)?;
        let counted = defaults.len() == usize::from(record.content.shape.defaults);
        if !counted || defaults.len() > SETTINGS {
            return Err(Refusal::Length);
        }
        let protected = bytes.get(UNPROTECTED..length).unwrap_or_default();
        if checksum(protected) != head.checksum.get() {
            return Err(Refusal::Checksum);
        }
        Ok((record, defaults))
    }
}

impl Content {
    /// Checks that the content is for a machine of `image`, which begins in sector `start`, and
    /// whose last byte is in front of sector `behind`.
    ///
    /// # Errors
    /// The content is for another machine, or the sectors of the settings are in the way of the
    /// program.
    pub fn fits(&self, image: Image, start: u8, behind: u8) -> Result<(), Refusal> {
        if !image.takes(&self.shape) {
            return Err(Refusal::Shape);
        }
        match are_clear(self.settings, start, behind) {
            true => Ok(()),
            false => Err(Refusal::Sectors),
        }
    }
}

/// Returns true if the two sectors of the settings follow each other, and lie between vector table
/// and record, or behind the code and within the flash. `behind` is the first sector behind the
/// code.
fn are_clear([first, second]: [u8; 2], start: u8, behind: u8) -> bool {
    let record = crate::sector(start);
    let between = first > start && second < record;
    first.checked_add(1) == Some(second) && (between || first >= behind && second < 12)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    #[test]
    fn the_checksum_is_the_one_that_catalogues_give() {
        // "CRC-32/MPEG-2" of the catalogue of parametrised CRC algorithms (reveng), which takes
        // bytes; a word's highest byte is its first.
        let catalogue = crc::Crc::<u32>::new(&crc::CRC_32_MPEG_2);
        assert_eq!(checksum(b"43218765"), catalogue.checksum(b"12345678"));
        assert_eq!(checksum(b""), u32::MAX);
    }

    #[test]
    fn the_longest_record_fits_its_place() {
        assert!(FIXED + SETTINGS * size_of::<Setting>() <= SLOT);
    }

    #[test]
    fn a_refusal_fits_a_message_and_holds_no_answer() {
        use Refusal::{Checksum, Length, Missing, Sectors, Shape, Version};
        for refusal in [Missing, Version, Length, Checksum, Shape, Sectors] {
            let text = refusal.text().to_ascii_lowercase();
            let is_answer = text.contains("ok") || text.contains("error");
            assert!(text.len() <= 64 && !is_answer, "{text}");
        }
    }

    #[test]
    fn settings_are_never_where_the_program_is() {
        for (sectors, start, behind, clear) in [
            ([1, 2], 0, 6, true),
            ([1, 2], 0, 12, true),
            ([0, 1], 0, 6, false),
            ([2, 3], 0, 6, false),
            ([4, 5], 0, 6, false),
            ([5, 6], 2, 6, false),
            ([6, 7], 2, 6, true),
            ([6, 7], 2, 7, false),
            ([7, 8], 2, 7, true),
            ([1, 2], 2, 6, false),
            ([10, 11], 2, 10, true),
            ([10, 11], 2, 12, false),
            ([11, 12], 2, 6, false),
            ([255, 0], 2, 6, false),
            ([6, 7], 3, 7, false),
            ([7, 8], 3, 7, true),
        ] {
            let found = are_clear(sectors, start, behind);
            assert_eq!(found, clear, "{sectors:?} {start} {behind}");
        }
    }
}
