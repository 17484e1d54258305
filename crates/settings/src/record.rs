//! The format in which values are written down.
//!
//! ```text
//! area   = header { record } commit { record } erased
//! header = "LS" version:2 sequence:4 crc32:4
//! record = key:2 length:1 crc8:1 payload 0xFF … to a multiple of 4 crc32:4
//! commit = a record of key 0xFFFE without payload
//! ```
//!
//! The number behind a colon is a length in bytes. Numbers are little endian. The CRC-32 of the
//! header is made of the 8 bytes before it, the CRC-32 of a record is made of key, length and
//! payload. The header of a record (key and length) has a checksum of its own, the CRC-8, so that
//! the next record is found even if a payload is damaged. The CRC-32 is ISO-HDLC's (Ethernet, zip),
//! the CRC-8 SMBus's.

use super::table::{AxisSetting, Setting};
use super::values::MAX_AXES;
use crc::{Crc, CRC_32_ISO_HDLC, CRC_8_SMBUS};
use heapless::Vec;
use leadscrew_gcode::Number;
use leadscrew_interpreter::OffsetId;
use leadscrew_protocol::system_command::STARTUP_LINES;

/// Version of the format. Another one is not read.
pub const VERSION: u16 = 1;

/// Records of the largest machine: its settings, offsets, startup lines and the text of `$I`.
pub const MAX_RECORDS: usize = Setting::ALL.len()
    + MAX_AXES * AxisSetting::ALL.len()
    + OffsetId::ALL.len()
    + STARTUP_LINES as usize
    + 1;

/// The longest payload in bytes: a startup line, or numbers of nine axes.
pub const MAX_PAYLOAD: usize = 80;

/// Bytes of the header of an area.
pub(super) const AREA_HEADER: usize = 12;
/// Bytes of the header of a record.
pub(super) const RECORD_HEADER: usize = 4;
/// Bytes of a record besides its payload.
pub(super) const OVERHEAD: usize = RECORD_HEADER + 4;

/// The key of the record that ends the copies of a rewrite.
pub(super) const COMMIT: u16 = 0xfffe;

const MAGIC: [u8; 2] = *b"LS";
const CRC_32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC_8: Crc<u8> = Crc::<u8>::new(&CRC_8_SMBUS);

/// A payload in memory.
pub type Payload = Vec<u8, MAX_PAYLOAD>;
/// A whole record in memory.
pub(super) type Record = Vec<u8, { MAX_PAYLOAD + OVERHEAD }>;

/// The contents of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum RecordKey {
    /// A setting, by its number: one number.
    Setting(u16),
    /// G54 (0) to G59 (5), G28 (6), G30 (7): a number for each axis.
    Offset(u8),
    /// A startup line.
    Startup(u8),
    /// The text of `$I=`.
    Build,
}

impl RecordKey {
    /// Returns the number that stands for the key in the store.
    pub const fn code(self) -> u16 {
        match self {
            Self::Setting(number) => number & 0x0fff, // settings have three digits
            Self::Offset(index) => 0x1000 + index as u16,
            Self::Startup(index) => 0x2000 + index as u16,
            Self::Build => 0x3000,
        }
    }

    /// Finds the key of a number in the store.
    pub fn from_code(code: u16) -> Option<Self> {
        let index = code as u8;
        let key = match code >> 12 {
            0 => Self::Setting(code),
            1 => Self::Offset(index),
            2 => Self::Startup(index),
            3 => Self::Build,
            _ => return None,
        };
        (key.code() == code).then_some(key)
    }
}

/// Encodes numbers as a payload. Ten fit; more are left out.
pub fn encode_numbers(numbers: &[Number]) -> Payload {
    numbers
        .iter()
        .flat_map(|number| number.nanos().to_le_bytes())
        .take(MAX_PAYLOAD)
        .collect()
}

/// Decodes the numbers of a payload; `None` unless there are `N` of them.
pub fn decode_numbers<const N: usize>(payload: &[u8]) -> Option<[Number; N]> {
    let (chunks, rest) = payload.as_chunks::<8>();
    if chunks.len() != N || !rest.is_empty() {
        return None;
    }
    let mut numbers = [Number::from_int(0); N];
    for (number, chunk) in numbers.iter_mut().zip(chunks) {
        *number = Number::from_nanos(i64::from_le_bytes(*chunk));
    }
    Some(numbers)
}

/// Makes the header of an area.
pub(super) fn area_header(sequence: u32) -> [u8; AREA_HEADER] {
    let [m0, m1] = MAGIC;
    let [v0, v1] = VERSION.to_le_bytes();
    let [s0, s1, s2, s3] = sequence.to_le_bytes();
    let [c0, c1, c2, c3] = CRC_32
        .checksum(&[m0, m1, v0, v1, s0, s1, s2, s3])
        .to_le_bytes();
    [m0, m1, v0, v1, s0, s1, s2, s3, c0, c1, c2, c3]
}

/// The header of an area.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AreaHeader {
    /// Written by this version.
    Valid { sequence: u32 },
    /// Written by another version.
    Foreign,
    /// Damaged, unfinished or erased.
    Invalid,
}

