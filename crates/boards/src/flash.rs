//! The sectors of the flash (RM0090 table 5).

/// The first address of the flash.
pub(crate) const BEGIN: u32 = 0x0800_0000;

/// A sector.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Sector {
    /// Its first address.
    pub begin: u32,
    /// Its size, bytes.
    pub size: u32,
}

impl Sector {
    /// Returns the sector of this number, 0 to 11: four of 16 KiB, one of 64 KiB, seven of 128 KiB.
    #[must_use]
    pub fn new(number: u8) -> Option<Self> {
        let (kib, size) = match u32::from(number) {
            number @ 0..4 => (16 * number, 16),
            4 => (64, 64),
            number @ 5..12 => (128 * (number - 4), 128),
            _ => return None,
        };
        Some(Sector {
            begin: BEGIN + (kib << 10),
            size: size << 10,
        })
    }

    /// Returns the first address behind the sector.
    #[must_use]
    pub fn end(self) -> u32 {
        self.begin + self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twelve_sectors_are_a_mebibyte_without_a_gap() {
        let sectors: Vec<Sector> = (0..=12).filter_map(Sector::new).collect();
        assert_eq!(sectors.len(), 12);
        assert!(sectors.windows(2).all(|two| two[0].end() == two[1].begin));
        assert_eq!(sectors[11].end(), BEGIN + 0x10_0000);
    }
}
