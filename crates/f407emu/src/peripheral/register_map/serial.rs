//! The serial ports, and the DMA controllers that carry their bytes.
use super::{mixed, ro, rw, wo, Register, ALL, LOWER};

/// The registers of a USART (RM0090 section 30.6).
pub(super) const USART: &[Register] = &[
    mixed(0x00, 0x3FF, 0x360), // SR
    rw(0x04, 0x1FF),           // DR
    rw(0x08, LOWER),           // BRR
    rw(0x0C, 0xBFFF),          // CR1
    rw(0x10, 0x7F6F),          // CR2
    rw(0x14, 0xFFF),           // CR3
    rw(0x18, LOWER),           // GTPR
];

/// The flags of four streams.
const FLAGS: u32 = 0x0F7D_0F7D;
const STREAM: [Register; 6] = [
    rw(0x10, 0x0FEF_FFFF),   // CR
    rw(0x14, LOWER),         // NDTR
    rw(0x18, ALL),           // PAR
    rw(0x1C, ALL),           // M0AR
    rw(0x20, ALL),           // M1AR
    mixed(0x24, 0xBF, 0x87), // FCR
];

/// The registers of a DMA controller (RM0090 section 10.5).
pub(super) const DMA: &[Register] = &{
    let mut all = [ro(0x0, FLAGS); 52];
    all[1] = ro(0x4, FLAGS);
    all[2] = wo(0x8, FLAGS);
    all[3] = wo(0xC, FLAGS);
    let mut place = 4;
    while place < all.len() {
        let stream = (place - 4) as u32 / 6;
        all[place] = STREAM[(place - 4) % 6];
        all[place].offset += 0x18 * stream;
        place += 1;
    }
    all
};
