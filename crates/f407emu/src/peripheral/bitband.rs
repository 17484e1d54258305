//! Bit banding (RM0090 section 2.3.3; DDI 0439, 3.7): each bit of the first MB of SRAM and of the
//! peripherals has a word of its own, an alias, 32 MB further up.
//!
//! `alias = alias base + byte offset × 32 + bit × 4`

/// The bit that an alias address stands for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Bit {
    /// The address of the word that holds the bit.
    pub(crate) word: u32,
    /// The number of the bit in that word.
    pub(crate) index: u32,
}

impl Bit {
    /// The bit in a word's value: 0 or 1.
    pub(crate) fn of(self, word: u32) -> u32 {
        word >> self.index & 1
    }

    /// The word with this bit set to the lowest bit of `value`.
    pub(crate) fn set(self, word: u32, value: u32) -> u32 {
        word & !(1 << self.index) | (value & 1) << self.index
    }
}

/// The bit that an address stands for; `None` if it is no alias.
pub(crate) fn bit(address: u32) -> Option<Bit> {
    let base = match address {
        0x2200_0000..=0x23FF_FFFF | 0x4200_0000..=0x43FF_FFFF => address & 0xF000_0000,
        _ => return None,
    };
    let number = (address & 0x01FF_FFFF) / 4;
    Some(Bit {
        word: base + number / 32 * 4,
        index: number % 32,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manuals_example_is_bit_2_of_the_byte_at_0x20000300() {
        let bit = bit(0x2200_6008).unwrap();
        assert_eq!((bit.word, bit.index), (0x2000_0300, 2));
    }

    #[test]
    fn clock_enables_are_reached_through_their_aliases() {
        // RCC_AHB1ENR (0x40023830), GPIOEEN (bit 4)
        let alias = 0x4200_0000 + 0x23830 * 32 + 4 * 4;
        let bit = bit(alias).unwrap();
        assert_eq!((bit.word, bit.index), (0x4002_3830, 4));
        assert_eq!(bit.set(0, 1), 0x10);
        assert_eq!(bit.of(0x10), 1);
    }

    #[test]
    fn ordinary_addresses_are_no_alias() {
        assert_eq!(bit(0x2000_0000), None);
        assert_eq!(bit(0x4400_0000), None);
    }
}
