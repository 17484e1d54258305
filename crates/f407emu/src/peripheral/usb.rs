//! USB OTG FS without a cable (RM0090 chapter 34): enough for a driver to start, and to wait for a host for ever.
//!
//! Registers keep what is written. The core is always idle, resets and flushes are over at once, and no event comes.
//!
//! Not modelled: everything else.
use std::collections::HashMap;

/// OTG_FS_GRSTCTL: core soft reset, HCLK soft reset, frame counter reset, receive and transmit FIFO flush.
const SELF_CLEARING: u32 = 1 | 1 << 1 | 1 << 2 | 1 << 4 | 1 << 5;
/// OTG_FS_GRSTCTL.AHBIDL: nothing is under way.
const IDLE: u32 = 1 << 31;
/// OTG_FS_CID after a reset.
const PRODUCT: u32 = 0x1100;

/// The controller's registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct Usb {
    written: HashMap<u32, u32>,
}

impl Usb {
    /// Reads the register at `offset` from 0x50000000.
    pub(crate) fn read(&self, offset: u32) -> u32 {
        let written = self.written.get(&offset).copied();
        match offset {
            0x10 => IDLE | written.unwrap_or(0),
            // Flags of events, in the core, its endpoints and its host ports.
            0x04 | 0x14 | 0x818 | 0x908..=0x9E8 | 0xB08..=0xBE8 if is_flags(offset) => 0,
            0x3C => written.unwrap_or(PRODUCT),
            _ => written.unwrap_or(0),
        }
    }

    /// Writes the register at `offset` from 0x50000000.
    pub(crate) fn write(&mut self, offset: u32, value: u32) {
        let kept = match offset {
            0x10 => value & !(SELF_CLEARING | IDLE),
            _ => value,
        };
        self.written.insert(offset, kept);
    }
}

/// The endpoints' flags stand at 0x08 of each 0x20 bytes.
fn is_flags(offset: u32) -> bool {
    offset < 0x900 || offset & 0x1F == 8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_that_waits_for_a_reset_goes_on() {
        let mut usb = Usb::default();
        assert_eq!(usb.read(0x10), IDLE);
        usb.write(0x10, 1 | 1 << 4 | 1 << 5 | 0x10 << 6);
        assert_eq!(usb.read(0x10), IDLE | 0x10 << 6);
    }

    #[test]
    fn no_event_ever_comes() {
        let mut usb = Usb::default();
        for offset in [0x14, 0x818, 0x908, 0xB08] {
            usb.write(offset, u32::MAX);
            assert_eq!(usb.read(offset), 0, "{offset:#x}");
        }
        usb.write(0xB00, 0x8040);
        assert_eq!(usb.read(0xB00), 0x8040);
    }
}
