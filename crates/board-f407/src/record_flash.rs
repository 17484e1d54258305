//! A record that comes over a line is kept in the flash beside the one in force. The latter stays
//! in force until the new one has been read back.
//!
//! The first word of the new record is written last: without it the record in front stays in force.
//! If the supply fails in between, the next attempt gives the place up. The sector has eight
//! places, and nothing is erased. Once they are full, a record has to be flashed from outside.
use crate::{
    fast_memory, profile,
    settings_flash::{program, FlashError},
};
use leadscrew_record::{Incoming, SLOT, SLOTS};

/// Words of a place.
const WORDS: usize = SLOT / 4;
/// The mark of a place that is given up.
const SPOILT: [u8; 4] = [0; 4];

/// Keeps a record, and returns the operator's message: `Ok` if it is stored, else why not. Main
/// loop, at rest: 16 µs a word.
pub(crate) fn keep(record: &Incoming) -> Result<&'static str, &'static str> {
    let record = record.bytes();
    if let Err(refusal) = profile::check(record) {
        return Err(refusal.text());
    }
    match write(record) {
        Ok(()) => Ok("Board record stored: reset the board, then it counts"),
        Err(FlashError::OutOfBounds) => Err("No place for a ninth record: flash it from outside"),
        Err(FlashError::Refused) => Err("The flash refuses the record"),
    }
}

fn write(record: &[u8]) -> Result<(), FlashError> {
    let place = free_place()?;
    let begin = fast_memory::record(place).as_ptr() as usize;
    let (first, rest) = record.split_at_checked(4).ok_or(FlashError::Refused)?;
    program(begin + 4, rest)?;
    ensure_reads(place, 1, rest)?;
    program(begin, first)?;
    ensure_reads(place, 0, first)
}

/// The first place that is empty. Marks a place as given up if its first word is empty and another
/// word is not.
fn free_place() -> Result<usize, FlashError> {
    for place in 0..SLOTS {
        let is_empty = |word| fast_memory::record_word(place, word) == u32::MAX;
        if (0..WORDS).all(is_empty) {
            return Ok(place);
        }
        if is_empty(0) {
            program(fast_memory::record(place).as_ptr() as usize, &SPOILT)?;
        }
    }
    Err(FlashError::OutOfBounds)
}

/// Returns an error unless the flash has these bytes from word `begin` of a place on.
fn ensure_reads(place: usize, begin: usize, bytes: &[u8]) -> Result<(), FlashError> {
    let (words, _) = bytes.as_chunks::<4>();
    let mut read = words.iter().zip(begin..);
    let same =
        read.all(|(word, at)| fast_memory::record_word(place, at) == u32::from_le_bytes(*word));
    same.then_some(()).ok_or(FlashError::Refused)
}
