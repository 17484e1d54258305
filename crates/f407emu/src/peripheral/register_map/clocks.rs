//! RCC, PWR, the flash interface, the watchdog, the CRC unit.
use super::{mixed, ro, rw, with_ones, wo, Register, ALL};

/// Enables and resets of AHB2: DCMI, RNG, USB OTG FS. The F415 and F417 have CRYP and HASH at bits
/// 4 and 5.
const AHB2: u32 = 0xC1;
const APB1: u32 = 0x36FE_C9FF;

/// The registers of RCC (RM0090 section 7.3).
pub(super) const RCC: &[Register] = &[
    mixed(0x00, 0x0F0F_FFFB, 0x050D_00F9),     // CR
    with_ones(rw(0x04, 0x0F43_7FFF), 1 << 29), // PLLCFGR
    mixed(0x08, 0xFFFF_FCFF, 0xFFFF_FCF3),     // CFGR
    mixed(0x0C, 0x3FBF, 0x00BF_3F00),          // CIR
    rw(0x10, 0x2260_11FF),                     // AHB1RSTR
    rw(0x14, AHB2),                            // AHB2RSTR
    rw(0x18, 1),                               // AHB3RSTR
    rw(0x20, APB1),                            // APB1RSTR
    rw(0x24, 0x0007_5933),                     // APB2RSTR
    rw(0x30, 0x7E74_11FF),                     // AHB1ENR
    rw(0x34, AHB2),                            // AHB2ENR
    rw(0x38, 1),                               // AHB3ENR
    rw(0x40, APB1),                            // APB1ENR
    rw(0x44, 0x0007_5F33),                     // APB2ENR
    rw(0x50, 0x7E67_91FF),                     // AHB1LPENR
    with_ones(rw(0x54, AHB2), 0x30),           // AHB2LPENR
    rw(0x58, 1),                               // AHB3LPENR
    rw(0x60, APB1),                            // APB1LPENR
    rw(0x64, 0x0007_5F33),                     // APB2LPENR
    mixed(0x70, 0x0001_8307, 0x0001_8305),     // BDCR
    mixed(0x74, 0xFF00_0003, 0x0100_0001),     // CSR
    rw(0x80, 0xCFFF_FFFF),                     // SSCGR
    rw(0x84, 0x7000_7FC0),                     // PLLI2SCFGR
];

/// The registers of the CRC unit (RM0090 section 4.4).
pub(super) const CRC: &[Register] = &[
    rw(0x0, ALL),  // DR
    rw(0x4, 0xFF), // IDR
    wo(0x8, 1),    // CR
];

/// The registers of PWR (RM0090 section 5.4).
pub(super) const PWR: &[Register] = &[
    mixed(0x00, 0x43F3, 0x43FF), // CR
    mixed(0x04, 0x430F, 0x300),  // CSR
];

/// The registers of the flash interface (RM0090 section 3.9).
pub(super) const FLASH: &[Register] = &[
    mixed(0x00, 0x1707, 0x1F07),    // ACR
    wo(0x04, ALL),                  // KEYR
    wo(0x08, ALL),                  // OPTKEYR
    mixed(0x0C, 0x0001_00F3, 0xF3), // SR
    rw(0x10, 0x8301_037F),          // CR
    rw(0x14, 0x0FFF_FFEF),          // OPTCR
];

/// The registers of the watchdog (RM0090 section 21.4).
pub(super) const IWDG: &[Register] = &[
    wo(0x0, 0xFFFF), // KR
    rw(0x4, 7),      // PR
    rw(0x8, 0xFFF),  // RLR
    ro(0xC, 3),      // SR
];