impl AreaHeader {
    pub(super) fn read(bytes: &[u8; AREA_HEADER]) -> Self {
        let [m0, m1, v0, v1, s0, s1, s2, s3, checksum @ ..] = *bytes;
        let computed = CRC_32.checksum(&[m0, m1, v0, v1, s0, s1, s2, s3]);
        if [m0, m1] != MAGIC || u32::from_le_bytes(checksum) != computed {
            Self::Invalid
        } else if u16::from_le_bytes([v0, v1]) != VERSION {
            Self::Foreign
        } else {
            let sequence = u32::from_le_bytes([s0, s1, s2, s3]);
            Self::Valid { sequence }
        }
    }
}

/// Makes a record; `None` if the payload is too long.
pub(super) fn record(code: u16, payload: &[u8]) -> Option<Record> {
    let length = u8::try_from(payload.len()).ok()?;
    let [k0, k1] = code.to_le_bytes();
    let head = [k0, k1, length];
    let mut record = Record::new();
    record.extend_from_slice(&head).ok()?;
    record.push(CRC_8.checksum(&head)).ok()?;
    record.extend_from_slice(payload).ok()?;
    record
        .resize(RECORD_HEADER + padded(payload.len()), 0xff)
        .ok()?;
    record
        .extend_from_slice(&checksum(head, payload).to_le_bytes())
        .ok()?;
    Some(record)
}

/// The header of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordHeader {
    pub(super) code: u16,
    pub(super) length: u8,
}

impl RecordHeader {
    /// Reads a header; `None` when it is damaged, unfinished or erased.
    pub(super) fn read([k0, k1, length, check]: [u8; RECORD_HEADER]) -> Option<Self> {
        let sound =
            CRC_8.checksum(&[k0, k1, length]) == check && usize::from(length) <= MAX_PAYLOAD;
        sound.then_some(Self {
            code: u16::from_le_bytes([k0, k1]),
            length,
        })
    }

    /// Returns the length of the whole record in bytes.
    pub(super) fn size(self) -> usize {
        OVERHEAD + padded(usize::from(self.length))
    }

    /// Returns the payload out of the bytes after the header, if its checksum is right.
    pub(super) fn payload(self, body: &[u8]) -> Option<&[u8]> {
        let (payload, rest) = body.split_at_checked(usize::from(self.length))?;
        let stated = u32::from_le_bytes(*rest.last_chunk()?);
        let [k0, k1] = self.code.to_le_bytes();
        (checksum([k0, k1, self.length], payload) == stated).then_some(payload)
    }
}

fn checksum(head: [u8; 3], payload: &[u8]) -> u32 {
    let mut digest = CRC_32.digest();
    digest.update(&head);
    digest.update(payload);
    digest.finalize()
}

/// Returns how many bytes a payload of this length takes in the store.
const fn padded(length: usize) -> usize {
    length.next_multiple_of(4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn checksums_are_those_of_the_standards() {
        assert_eq!(CRC_32.checksum(b"123456789"), 0xcbf4_3926);
        assert_eq!(CRC_8.checksum(b"123456789"), 0xf4);
    }

    #[test]
    fn an_erased_header_is_none() {
        assert_eq!(RecordHeader::read([0xff; 4]), None);
        assert_eq!(AreaHeader::read(&[0xff; AREA_HEADER]), AreaHeader::Invalid);
    }

    #[test]
    fn another_version_is_told_from_damage() {
        let mut header = area_header(7);
        assert_eq!(AreaHeader::read(&header), AreaHeader::Valid { sequence: 7 });
        header[2] += 1;
        let checksum = CRC_32.checksum(&header[..8]).to_le_bytes();
        header[8..].copy_from_slice(&checksum);
        assert_eq!(AreaHeader::read(&header), AreaHeader::Foreign);
        header[4] ^= 1;
        assert_eq!(AreaHeader::read(&header), AreaHeader::Invalid);
    }

    #[test]
    fn a_payload_too_long_makes_no_record() {
        assert!(record(1, &[0; MAX_PAYLOAD]).is_some());
        assert!(record(1, &[0; MAX_PAYLOAD + 1]).is_none());
    }

    #[test]
    fn numbers_read_back_only_in_their_count() {
        let numbers = [1, -2, 3].map(Number::from_int);
        let payload = encode_numbers(&numbers);
        assert_eq!(decode_numbers(&payload), Some(numbers));
        assert_eq!(decode_numbers::<2>(&payload), None);
        assert_eq!(decode_numbers::<3>(&payload[1..]), None);
    }

    proptest! {
        #[test]
        fn keys_and_codes_are_each_other_s_inverse(code in any::<u16>()) {
            if let Some(key) = RecordKey::from_code(code) {
                prop_assert_eq!(key.code(), code);
            }
        }

        #[test]
        fn records_read_back_and_no_damaged_byte_goes_unnoticed(
            code in 0..COMMIT, payload in prop::collection::vec(any::<u8>(), 0..=MAX_PAYLOAD), at in any::<usize>(), flip in 1..=255_u8,
        ) {
            let mut record = record(code, &payload).unwrap();
            let read = |record: &Record| {
                let header = RecordHeader::read(*record.first_chunk().unwrap())?;
                (header.size() == record.len()).then_some(())?;
                header.payload(&record[RECORD_HEADER..]).map(<[u8]>::to_vec)
            };
            prop_assert_eq!(read(&record), Some(payload.clone()));
            let at = at % record.len();
            record[at] ^= flip;
            let padding = RECORD_HEADER + payload.len()..record.len() - 4;
            prop_assert_eq!(read(&record).is_some(), padding.contains(&at));
        }
    }
}
