//! The firmware under test.
use crate::bench::Failure;
use std::fs;

/// The firmware as it was built, for two rates of its serial line.
pub(crate) struct Firmware {
    /// At 115200 baud.
    pub(crate) elf: Vec<u8>,
    /// At 2 Mbaud, otherwise the same.
    pub(crate) fast: Vec<u8>,
}

impl Firmware {
    /// Reads both files.
    pub(crate) fn read(elf: &str, fast: &str) -> Result<Self, Failure> {
        let read = |path: &str| fs::read(path).map_err(|error| Failure(format!("{path}: {error}")));
        Ok(Firmware {
            elf: read(elf)?,
            fast: read(fast)?,
        })
    }
}
