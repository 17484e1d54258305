//! Settings in any flash of `embedded-storage`.

use core::fmt;
use core::ops::Range;
use embedded_storage::nor_flash::NorFlash;
use leadscrew_machine::settings::flash::{Area, SettingsStore};

/// Two areas of a flash that keep the settings, offsets and texts of a machine.
///
/// Nothing is lost if power goes at any instant: one area is written while the other one stands.
/// The flash writes words of 1, 2 or 4 bytes; one with longer words does not compile.
#[derive(Debug)]
pub struct Flash<F> {
    flash: F,
    /// The first bytes of the areas.
    start: u32,
    /// The size of one area, bytes.
    size: u32,
}

/// The least size of an area.
const LEAST: u32 = 1024;

/// The widest word that a store writes at once.
const WORD: usize = 4;

impl<F: NorFlash> Flash<F> {
    const WORDS_ARE_SHORT: () = assert!(
        F::WRITE_SIZE <= WORD && WORD.is_multiple_of(F::WRITE_SIZE),
        "the flash writes words of more than 4 bytes: give a view of it that writes 4"
    );
    const READS_ARE_SHORT: () = assert!(
        F::READ_SIZE <= WORD && WORD.is_multiple_of(F::READ_SIZE),
        "the flash reads words of more than 4 bytes: give a view of it that reads 4"
    );

    /// Takes the bytes of `range` for settings: two halves, each of whole sectors and at least 1024
    /// bytes. Nothing is written yet.
    ///
    /// # Errors
    /// The range is not that.
    pub fn new(flash: F, range: Range<u32>) -> Result<Self, FlashError> {
        let () = Self::WORDS_ARE_SHORT;
        let () = Self::READS_ARE_SHORT;
        let sector = u32::try_from(F::ERASE_SIZE).unwrap_or(u32::MAX).max(1);
        let size = range.end.saturating_sub(range.start) / 2;
        let is_whole = [range.start, range.end, size].map(|place| place.is_multiple_of(sector));
        if range.end as usize > flash.capacity() {
            Err(FlashError::Beyond(flash.capacity()))
        } else if size < LEAST || is_whole != [true; 3] || !size.is_multiple_of(WORD as u32) {
            Err(FlashError::Sectors(sector))
        } else {
            Ok(Self {
                flash,
                start: range.start,
                size,
            })
        }
    }

    /// The place of a byte of an area; the store asks for none beyond [`SettingsStore::size`].
    fn place(&self, area: Area, offset: usize) -> u32 {
        let area = match area {
            Area::First => 0,
            Area::Second => self.size,
        };
        let offset = u32::try_from(offset).unwrap_or(self.size);
        self.start.saturating_add(area).saturating_add(offset)
    }
}

impl<F: NorFlash> SettingsStore for Flash<F> {
    type Error = F::Error;

    fn size(&self) -> usize {
        self.size as usize
    }

    fn read(&mut self, area: Area, offset: usize, bytes: &mut [u8]) -> Result<(), F::Error> {
        // A flash may read whole words only, from a whole place.
        let mut place = self.place(area, offset);
        let mut rest = bytes;
        while !rest.is_empty() {
            let within = place as usize % WORD;
            let mut word = [0; WORD];
            self.flash.read(place - within as u32, &mut word)?;
            let count = (WORD - within).min(rest.len());
            let (now, later) = rest.split_at_mut(count);
            for (to, from) in now.iter_mut().zip(word.iter().skip(within)) {
                *to = *from;
            }
            place = place.saturating_add(count as u32);
            rest = later;
        }
        Ok(())
    }

    fn write(&mut self, area: Area, offset: usize, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(self.place(area, offset), bytes)
    }

    fn erase(&mut self, area: Area) -> Result<(), F::Error> {
        let start = self.place(area, 0);
        self.flash.erase(start, start + self.size)
    }
}

/// The reason why a range of a flash cannot keep settings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum FlashError {
    /// The range ends beyond the flash, which has this number of bytes.
    Beyond(usize),
    /// Its halves are not whole sectors of this size, or have less than 1024 bytes.
    Sectors(u32),
}

impl fmt::Display for FlashError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Beyond(capacity) => {
                write!(
                    f,
                    "Flash::new: the flash ends at {capacity}; give an earlier range"
                )
            }
            Self::Sectors(sector) => write!(
                f,
                "Flash::new: give a range of two halves, each of whole sectors of {sector} bytes \
                 and of {LEAST} bytes at least"
            ),
        }
    }
}

impl core::error::Error for FlashError {}
