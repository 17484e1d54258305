//! The CRC unit (RM0090 chapter 4): CRC-32 of whole words, the highest bit first.

/// CRC_DR, CRC_IDR and CRC_CR, from the start of the unit's registers.
const DR: u32 = 0x0;
const IDR: u32 = 0x4;
const CR: u32 = 0x8;
/// The CRC after a reset of the unit (section 4.4.1).
const START: u32 = u32::MAX;
/// The polynomial, the same as Ethernet's (section 4.2).
const POLYNOMIAL: u32 = 0x04C1_1DB7;
/// Cycles of HCLK that a word takes (section 4.3): the next access to DR waits for its end.
const WORD: u64 = 4;

/// The unit.
#[derive(Clone)]
pub(crate) struct Crc {
    sum: u32,
    /// A byte for the program's own use.
    kept: u32,
    ready_at: u64,
}

impl Crc {
    /// Makes the unit as it is after a reset.
    pub(crate) fn new() -> Self {
        Self {
            sum: START,
            kept: 0,
            ready_at: 0,
        }
    }

    /// The cycle at which an access that comes now is carried out.
    pub(crate) fn wait(&self, offset: u32, now: u64) -> u64 {
        match offset {
            DR => now.max(self.ready_at),
            _ => now,
        }
    }

    /// Reads a register.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        match offset {
            DR => self.sum,
            IDR => self.kept,
            _ => 0,
        }
    }

    /// Writes a register.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) {
        match offset {
            DR => {
                let bit = |sum: u32, _| (sum << 1) ^ (POLYNOMIAL * (sum >> 31));
                self.sum = (0..32).fold(self.sum ^ value, bit);
                self.ready_at = now + WORD;
            }
            IDR => self.kept = value & 0xFF,
            CR if value & 1 != 0 => self.sum = START,
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_is_the_one_that_catalogues_give() {
        // CRC-32/MPEG-2 of four zeros, by a table-driven program.
        let mut crc = Crc::new();
        crc.write(DR, 0, 0);
        assert_eq!(crc.read(DR), 0xC704_DD7B);
        crc.write(CR, 1, 0);
        assert_eq!(crc.read(DR), START);
    }

    #[test]
    fn a_word_waits_for_the_one_before() {
        let mut crc = Crc::new();
        crc.write(DR, 7, 100);
        assert_eq!((crc.wait(DR, 101), crc.wait(CR, 101)), (104, 101));
        assert_eq!(crc.wait(DR, 110), 110);
    }
}
