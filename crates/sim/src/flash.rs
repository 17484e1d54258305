//! The machine's flash memory, kept in this computer's memory.

use leadscrew_machine::settings::flash::{Area, SettingsStore};
use std::convert::Infallible;

/// Size of an area, bytes: a small sector of the F407 (RM0090, table 5).
const AREA: usize = 16 * 1024;

/// Two areas, as a board has them.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Flash {
    bytes: Vec<u8>,
    changed: bool,
}

impl Flash {
    /// Size of both areas, bytes.
    pub const SIZE: usize = 2 * AREA;

    /// Makes a flash memory that was never written.
    pub fn blank() -> Self {
        Self::new(vec![0xFF; Self::SIZE])
    }

    /// Makes a flash memory that holds [`Flash::SIZE`] bytes.
    pub fn new(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            changed: false,
        }
    }

    /// Returns true if any byte has changed since the last call.
    pub fn changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Returns all its bytes.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn area(&mut self, area: Area) -> &mut [u8] {
        let (first, second) = self.bytes.split_at_mut(AREA);
        match area {
            Area::First => first,
            Area::Second => second,
        }
    }
}

impl SettingsStore for Flash {
    type Error = Infallible;

    fn size(&self) -> usize {
        AREA
    }

    fn read(&mut self, area: Area, offset: usize, bytes: &mut [u8]) -> Result<(), Infallible> {
        bytes.copy_from_slice(&self.area(area)[offset..offset + bytes.len()]);
        Ok(())
    }

    fn write(&mut self, area: Area, offset: usize, bytes: &[u8]) -> Result<(), Infallible> {
        self.area(area)[offset..offset + bytes.len()].copy_from_slice(bytes);
        self.changed = true;
        Ok(())
    }

    fn erase(&mut self, area: Area) -> Result<(), Infallible> {
        self.area(area).fill(0xFF);
        self.changed = true;
        Ok(())
    }
}
