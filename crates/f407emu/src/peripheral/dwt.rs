//! The cycle counter of the trace unit (DDI 0403, C1.8).
//!
//! Not modelled: comparators and the other counters.

/// DWT_CTRL: the cycle counter is enabled.
const COUNTS: u32 = 1;
/// DWT_CTRL: the number of comparators, four as on the chip.
const COMPARATORS: u32 = 4 << 28;

/// The counter.
#[derive(Clone, Debug)]
pub(crate) struct Dwt {
    control: u32,
    /// If the counter is enabled, the count at cycle 0; otherwise the count itself.
    base: u32,
}

impl Dwt {
    pub(crate) fn new() -> Self {
        Dwt {
            control: COMPARATORS,
            base: 0,
        }
    }

    /// Reads the register at `offset` from 0xE0001000.
    pub(crate) fn read(&self, offset: u32, now: u64) -> u32 {
        match offset {
            0x0 => self.control,
            0x4 => self.count(now),
            _ => 0,
        }
    }

    /// Writes the register at `offset` from 0xE0001000.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) {
        let count = if offset == 0x4 {
            value
        } else {
            self.count(now)
        };
        if offset == 0x0 {
            self.control = value & !(0xF << 28) | COMPARATORS;
        }
        self.base = if self.counts() {
            count.wrapping_sub(now as u32)
        } else {
            count
        };
    }

    fn counts(&self) -> bool {
        self.control & COUNTS != 0
    }

    fn count(&self, now: u64) -> u32 {
        if self.counts() {
            self.base.wrapping_add(now as u32)
        } else {
            self.base
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_counts_while_it_is_enabled_and_keeps_its_count_after() {
        let mut dwt = Dwt::new();
        dwt.write(0x0, COUNTS, 1000);
        assert_eq!(dwt.read(0x4, 1250), 250);
        dwt.write(0x0, 0, 1300);
        assert_eq!(dwt.read(0x4, 9999), 300);
    }

    #[test]
    fn a_count_can_be_written_and_wraps() {
        let mut dwt = Dwt::new();
        dwt.write(0x0, COUNTS, 0);
        dwt.write(0x4, u32::MAX, 10);
        assert_eq!(dwt.read(0x4, 12), 1);
    }
}
