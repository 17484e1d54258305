//! Loads and stores of registers: the only module that uses addresses.
#![allow(unsafe_code)]

/// A register of the chip.
#[derive(Clone, Copy)]
pub(crate) struct Register(u32);

impl Register {
    /// The register at `offset` in the peripheral at `base`.
    ///
    /// Use it only in constants of this crate, so that each address can be checked where it is
    /// written.
    pub(crate) const fn at(base: u32, offset: u32) -> Self {
        Self(base + offset)
    }

    /// Loads the register.
    pub(crate) fn read(self) -> u32 {
        // SAFETY: the constants of this crate name registers of the chip, which are aligned words.
        unsafe { (self.0 as *const u32).read_volatile() }
    }

    /// Stores into the register.
    pub(crate) fn write(self, value: u32) {
        // SAFETY: as in `read`. A store to these registers changes no memory of the program.
        unsafe { (self.0 as *mut u32).write_volatile(value) }
    }

    /// Sets these bits. Two contexts must not use it on the same register.
    pub(crate) fn set(self, bits: u32) {
        self.write(self.read() | bits);
    }
}
