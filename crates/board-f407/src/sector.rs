//! The sectors of the flash.

/// A sector of the flash.
#[derive(Clone, Copy)]
pub(crate) struct Sector(pub(crate) u8);

impl Sector {
    /// Sector `number` of the F407: 0 to 11 (RM0090 table 5).
    #[cfg(not(record))]
    pub(crate) const fn new(number: u8) -> Self {
        assert!(number < 12);
        Self(number)
    }

    /// The sector that begins at an address; the last one if none does.
    #[cfg(record)]
    pub(crate) fn at(address: usize) -> Self {
        let number = (0..12).find(|number| Self(*number).address() == address);
        Self(number.unwrap_or(11))
    }

    /// The first sector that does not begin below an address; 12 if none does.
    #[cfg(record)]
    pub(crate) fn behind(address: usize) -> Self {
        let number = (0..12).find(|number| Self(*number).address() >= address);
        Self(number.unwrap_or(12))
    }

    /// Its first byte: four sectors of 16 KiB, one of 64 KiB, seven of 128 KiB.
    pub(crate) const fn address(self) -> usize {
        let offset = match self.0 {
            small @ 0..=3 => small as usize * 0x4000,
            4 => 0x1_0000,
            large => (large as usize - 4) * 0x2_0000,
        };
        0x0800_0000 + offset
    }
}
