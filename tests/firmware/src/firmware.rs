//! The firmware under test, as it was built or with a fault planted in it.
use crate::bench::Failure;
use leadscrew_f407emu::Tamper;
use std::{fs, sync::Arc};

/// Rate of the serial line in baud, unless the firmware is built for another.
const USUAL_BAUD: u32 = 115_200;
/// Rate of the fast line in baud, as `cargo fw-test` builds it.
const FAST_BAUD: u32 = 2_000_000;

/// A fault: words on their way to a register are changed, or get lost.
#[derive(Clone, Copy)]
pub(crate) struct Fault {
    /// The register's address.
    pub(crate) register: u32,
    pub(crate) tamper: Tamper,
}

/// The firmware, built for one rate of its serial line.
#[derive(Clone)]
pub(crate) struct Build {
    pub(crate) elf: Arc<[u8]>,
    /// The line's rate in baud.
    pub(crate) baud: u32,
    /// What is wrong with it from power-up on.
    pub(crate) fault: Option<Fault>,
}

impl Build {
    fn read(path: &str, baud: u32) -> Result<Self, Failure> {
        let elf = fs::read(path).map_err(|error| Failure(format!("{path}: {error}")))?;
        Ok(Build {
            elf: elf.into(),
            baud,
            fault: None,
        })
    }
}

/// The firmware, built twice.
#[derive(Clone)]
pub(crate) struct Firmware {
    /// At 115200 baud.
    pub(crate) usual: Build,
    /// At 2 Mbaud, otherwise the same.
    pub(crate) fast: Build,
}

impl Firmware {
    /// Reads both files.
    pub(crate) fn read(usual: &str, fast: &str) -> Result<Self, Failure> {
        Ok(Firmware {
            usual: Build::read(usual, USUAL_BAUD)?,
            fast: Build::read(fast, FAST_BAUD)?,
        })
    }

    /// The same with a fault.
    pub(crate) fn with(&self, fault: Fault) -> Self {
        let mut faulty = self.clone();
        faulty.usual.fault = Some(fault);
        faulty.fast.fault = Some(fault);
        faulty
    }
}
