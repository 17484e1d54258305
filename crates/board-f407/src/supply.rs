//! The supply voltage's detector (RM0090 section 5.2.3): the outputs are made safe before the chip resets itself.
//!
//! Level 4, 2.66 V falling (data sheet, table 19): a little under the 2.7 V that the flash asks for when it is written by words
//! (RM0090 table 13). Level 5 would be above it, but may keep a board of 3.0 V, an STM32F4-Discovery, from starting. The chip
//! resets itself at 1.7 V, unless its option bytes say otherwise.
use crate::restart::{self, Reason};
use stm32f4::stm32f407::{EXTI, PWR};

/// The detector's line of EXTI.
const LINE: u32 = 1 << 16;

/// Waits until the supply is good, and reports from then on when it is not. At start-up.
pub(crate) fn watch(power: &PWR, exti: &EXTI) {
    // SAFETY: level 4 is defined.
    #[allow(unsafe_code)]
    power
        .cr()
        .modify(|_, w| unsafe { w.pls().bits(4).pvde().enabled() });
    while power.csr().read().pvdo().bit_is_set() {}
    // SAFETY: bit 16 is the detector's in both registers, and all others stay.
    #[allow(unsafe_code)]
    unsafe {
        exti.pr().write(|w| w.bits(LINE));
        exti.rtsr().modify(|r, w| w.bits(r.bits() | LINE));
        exti.imr().modify(|r, w| w.bits(r.bits() | LINE));
    }
}

/// The supply is low. Interrupt of the detector.
pub(crate) fn on_low() -> ! {
    restart::because(Reason::SupplyLow)
}
