//! The supply voltage's detector (RM0090 section 5.2.3): the outputs are made safe before the chip
//! resets itself.
//!
//! Level 4, 2.66 V falling (data sheet, table 19): a little under the 2.7 V that the flash asks for
//! when it is written by words (RM0090 table 13). Level 5 would be above it, but may keep a board
//! of 3.0 V, an STM32F4-Discovery, from starting. The chip resets itself at 1.7 V, unless its
//! option bytes say otherwise.
use crate::{
    registers::Word,
    restart::{self, Reason},
};
use stm32f4::stm32f407::{EXTI, PWR};

/// The detector's line of EXTI.
const LINE: u32 = 1 << 16;

/// Waits until the supply is good. From then on a low supply causes an interrupt. At start-up.
pub(crate) fn watch(power: &PWR, exti: &EXTI) {
    power.cr().modify(|_, w| w.pls().set(4).pvde().enabled());
    while power.csr().read().pvdo().bit_is_set() {}
    exti.pr().put(LINE);
    exti.rtsr().change(|lines| lines | LINE);
    exti.imr().change(|lines| lines | LINE);
}

/// The supply is low. Interrupt of the detector.
pub(crate) fn on_low() -> ! {
    restart::because(Reason::SupplyLow)
}
