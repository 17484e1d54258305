//! Registers as whole words, peripherals that are reached from several places, and the flash by
//! address.
//!
//! `stm32f4` makes two things unsafe. One is to write a register as a word: some registers start a
//! transfer into memory. The other is to use a peripheral without owning its value. The registers
//! and peripherals in this file are safe to use in both ways, each for the reason beside it. So the
//! other files need no unsafe code for them.
#![allow(unsafe_code)]
use crate::chip::{Bank, Timer, Usart};
use core::{
    ops::Range,
    sync::atomic::{AtomicU16, AtomicU8},
};
use stm32f4::{
    stm32f407::{
        dma2, exti, flash, gpioi, iwdg, rcc, syscfg, tim1, tim11, tim2, tim5, usart1, DMA1, DMA2,
        FLASH, GPIOA, IWDG, TIM11, TIM2, TIM5, USART1, USART2,
    },
    Readable, Reg, RegisterSpec, Resettable, Writable,
};

#[cfg(any(captures, record))]
use core::sync::atomic::AtomicU32;
#[cfg(record)]
use core::sync::atomic::Ordering::Relaxed;
#[cfg(heaters)]
use stm32f4::stm32f407::{adc1, adc_common, ADC1, ADC_COMMON};

/// A register that reaches no memory: a wrong value makes a wrong level, time or rate, and nothing
/// else.
pub(crate) trait Harmless: Writable + Resettable {}

// Ports (RM0090 sections 8.4.1 to 8.4.10), lines of EXTI (12.3) and their ports (9.2.3 to 9.2.6).
impl Harmless for gpioi::moder::MODERrs {}
impl Harmless for gpioi::ospeedr::OSPEEDRrs {}
#[cfg(record)]
impl Harmless for gpioi::otyper::OTYPERrs {}
impl Harmless for gpioi::pupdr::PUPDRrs {}
impl Harmless for gpioi::bsrr::BSRRrs {}
impl Harmless for gpioi::afrl::AFRLrs {}
impl Harmless for gpioi::afrh::AFRHrs {}
impl Harmless for exti::imr::IMRrs {}
impl Harmless for exti::rtsr::RTSRrs {}
impl Harmless for exti::ftsr::FTSRrs {}
impl Harmless for exti::swier::SWIERrs {}
impl Harmless for exti::pr::PRrs {}
impl Harmless for syscfg::exticr1::EXTICR1rs {}
impl Harmless for syscfg::exticr2::EXTICR2rs {}
impl Harmless for syscfg::exticr3::EXTICR3rs {}
impl Harmless for syscfg::exticr4::EXTICR4rs {}
// The flash's control and status (3.9.5, 3.9.7): they erase and program the flash, and no other
// memory. The firmware is in other sectors than `settings_flash` names.
impl Harmless for flash::sr::SRrs {}
impl Harmless for flash::cr::CRrs {}
// The output of a timer's channel (18.4.7 to 18.4.9), and the rate of a serial line (30.6.3).
impl Harmless for tim1::ccmr1_output::CCMR1_OUTPUTrs {}
impl Harmless for tim1::ccmr2_output::CCMR2_OUTPUTrs {}
impl Harmless for tim1::ccer::CCERrs {}
impl Harmless for usart1::brr::BRRrs {}
// The measurement of the crystal (19.5), and the dividers of clocks (7.3.3).
impl Harmless for tim11::or::ORrs {}
impl Harmless for tim11::ccmr1_input::CCMR1_INPUTrs {}
impl Harmless for tim11::ccer::CCERrs {}
impl Harmless for rcc::cfgr::CFGRrs {}
// The converter's sampling times and sequence (13.13.4, 13.13.5, 13.13.12).
#[cfg(heaters)]
impl Harmless for adc1::smpr1::SMPR1rs {}
#[cfg(heaters)]
impl Harmless for adc1::smpr2::SMPR2rs {}
#[cfg(heaters)]
impl Harmless for adc1::jsqr::JSQRrs {}
// Flags of DMA, which are cleared by ones (10.5.4).
impl Harmless for dma2::hifcr::HIFCRrs {}

// The captures' edges (18.4.9), and the flags of the lower streams (10.5.3).
#[cfg(captures)]
impl Harmless for tim2::ccer::CCERrs {}
#[cfg(captures)]
impl Harmless for dma2::lifcr::LIFCRrs {}

