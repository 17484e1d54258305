//! The registers that exist, and for each the bits that a program can read and may write.
//!
//! A bit that is neither read nor written is reserved. A program has to leave it as it was after
//! the reset; otherwise the run stops with an error ([`crate::Stop::Stray`]). The tables are from
//! RM0090. `crate::st_data` compares them, and the effects of the peripherals' registers, with ST's
//! data.
mod clocks;
mod ports;
mod serial;
mod timers;
mod usb;

use super::timer_map::INSTANCES;
use crate::devices::USARTS;

/// A register.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Register {
    /// The offset from the start of its peripheral.
    pub(crate) offset: u32,
    /// The bits that a program can read.
    pub(crate) read: u32,
    /// The bits that a program may write.
    pub(crate) write: u32,
    /// Reserved bits that read as ones, and have to be written as ones.
    pub(crate) ones: u32,
    /// True if writes to reserved bits are ignored: the third-party USB driver makes such writes.
    passes: bool,
}

impl Register {
    /// The reserved bits, which a program has to leave alone.
    pub(crate) fn reserved(&self) -> u32 {
        !(self.read | self.write)
    }

    /// The value that a program reads if the peripheral's value is `value`.
    pub(crate) fn seen(&self, value: u32) -> u32 {
        value & self.read | self.ones
    }

    /// Returns true if a program that writes `value` leaves the reserved bits in `lanes` alone.
    pub(crate) fn allows(&self, value: u32, lanes: u32) -> bool {
        self.passes || (value ^ self.ones) & self.reserved() & lanes == 0
    }
}

const ALL: u32 = u32::MAX;
const LOWER: u32 = 0xFFFF;

/// A register whose bits are both read and written.
const fn rw(offset: u32, bits: u32) -> Register {
    mixed(offset, bits, bits)
}

/// A register whose bits are only read.
const fn ro(offset: u32, bits: u32) -> Register {
    mixed(offset, bits, 0)
}

/// A register whose bits are only written.
const fn wo(offset: u32, bits: u32) -> Register {
    mixed(offset, 0, bits)
}

/// A register with the bits that are read, and the bits that are written.
const fn mixed(offset: u32, read: u32, write: u32) -> Register {
    Register {
        offset,
        read,
        write,
        ones: 0,
        passes: false,
    }
}

/// The same register with reserved bits that are ones.
const fn with_ones(register: Register, ones: u32) -> Register {
    Register { ones, ..register }
}

/// The same register, with writes to reserved bits ignored.
const fn passing(register: Register) -> Register {
    Register {
        passes: true,
        ..register
    }
}

/// A modelled peripheral: its first address and its registers, in the order of their offsets.
type Peripheral = (u32, &'static [Register]);

/// The register at a word's address; `None` if a modelled peripheral has no register.
pub(crate) fn find(address: u32) -> Option<&'static Register> {
    let (base, registers) = peripheral(address)?;
    let offset = address - base;
    let place = registers
        .binary_search_by_key(&offset, |register| register.offset)
        .ok()?;
    registers.get(place)
}

/// Returns true if the peripheral at an address is modelled.
pub(crate) fn is_modelled(address: u32) -> bool {
    peripheral(address).is_some()
}

/// The modelled peripheral that an address belongs to.
fn peripheral(address: u32) -> Option<Peripheral> {
    let base = address & !0x3FF;
    let registers: &'static [Register] = match base {
        0x4002_0000..=0x4002_23FF => ports::GPIO,
        0x4002_3000 => clocks::CRC,
        0x4002_3800 => clocks::RCC,
        0x4002_3C00 => clocks::FLASH,
        0x4002_6000 | 0x4002_6400 => serial::DMA,
        0x4000_3000 => clocks::IWDG,
        0x4000_7000 => clocks::PWR,
        0x4001_2000 => ports::ADC,
        0x4001_3800 => ports::SYSCFG,
        0x4001_3C00 => ports::EXTI,
        0x5000_0000..=0x5003_FFFF => return Some(usb::registers(address)),
        _ => by_table(base)?,
    };
    Some((base, registers))
}

fn by_table(base: u32) -> Option<&'static [Register]> {
    let timer = INSTANCES.iter().position(|timer| timer.base == base);
    match timer {
        Some(index) => Some(timers::OF[index]),
        None => USARTS.contains(&base).then_some(serial::USART),
    }
}

/// Every modelled register, with its address.
#[cfg(test)]
pub(crate) fn all() -> impl Iterator<Item = (u32, &'static Register)> {
    let pages = (0x4000_0000..0x4003_0000)
        .step_by(0x400)
        .filter_map(peripheral);
    pages
        .chain(usb::ALL)
        .flat_map(|(base, registers)| registers.iter().map(move |one| (base + one.offset, one)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_peripherals_registers_are_in_order() {
        let addresses: Vec<u32> = all().map(|(address, _)| address).collect();
        assert!(addresses.is_sorted());
        assert!(addresses.iter().all(|&one| find(one).is_some()));
    }

    #[test]
    fn a_reserved_bit_has_to_stay_as_it_was_after_the_reset() {
        let register = with_ones(rw(0, 0xF), 0x30);
        assert!(register.allows(0x3F, ALL) && !register.allows(0x0F, ALL));
        assert!(!register.allows(0x13F, ALL) && register.allows(0x13F, 0xFF));
        assert_eq!(register.seen(0xFF), 0x3F);
    }

    #[test]
    fn where_a_peripheral_has_no_register_there_is_none() {
        assert_eq!(find(0x4002_0028), None);
        assert_eq!(find(0x4001_4804), None, "TIM11 has no CR2");
        assert!(is_modelled(0x4001_4804) && !is_modelled(0x4001_3000));
    }
}
