//! The table that makes a board's outputs safe. The first instructions after a reset execute it,
//! before there is memory to compute in.
use zerocopy::{
    little_endian::{U16, U32},
    FromBytes, Immutable, IntoBytes, KnownLayout,
};

/// The number of ports: A to G.
pub const PORTS: usize = 7;

/// The pins of one port that could do harm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct SafePort {
    /// The safe levels of these pins, as BSRR takes them (RM0090 section 8.4.7).
    pub levels: U32,
    /// Both bits of each pin, as in MODER and OSPEEDR (sections 8.4.1 and 8.4.3).
    pub fields: U32,
    /// A bit for each pin, as in OTYPER (section 8.4.2).
    pub pins: U16,
    /// 0 to 6: A to G.
    pub port: U16,
}

impl SafePort {
    /// Adds a pin, and the level at which it is safe.
    fn add(&mut self, number: u8, high: bool) {
        let level = if high {
            1 << number
        } else {
            1 << (number + 16)
        };
        self.levels = U32::new(self.levels.get() | level);
        self.fields = U32::new(self.fields.get() | 0b11 << (2 * number));
        self.pins = U16::new(self.pins.get() | 1 << number);
    }
}

/// The pins of all ports that could do harm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[repr(C)]
pub struct SafeTable {
    /// The number of ports in use.
    count: U32,
    ports: [SafePort; PORTS],
}

impl SafePort {
    const NONE: Self = Self {
        levels: U32::ZERO,
        fields: U32::ZERO,
        pins: U16::ZERO,
        port: U16::ZERO,
    };
}

impl SafeTable {
    /// No pins.
    pub const NONE: Self = Self {
        count: U32::ZERO,
        ports: [SafePort::NONE; PORTS],
    };

    /// Returns the table for pins, from port, number and safe level of each. Its ports are in the
    /// order of their first pins.
    #[must_use]
    pub fn new(pins: impl Iterator<Item = (u8, u8, bool)>) -> Self {
        let (mut ports, mut count) = ([SafePort::NONE; PORTS], 0);
        for (port, number, high) in pins {
            let known = |one: &SafePort| one.port.get() == u16::from(port);
            let place = ports.iter().take(count).position(known);
            let place = place.unwrap_or(count);
            count = count.max(place + 1);
            if let Some(one) = ports.get_mut(place) {
                one.port = U16::new(port.into());
                one.add(number, high);
            }
        }
        Self {
            count: U32::new(count as u32),
            ports,
        }
    }

    /// Returns the ports in use.
    #[must_use]
    pub fn ports(&self) -> &[SafePort] {
        let count = usize::try_from(self.count.get()).unwrap_or(usize::MAX);
        self.ports.get(..count).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pins_are_gathered_by_port() {
        let table = SafeTable::new([(3, 12, false), (4, 7, false), (3, 0, true)].into_iter());
        let [d, e] = table.ports() else {
            panic!("{table:?}");
        };
        assert_eq!((d.port.get(), e.port.get()), (3, 4));
        assert_eq!(d.levels.get(), 0x1000_0001);
        assert_eq!(d.fields.get(), 0x0300_0003);
        assert_eq!(d.pins.get(), 0x1001);
        assert_eq!(e.levels.get(), 0x0080_0000);
    }

    #[test]
    fn a_table_that_counts_more_ports_than_there_are_has_none() {
        let mut table = SafeTable::new([(3, 12, false)].into_iter());
        table.count = U32::new(PORTS as u32 + 1);
        assert_eq!(table.ports(), []);
    }
}
