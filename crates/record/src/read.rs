//! Making a record of its content, and reading it again.
use crate::{Content, Head, Record, Setting, Shape, SLOT};
use core::fmt;
use zerocopy::{
    little_endian::{U16, U32},
    FromBytes, IntoBytes,
};

/// `LSBR`.
pub const MAGIC: u32 = u32::from_le_bytes(*b"LSBR");

/// The version of the layout.
pub const VERSION: u16 = 1;

/// In front of the bytes that the checksum protects.
const UNPROTECTED: usize = 8;

/// CRC-32 as in Ethernet and zip, a bit at a time: a crate's takes 0.8 KB of the firmware.
fn checksum(bytes: &[u8]) -> u32 {
    const REFLECTED: u32 = 0xEDB8_8320;
    let bit = |crc: u32, _| (crc >> 1) ^ (REFLECTED * (crc & 1));
    let byte = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte), bit);
    !bytes.iter().fold(u32::MAX, byte)
}

/// Why there is no record in force.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Refusal {
    /// Nothing is there.
    Missing,
    /// It is of another version of the firmware.
    Version,
    /// It says that it is longer or shorter than it can be.
    Length,
    /// A bit is wrong.
    Checksum,
    /// It is for other axes, motors or kinematics.
    Shape,
    /// It keeps its settings where the program is.
    Sectors,
}

impl Refusal {
    /// For the operator.
    #[must_use]
    pub const fn text(self) -> &'static str {
        match self {
            Self::Missing => "no board record: locked",
            Self::Version => "no board record: another version",
            Self::Length => "no board record: wrong length",
            Self::Checksum => "no board record: wrong checksum",
            Self::Shape => "no board record: for other motors",
            Self::Sectors => "no board record: settings in the program",
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
const FIXED: usize = size_of::<Record>();

impl Record {
    /// Makes a record of its content and a new machine's settings, in `bytes`; its length. `None`
    /// where there is no room, or the content counts other settings.
    pub fn pack(content: &Content, defaults: &[Setting], bytes: &mut [u8; SLOT]) -> Option<usize> {
        let length = FIXED + size_of_val(defaults);
        if length > SLOT || usize::from(content.shape.defaults) != defaults.len() {
            return None;
        }
        let mut record = Record {
            head: Head {
                magic: U32::new(MAGIC),
                checksum: U32::ZERO,
                version: U16::new(VERSION),
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

    /// The record that `bytes` begin with, and its settings.
    ///
    /// # Errors
    /// It is not whole, or of another version.
    pub fn read(bytes: &[u8]) -> Result<(&Self, &[Setting]), Refusal> {
        let (record, _) = Self::ref_from_prefix(bytes).map_err(|_| Refusal::Missing)?;
        let head = &record.head;
        if head.magic.get() != MAGIC {
            return Err(Refusal::Missing);
        }
        if head.version.get() != VERSION {
            return Err(Refusal::Version);
        }
        let length = usize::from(head.length.get());
        let settings = bytes.get(FIXED..length).ok_or(Refusal::Length)?;
        let defaults = <[Setting]>::ref_from_bytes(settings).map_err(|_| Refusal::Length)?;
        if defaults.len() != usize::from(record.content.shape.defaults) {
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
    /// Whether it is for an image of this shape that begins in sector `start`.
    ///
    /// # Errors
    /// Why not.
    pub fn fits(&self, shape: Shape, start: u8) -> Result<(), Refusal> {
        let of = |shape: &Shape| [shape.axes, shape.motors, shape.kinematics];
        if of(&self.shape) != of(&shape) {
            return Err(Refusal::Shape);
        }
        match are_clear(self.settings, start) {
            true => Ok(()),
            false => Err(Refusal::Sectors),
        }
    }
}

/// Whether the sectors of the settings are apart from vector table, record and code: between the
/// first two, or behind the code.
fn are_clear([first, second]: [u8; 2], start: u8) -> bool {
    let record = crate::sector(start);
    // The code's 192 KiB: what is left of sector 4, and sectors of 128 KiB.
    let behind = if record < 4 { 6 } else { record + 3 };
    let between = first > start && second < record;
    first.checked_add(1) == Some(second) && (between || first >= behind && second < 12)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_the_one_that_catalogues_give() {
        // "CRC-32/ISO-HDLC" of the catalogue of parametrised CRC algorithms (reveng): its check.
        assert_eq!(checksum(b"123456789"), 0xCBF4_3926);
        assert_eq!(checksum(b""), 0);
    }

    #[test]
    fn settings_are_never_where_the_program_is() {
        for (sectors, start, clear) in [
            ([1, 2], 0, true),
            ([0, 1], 0, false),
            ([2, 3], 0, false),
            ([4, 5], 0, false),
            ([5, 6], 2, false),
            ([6, 7], 2, true),
            ([1, 2], 2, false),
            ([10, 11], 2, true),
            ([11, 12], 2, false),
            ([255, 0], 2, false),
            ([6, 7], 3, false),
            ([7, 8], 3, true),
        ] {
            assert_eq!(are_clear(sectors, start), clear, "{sectors:?} {start}");
        }
    }
}
