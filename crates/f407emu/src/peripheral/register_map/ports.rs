//! The ports, and the registers that make interrupts of their pins.
use super::{mixed, ro, rw, wo, Register, ALL, LOWER};

/// RM0090 section 8.4.
pub(super) const GPIO: &[Register] = &[
    rw(0x00, ALL),         // MODER
    rw(0x04, LOWER),       // OTYPER
    rw(0x08, ALL),         // OSPEEDR
    rw(0x0C, ALL),         // PUPDR
    ro(0x10, LOWER),       // IDR
    rw(0x14, LOWER),       // ODR
    wo(0x18, ALL),         // BSRR
    rw(0x1C, 0x0001_FFFF), // LCKR
    rw(0x20, ALL),         // AFRL
    rw(0x24, ALL),         // AFRH
];

/// RM0090 section 9.2.
pub(super) const SYSCFG: &[Register] = &[
    rw(0x00, 3),           // MEMRMP
    rw(0x04, 1 << 23),     // PMC
    rw(0x08, LOWER),       // EXTICR1
    rw(0x0C, LOWER),       // EXTICR2
    rw(0x10, LOWER),       // EXTICR3
    rw(0x14, LOWER),       // EXTICR4
    mixed(0x20, 0x101, 1), // CMPCR
];

/// Lines that there are.
const LINES: u32 = 0x007F_FFFF;

/// RM0090 section 12.3.
pub(super) const EXTI: &[Register] = &[
    rw(0x00, LINES), // IMR
    rw(0x04, LINES), // EMR
    rw(0x08, LINES), // RTSR
    rw(0x0C, LINES), // FTSR
    rw(0x10, LINES), // SWIER
    rw(0x14, LINES), // PR
];
