//! The fourteen timers, of six kinds.
use super::{rw, wo, Register, ALL, LOWER};

/// TIM1 and TIM8 (RM0090 section 17.4).
const ADVANCED: &[Register] = &[
    rw(0x00, 0x3FF),  // CR1
    rw(0x04, 0x7FFD), // CR2
    rw(0x08, 0xFFF7), // SMCR
    rw(0x0C, 0x7FFF), // DIER
    rw(0x10, 0x1EFF), // SR
    wo(0x14, 0xFF),   // EGR
    rw(0x18, LOWER),  // CCMR1
    rw(0x1C, LOWER),  // CCMR2
    rw(0x20, 0x3FFF), // CCER
    rw(0x24, LOWER),  // CNT
    rw(0x28, LOWER),  // PSC
    rw(0x2C, LOWER),  // ARR
    rw(0x30, 0xFF),   // RCR
    rw(0x34, LOWER),  // CCR1
    rw(0x38, LOWER),  // CCR2
    rw(0x3C, LOWER),  // CCR3
    rw(0x40, LOWER),  // CCR4
    rw(0x44, LOWER),  // BDTR
    rw(0x48, 0x1F1F), // DCR
    rw(0x4C, ALL),    // DMAR
];

/// RM0090 section 18.4: timers with four channels; `count` has the bits of the counter.
const fn general(count: u32) -> [Register; 18] {
    [
        rw(0x00, 0x3FF),  // CR1
        rw(0x04, 0xF8),   // CR2
        rw(0x08, 0xFFF7), // SMCR
        rw(0x0C, 0x5F5F), // DIER
        rw(0x10, 0x1E5F), // SR
        wo(0x14, 0x5F),   // EGR
        rw(0x18, LOWER),  // CCMR1
        rw(0x1C, LOWER),  // CCMR2
        rw(0x20, 0xBBBB), // CCER
        rw(0x24, count),  // CNT
        rw(0x28, LOWER),  // PSC
        rw(0x2C, count),  // ARR
        rw(0x34, count),  // CCR1
        rw(0x38, count),  // CCR2
        rw(0x3C, count),  // CCR3
        rw(0x40, count),  // CCR4
        rw(0x48, 0x1F1F), // DCR
        rw(0x4C, LOWER),  // DMAR
    ]
}

/// The same registers followed by the option register.
const fn with_option<const N: usize, const M: usize>(
    registers: &[Register; N],
    bits: u32,
) -> [Register; M] {
    let mut all = [rw(0x50, bits); M];
    let mut place = 0;
    while place < N {
        all[place] = registers[place];
        place += 1;
    }
    all
}

const TIM2: [Register; 19] = with_option(&general(ALL), 0xC00);
const TIM3: [Register; 18] = general(LOWER);
const TIM5: [Register; 19] = with_option(&general(ALL), 0xC0);

/// TIM6 and TIM7 (RM0090 section 20.4).
const BASIC: &[Register] = &[
    rw(0x00, 0x8F),  // CR1
    rw(0x04, 0x70),  // CR2
    rw(0x0C, 0x101), // DIER
    rw(0x10, 1),     // SR
    wo(0x14, 1),     // EGR
    rw(0x24, LOWER), // CNT
    rw(0x28, LOWER), // PSC
    rw(0x2C, LOWER), // ARR
];

/// RM0090 section 19.4: TIM9 and TIM12.
const TWO_CHANNELS: &[Register] = &[
    rw(0x00, 0x38F), // CR1
    rw(0x08, 0xF7),  // SMCR
    rw(0x0C, 0x47),  // DIER
    rw(0x10, 0x647), // SR
    wo(0x14, 0x47),  // EGR
    rw(0x18, LOWER), // CCMR1
    rw(0x20, 0xBB),  // CCER
    rw(0x24, LOWER), // CNT
    rw(0x28, LOWER), // PSC
    rw(0x2C, LOWER), // ARR
    rw(0x34, LOWER), // CCR1
    rw(0x38, LOWER), // CCR2
];

/// RM0090 section 19.5: TIM10, TIM11, TIM13 and TIM14.
const ONE_CHANNEL: [Register; 10] = [
    rw(0x00, 0x38F), // CR1
    rw(0x0C, 3),     // DIER
    rw(0x10, 0x203), // SR
    wo(0x14, 3),     // EGR
    rw(0x18, 0xFF),  // CCMR1
    rw(0x20, 0xB),   // CCER
    rw(0x24, LOWER), // CNT
    rw(0x28, LOWER), // PSC
    rw(0x2C, LOWER), // ARR
    rw(0x34, LOWER), // CCR1
];
const TIM11: [Register; 11] = with_option(&ONE_CHANNEL, 3);

/// The registers of TIM1 to TIM14.
pub(super) const OF: [&[Register]; 14] = [
    ADVANCED,
    &TIM2,
    &TIM3,
    &TIM3,
    &TIM5,
    BASIC,
    BASIC,
    ADVANCED,
    TWO_CHANNELS,
    &ONE_CHANNEL,
    &TIM11,
    TWO_CHANNELS,
    &ONE_CHANNEL,
    &ONE_CHANNEL,
];
