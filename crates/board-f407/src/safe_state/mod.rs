//! The state in which the outputs do no harm: no step, laser, spindle and coolant off.
//!
//! It is entered right after a reset, before memory is cleared, and again by everything that ends
//! the program (`restart`). The pins that enable the motors stay as they are: a Z axis that is let
//! go may drop.
//!
//! At reset it is entered in assembly, since no Rust may run before memory has its first values.
//! The pins come from a table that the compiler makes (`wired`), or from the board's record
//! (`recorded`). The assembly also stops everything that a bootloader has left running.
#![allow(unsafe_code)] // an entry in assembly, stores to registers by their addresses

#[cfg(record)]
mod recorded;
#[cfg(not(record))]
mod wired;

use crate::step_port::PULSE_END_INTERRUPT;
use cortex_m::peripheral::NVIC;
use stm32f4::stm32f407::Interrupt;

#[cfg(record)]
use recorded as pins;
#[cfg(not(record))]
use wired as pins;

/// A change of a register: the bits `clear` are cleared, and the bits `set` are set.
#[derive(Clone, Copy)]
#[repr(C)]
struct Store {
    address: u32,
    clear: u32,
    set: u32,
}

impl Store {
    const fn new(address: u32, clear: u32, set: u32) -> Self {
        Self {
            address,
            clear,
            set,
        }
    }

    /// A change of all bits of a register.
    const fn whole(address: u32, value: u32) -> Self {
        Self::new(address, u32::MAX, value)
    }

    #[cfg(not(record))]
    fn make(&self) {
        let register = self.address as *mut u32;
        // SAFETY: a register of a port that has its clock; any context may make its pins safe.
        unsafe { register.write_volatile(register.read_volatile() & !self.clear | self.set) };
    }
}

/// Ends everything that a bootloader may have left running: SysTick, pending SysTick and PendSV
/// exceptions (DDI 0403, B3.2.4 and B3.3), all interrupts and their pending bits (B3.4), lines of
/// EXTI (RM0090 section 12.3), both DMA controllers, USB and timers (resets of RCC, sections 7.3.5,
/// 7.3.6, 7.3.8 and 7.3.9). The timers' resets clear their prescalers, which would make steps slow.
const FRESH: [Store; 18] = [
    Store::whole(0xE000_E010, 0),
    Store::whole(0xE000_ED04, 1 << 27 | 1 << 25),
    Store::whole(0x4001_3C00, 0),
    Store::whole(0x4001_3C04, 0),
    Store::new(0x4002_3810, 0, 0b11 << 21),
    Store::new(0x4002_3810, 0b11 << 21, 0),
    Store::new(0x4002_3814, 0, 1 << 7),
    Store::new(0x4002_3814, 1 << 7, 0),
    Store::new(0x4002_3820, 0, TIMERS.0),
    Store::new(0x4002_3820, TIMERS.0, 0),
    Store::new(0x4002_3824, 0, TIMERS.1),
    Store::new(0x4002_3824, TIMERS.1, 0),
    Store::whole(0xE000_E180, u32::MAX),
    Store::whole(0xE000_E184, u32::MAX),
    Store::whole(0xE000_E188, u32::MAX),
    Store::whole(0xE000_E280, u32::MAX),
    Store::whole(0xE000_E284, u32::MAX),
    Store::whole(0xE000_E288, u32::MAX),
];

/// TIM2 to TIM7 and TIM12 to TIM14 in RCC_APB1RSTR; TIM1 and TIM9 to TIM11 in RCC_APB2RSTR. (TIM8's
/// bit is left out: QEMU 10 crashes at it, and `pwm` sets all of a timer that it uses.)
const TIMERS: (u32, u32) = (0x1FF, 0b111 << 16 | 1);

/// Makes every pin that could do harm an output that is off. Any context.
pub(crate) fn enter() {
    NVIC::mask(Interrupt::TIM2);
    NVIC::mask(PULSE_END_INTERRUPT);
    pins::make_safe();
}
