//! The GPIO ports, SYSCFG and EXTI, which make interrupts of their pins, and the ADC.
use super::{mixed, ro, rw, wo, Register, ALL, LOWER};

/// The registers of a GPIO port (RM0090 section 8.4).
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

/// The registers of SYSCFG (RM0090 section 9.2).
pub(super) const SYSCFG: &[Register] = &[
    rw(0x00, 3),           // MEMRMP
    rw(0x04, 1 << 23),     // PMC
    rw(0x08, LOWER),       // EXTICR1
    rw(0x0C, LOWER),       // EXTICR2
    rw(0x10, LOWER),       // EXTICR3
    rw(0x14, LOWER),       // EXTICR4
    mixed(0x20, 0x101, 1), // CMPCR
];

/// The lines of EXTI that exist.
const LINES: u32 = 0x007F_FFFF;

/// The registers of EXTI (RM0090 section 12.3).
pub(super) const EXTI: &[Register] = &[
    rw(0x00, LINES), // IMR
    rw(0x04, LINES), // EMR
    rw(0x08, LINES), // RTSR
    rw(0x0C, LINES), // FTSR
    rw(0x10, LINES), // SWIER
    rw(0x14, LINES), // PR
];

/// RM0090 section 13.13: ADC1, followed by the registers that all converters share.
pub(super) const ADC: &[Register] = &[
    rw(0x00, 0x3F),         // SR
    rw(0x04, 0x07C0_FFFF),  // CR1
    rw(0x08, 0x7F7F_0F03),  // CR2
    rw(0x0C, 0x07FF_FFFF),  // SMPR1
    rw(0x10, 0x3FFF_FFFF),  // SMPR2
    rw(0x14, 0xFFF),        // JOFR1
    rw(0x18, 0xFFF),        // JOFR2
    rw(0x1C, 0xFFF),        // JOFR3
    rw(0x20, 0xFFF),        // JOFR4
    rw(0x24, 0xFFF),        // HTR
    rw(0x28, 0xFFF),        // LTR
    rw(0x2C, 0x00FF_FFFF),  // SQR1
    rw(0x30, 0x3FFF_FFFF),  // SQR2
    rw(0x34, 0x3FFF_FFFF),  // SQR3
    rw(0x38, 0x003F_FFFF),  // JSQR
    ro(0x3C, LOWER),        // JDR1
    ro(0x40, LOWER),        // JDR2
    ro(0x44, LOWER),        // JDR3
    ro(0x48, LOWER),        // JDR4
    ro(0x4C, LOWER),        // DR
    ro(0x300, 0x003F_3F3F), // CSR
    rw(0x304, 0x00C3_EF1F), // CCR
    ro(0x308, ALL),         // CDR
];
