//! USB OTG FS (RM0090 section 34.16). The registers of the host mode are not modelled.
use super::{mixed, passing, ro, rw, with_ones, Peripheral, Register, ALL as EVERY, LOWER};

const GLOBAL: &[Register] = &[
    mixed(0x000, 0x000F_0F03, 0xE02),                // GOTGCTL
    rw(0x004, 0x000E_0304),                          // GOTGINT
    rw(0x008, 0x181),                                // GAHBCFG
    mixed(0x00C, 0xE000_3F07, 0xE000_3F47),          // GUSBCFG
    mixed(0x010, 0x8000_07F7, 0x7F7),                // GRSTCTL
    passing(mixed(0x014, 0xF73C_FCFF, 0xF030_FC0A)), // GINTSTS: the driver clears it with all ones
    rw(0x018, 0xF73E_FCFE),                          // GINTMSK
    ro(0x01C, 0x01FF_FFFF),                          // GRXSTSR
    ro(0x020, 0x01FF_FFFF),                          // GRXSTSP
    rw(0x024, LOWER),                                // GRXFSIZ
    rw(0x028, EVERY),                                // DIEPTXF0
    ro(0x02C, 0x7FFF_FFFF),                          // GNPTXSTS
    rw(0x038, 0x003D_0000),                          // GCCFG
    rw(0x03C, EVERY),                                // CID
    rw(0x100, EVERY),                                // HPTXFSIZ
    rw(0x104, EVERY),                                // DIEPTXF1
    rw(0x108, EVERY),                                // DIEPTXF2
    rw(0x10C, EVERY),                                // DIEPTXF3
];

/// An endpoint other than 0: control, interrupts (which the driver clears by writing ones), size;
/// for IN endpoints also the free room in the FIFO.
const IN: [Register; 4] = [
    mixed(0x00, 0xC3EF_87FF, 0xFFEC_87FF),
    passing(mixed(0x08, 0xDB, 0x5B)),
    rw(0x10, 0x7FFF_FFFF),
    ro(0x18, LOWER),
];
const OUT: [Register; 3] = [
    mixed(0x00, 0xC03F_87FF, 0xFC3C_87FF),
    passing(rw(0x08, 0x5B)),
    rw(0x10, 0x7FFF_FFFF),
];

/// The bits of DCFG. The driver also sets XCVRDLY, a bit that only other controllers of the family
/// have.
const DCFG: Register = passing(with_ones(rw(0x000, 0x1FF7), 0x0220_0000));

const DEVICE: &[Register] = &{
    let mut all = [ro(0, 0); 10 + 16 + 12];
    let first = [
        DCFG,
        mixed(0x004, 0xFFF, 0xFF3),              // DCTL
        with_ones(ro(0x008, 0x003F_FF0F), 0x10), // DSTS
        rw(0x010, 0x7B),                         // DIEPMSK
        rw(0x014, 0x1B),                         // DOEPMSK
        ro(0x018, EVERY),                        // DAINT
        rw(0x01C, EVERY),                        // DAINTMSK
        rw(0x028, LOWER),                        // DVBUSDIS
        rw(0x02C, 0xFFF),                        // DVBUSPULSE
        rw(0x034, LOWER),                        // DIEPEMPMSK
    ];
    let mut place = 0;
    while place < first.len() {
        all[place] = first[place];
        place += 1;
    }
    let mut number = 0;
    while number < 16 {
        all[10 + number] = IN[number % 4];
        all[10 + number].offset += 0x100 + 0x20 * (number as u32 / 4);
        number += 1;
    }
    number = 0;
    while number < 12 {
        all[26 + number] = OUT[number % 3];
        all[26 + number].offset += 0x300 + 0x20 * (number as u32 / 3);
        number += 1;
    }
    // Endpoint 0 has a type, a direction and packet sizes of its own.
    all[10] = mixed(0x100, 0xC3EE_8003, 0x8FE0_0003);
    all[12] = rw(0x110, 0x0018_007F);
    all[26] = mixed(0x300, 0xC03E_8003, 0x8C30_0000);
    all[28] = rw(0x310, 0x6008_007F);
    all
};

/// The register of power and clock gating, PCGCCTL.
const POWER: &[Register] = &[rw(0x0, 0x13)];

/// A word of a FIFO, at any of its addresses.
const FIFO: &[Register] = &[rw(0x0, EVERY)];

/// The addresses of the registers, without the FIFOs.
#[cfg(test)]
pub(super) const ALL: [Peripheral; 3] = [
    (0x5000_0000, GLOBAL),
    (0x5000_0800, DEVICE),
    (0x5000_0E00, POWER),
];

/// The group of registers around an address, and its first address.
pub(super) fn registers(address: u32) -> Peripheral {
    match address & 0x3_FFFF {
        0x000..=0x3FF => (0x5000_0000, GLOBAL),
        0x800..=0xDFF => (0x5000_0800, DEVICE),
        0xE00..=0xE03 => (0x5000_0E00, POWER),
        0x1000..=0x4FFF => (address & !3, FIFO),
        _ => (address & !0x3FF, &[]),
    }
}
