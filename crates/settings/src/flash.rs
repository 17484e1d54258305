//! The memory under a store of settings.

/// One of the two areas that are used in turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Area {
    /// Used first.
    First,
    /// Used second.
    Second,
}

impl Area {
    /// Returns the other area.
    pub const fn other(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
        }
    }
}

/// Memory of two areas of one size. Each is erased as a whole and then written once, byte after
/// byte: two sectors of flash, or two files.
///
/// Called from the main loop with the machine at rest: a flash may stall the CPU while it erases.
pub trait SettingsStore {
    /// The reason why an access failed.
    type Error: core::fmt::Debug;

    /// Returns the size of each area in bytes, at least 1024 and a multiple of 4. No more
    /// than the first 256 KiB of an area are used.
    fn size(&self) -> usize;

    /// Reads `bytes` from `offset` on. Bytes that were not written since the erase read as 0xFF.
    ///
    /// # Errors
    ///
    /// The memory could not be read.
    fn read(&mut self, area: Area, offset: usize, bytes: &mut [u8]) -> Result<(), Self::Error>;

    /// Writes `bytes` from `offset` on, in this order. Offset and length are multiples of 4, and
    /// none of these bytes was written since the erase.
    ///
    /// # Errors
    ///
    /// The memory could not be written; any of the bytes may have been written.
    fn write(&mut self, area: Area, offset: usize, bytes: &[u8]) -> Result<(), Self::Error>;

    /// Erases an area: all its bytes become 0xFF.
    ///
    /// # Errors
    ///
    /// The memory could not be erased; the area may hold anything.
    fn erase(&mut self, area: Area) -> Result<(), Self::Error>;
}