/// Writes whole words.
pub(crate) trait Word<S: RegisterSpec> {
    /// Writes all bits.
    fn put(&self, bits: S::Ux);
    /// Reads all bits, applies `change`, and writes the result.
    fn change(&self, change: impl FnOnce(S::Ux) -> S::Ux)
    where
        S: Readable;
}

impl<S: Harmless> Word<S> for Reg<S> {
    fn put(&self, bits: S::Ux) {
        // SAFETY: `Harmless`.
        self.write(|w| unsafe { w.bits(bits) });
    }
    fn change(&self, change: impl FnOnce(S::Ux) -> S::Ux)
    where
        S: Readable,
    {
        // SAFETY: `Harmless`.
        self.modify(|r, w| unsafe { w.bits(change(r.bits())) });
    }
}

/// A port's registers.
pub(crate) fn port(bank: Bank) -> &'static gpioi::RegisterBlock {
    let address = GPIOA::ptr() as usize + bank.offset() as usize;
    // SAFETY: the ports' registers lie 0x400 apart from GPIOA on, and differ in their reset values
    // only.
    unsafe { &*(address as *const gpioi::RegisterBlock) }
}

/// A port in a table that is filled at start-up; port A until then. The value is the distance of
/// the port's registers from the registers of port A. So zeroed memory is a valid port, and a tick
/// has nothing to check.
#[cfg(record)]
pub(crate) struct AnyPort(AtomicU32);

#[cfg(record)]
impl AnyPort {
    pub(crate) const fn new() -> Self {
        Self(AtomicU32::new(0))
    }

    /// Sets the port. Main loop.
    pub(crate) fn set(&self, bank: Bank) {
        self.0.store(bank.offset(), Relaxed);
    }

    /// Its registers.
    #[inline(always)]
    pub(crate) fn registers(&self) -> &'static gpioi::RegisterBlock {
        let address = GPIOA::ptr() as usize + self.0.load(Relaxed) as usize;
        // SAFETY: as `port`: nobody but `set` writes the offset, which is 0 before.
        unsafe { &*(address as *const gpioi::RegisterBlock) }
    }
}

/// The timer of the power. TIM1 and TIM8 have all registers. The other timers have some of them, at
/// the same offsets (17.4, 18.4 and 19.4).
#[inline(always)]
pub(crate) fn power_timer(timer: Timer) -> &'static tim1::RegisterBlock {
    let address = 0x4000_0000 + 0x400 * timer as usize;
    // SAFETY: a timer with at least the registers that `crate::pwm` uses.
    unsafe { &*(address as *const tim1::RegisterBlock) }
}

/// The registers of the power's channel: its compare value, and its mode. The mode register also
/// holds the mode of a second channel, which is not in use.
#[cfg(record)]
pub(crate) struct PowerRegisters {
    pub(crate) compare: &'static tim1::CCR,
    pub(crate) modes: &'static tim1::CCMR1_OUTPUT,
}

// SAFETY: as the timer itself, which `power_timer` hands to every context.
#[cfg(record)]
unsafe impl Send for PowerRegisters {}

#[cfg(record)]
impl PowerRegisters {
    /// The registers of channel `number`, 0 to 3.
    pub(crate) fn new(timer: Timer, number: u8) -> Self {
        let (timer, number) = (power_timer(timer), usize::from(number % 4));
        let second: *const _ = timer.ccmr2_output();
        Self {
            compare: timer.ccr(number),
            modes: match number {
                0 | 1 => timer.ccmr1_output(),
                // SAFETY: a register of the same width, with the bits of the next two channels.
                _ => unsafe { &*second.cast() },
            },
        }
    }
}

/// The timer of ticks.
pub(crate) fn tick_timer() -> &'static tim2::RegisterBlock {
    // SAFETY: a timer reaches no memory but through DMA, whose streams have the memory that `aim`
    // gives them.
    unsafe { &*TIM2::ptr() }
}

/// The timer of pulses.
pub(crate) fn pulse_timer() -> &'static tim11::RegisterBlock {
    // SAFETY: as `tick_timer`.
    unsafe { &*TIM11::ptr() }
}

/// The timer of the clock.
pub(crate) fn clock_timer() -> &'static tim5::RegisterBlock {
    // SAFETY: as `tick_timer`.
    unsafe { &*TIM5::ptr() }
}

/// The converter of heaters' sensors.
#[cfg(heaters)]
pub(crate) fn converter() -> &'static adc1::RegisterBlock {
    // SAFETY: the converter reaches no memory: its DMA requests stay off.
    unsafe { &*ADC1::ptr() }
}

