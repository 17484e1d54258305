//! Flash memory for tests: it enforces the rules of [`SettingsStore`], loses power, and errs
//! without saying so.

use super::{Area, SettingsStore};
use std::{vec, vec::Vec};

/// Bytes that one step of an erase clears.
const BLOCK: usize = 64;

/// Memory of two areas.
#[derive(Clone, Debug)]
pub(crate) struct MockFlash {
    pub(crate) areas: [Vec<u8>; 2],
    /// Bytes that can still be written, and blocks that can be erased, before power is lost.
    pub(crate) fuel: usize,
    /// Bits of the byte under way that stay set when power is lost.
    pub(crate) half_written: u8,
    /// An erase that is cut short leaves cells that read as erased and do not keep what is written
    /// to them.
    pub(crate) weakens: bool,
    /// Bytes written and blocks erased.
    pub(crate) written: usize,
    /// Words that go wrong without a sign, counted as `words` does.
    pub(crate) errs: Vec<usize>,
    /// The number of words that were written.
    pub(crate) words: usize,
    /// Power was lost while an area was erased.
    pub(crate) died_erasing: bool,
    /// Areas whose cells keep nothing.
    pub(crate) weak: [bool; 2],
    /// True if power is off.
    pub(crate) dead: bool,
}

#[derive(Debug, PartialEq)]
pub(crate) struct PowerLost;

impl MockFlash {
    pub(crate) fn new(size: usize) -> Self {
        Self {
            areas: [vec![0xFF; size], vec![0xFF; size]],
            fuel: usize::MAX,
            half_written: 0xFF,
            weakens: false,
            written: 0,
            errs: Vec::new(),
            words: 0,
            died_erasing: false,
            weak: [false; 2],
            dead: false,
        }
    }

    /// Power comes back. The contents of weak cells are gone by then.
    pub(crate) fn restart(&mut self) {
        (self.fuel, self.dead) = (usize::MAX, false);
        for (area, weak) in self.areas.iter_mut().zip(self.weak) {
            if weak {
                area.iter_mut().for_each(|byte| *byte |= 0x24);
            }
        }
    }

    fn burn(&mut self) -> Result<(), PowerLost> {
        self.dead |= self.fuel == 0;
        if self.dead {
            return Err(PowerLost);
        }
        self.fuel -= 1;
        self.written += 1;
        Ok(())
    }

    fn write_word(&mut self, area: Area, offset: usize, word: &[u8]) -> Result<(), PowerLost> {
        let was_dead = self.dead;
        let wrong = if self.errs.contains(&self.words) {
            0x10
        } else {
            0
        };
        self.words += 1;
        for (at, byte) in word.iter().enumerate() {
            let burnt = self.burn();
            let place = &mut self.areas[area as usize][offset + at];
            assert!(was_dead || *place == 0xFF, "written twice");
            match burnt {
                Ok(()) => *place = *byte ^ wrong,
                Err(lost) => {
                    *place &= if was_dead {
                        0xFF
                    } else {
                        *byte | self.half_written
                    };
                    return Err(lost);
                }
            }
        }
        Ok(())
    }
}

impl SettingsStore for MockFlash {
    type Error = PowerLost;

    fn size(&self) -> usize {
        self.areas[0].len()
    }

    fn read(&mut self, area: Area, offset: usize, bytes: &mut [u8]) -> Result<(), PowerLost> {
        bytes.copy_from_slice(&self.areas[area as usize][offset..][..bytes.len()]);
        Ok(())
    }

    fn write(&mut self, area: Area, offset: usize, bytes: &[u8]) -> Result<(), PowerLost> {
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4));
        for (word, bytes) in bytes.chunks_exact(4).enumerate() {
            self.write_word(area, offset + 4 * word, bytes)?;
        }
        Ok(())
    }

    fn erase(&mut self, area: Area) -> Result<(), PowerLost> {
        for start in (0..self.size()).step_by(BLOCK) {
            let was_dead = self.dead;
            if let Err(lost) = self.burn() {
                let cut = !was_dead;
                self.died_erasing |= cut;
                if cut && self.weakens {
                    self.areas[area as usize].fill(0xFF);
                    self.weak[area as usize] = true;
                }
                return Err(lost);
            }
            self.areas[area as usize][start..][..BLOCK].fill(0xFF);
        }
        self.weak[area as usize] = false;
        Ok(())
    }
}
