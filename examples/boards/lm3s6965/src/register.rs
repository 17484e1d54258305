//! Loads and stores of registers: the only place that takes an address.
#![allow(unsafe_code)]

/// A register of the chip.
#[derive(Clone, Copy)]
pub(crate) struct Register(u32);

impl Register {
    /// The register at `offset` in the peripheral at `base`.
    ///
    /// Only in constants of this crate: an address is right or wrong when it is written down.
    pub(crate) const fn at(base: u32, offset: u32) -> Self {
        Self(base + offset)
    }

    /// Loads it.
    pub(crate) fn read(self) -> u32 {
        // SAFETY: the constants of this crate name registers of the chip, which are aligned words.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    /// Stores into it.
    pub(crate) fn write(self, value: u32) {
        // SAFETY: as in `read`; no register of those that are named moves memory.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }

    /// Sets these bits. Not from two contexts.
    pub(crate) fn set(self, bits: u32) {
        self.write(self.read() | bits);
    }
}