/// The registers that all converters share.
#[cfg(heaters)]
pub(crate) fn converters() -> &'static adc_common::RegisterBlock {
    // SAFETY: as `converter`.
    unsafe { &*ADC_COMMON::ptr() }
}

/// The flash's controller. Only the main loop writes the flash.
pub(crate) fn flash() -> &'static flash::RegisterBlock {
    // SAFETY: as `Harmless` says of its control register.
    unsafe { &*FLASH::ptr() }
}

/// The addresses of the flash: 1 MiB (RM0090 table 5).
const FLASH_MEMORY: Range<usize> = 0x0800_0000..0x0810_0000;

/// Gives the flash's controller a word to program, at an address that is a multiple of 4. The
/// controller refuses a word unless it was set up for programming before.
pub(crate) fn store_in_flash(address: usize, word: u32) {
    if FLASH_MEMORY.contains(&address) && address.is_multiple_of(4) {
        // SAFETY: the address is in the flash. Code that reads a word which this may change uses
        // `read_flash`.
        unsafe { (address as *mut u32).write_volatile(word) };
    }
}

/// Reads bytes of the flash; 0xFF outside the flash, as in an empty one. The reads are volatile,
/// since a write of the flash changes bytes unseen.
#[inline(never)] // machine 004 (`examples/machines/004`) takes 792 bytes more with its loop inlined
pub(crate) fn read_flash(start: usize, bytes: &mut [u8]) {
    for (byte, address) in bytes.iter_mut().zip(start..) {
        *byte = if FLASH_MEMORY.contains(&address) {
            // SAFETY: the address is in the flash.
            unsafe { (address as *const u8).read_volatile() }
        } else {
            0xFF
        };
    }
}

/// The chip's unique number (RM0090 section 39.1).
pub(crate) fn unique_number() -> [u32; 3] {
    const PLACE: *const [u32; 3] = 0x1FFF_7A10 as _;
    // SAFETY: read-only memory of every chip, aligned.
    unsafe { PLACE.read_volatile() }
}

/// The independent watchdog.
pub(crate) fn watchdog() -> &'static iwdg::RegisterBlock {
    // SAFETY: it reaches no memory.
    unsafe { &*IWDG::ptr() }
}

/// A USART. All of them have the registers of USART1 (RM0090 section 30.6).
pub(crate) fn usart(line: Usart) -> &'static usart1::RegisterBlock {
    let address = match line {
        Usart::Usart1 => USART1::ptr(),
        Usart::Usart2 => USART2::ptr(),
    };
    // SAFETY: it reaches no memory but through DMA.
    unsafe { &*address }
}

/// The DMA controller of a USART.
pub(crate) fn dma(line: Usart) -> &'static dma2::RegisterBlock {
    let address = match line {
        Usart::Usart1 => DMA2::ptr(),
        Usart::Usart2 => DMA1::ptr(),
    };
    // SAFETY: its streams reach the memory that `aim` gives them, and no other.
    unsafe { &*address }
}

/// The DMA controller of the captures.
#[cfg(captures)]
pub(crate) fn capture_dma() -> &'static dma2::RegisterBlock {
    // SAFETY: as `dma`.
    unsafe { &*DMA1::ptr() }
}

/// Memory that DMA may change while others read it.
pub(crate) trait Shared {}
impl Shared for AtomicU8 {}
impl Shared for AtomicU16 {}
#[cfg(captures)]
impl Shared for AtomicU32 {}

/// A register that DMA reads or writes for its peripheral: data, and no address.
pub(crate) trait Data: RegisterSpec {}
impl Data for usart1::dr::DRrs {}
#[cfg(captures)]
impl Data for tim2::ccr::CCRrs {}

/// Points a stream at a peripheral's register and at static memory, with a transfer for each item.
/// The stream has to be off, and its item size has to be the item size of the memory. No transfer
/// begins yet.
pub(crate) fn aim<T: Shared, S: Data>(stream: &dma2::ST, data: &Reg<S>, memory: &'static [T]) {
    // SAFETY: two addresses that are valid for ever; `NDTR` keeps the stream within the memory.
    unsafe {
        stream.par().write(|w| w.bits(data.as_ptr() as u32));
        stream.m0ar().write(|w| w.bits(memory.as_ptr() as u32));
    }
    stream.ndtr().write(|w| w.ndt().set(memory.len() as u16));
}
