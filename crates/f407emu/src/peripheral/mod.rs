//! The peripherals, each a value of its own: registers are read and written at a cycle,
//! `next_event` says when it changes by itself, and `event` lets it. None knows the others:
//! `crate::wiring` connects them.
//!
//! Comments cite sections and tables of RM0090, revision 21. Each section that a comment cites of
//! chapters 2, 3, 5, 7 to 10, 12, 13 (as far as it is modelled), 21 and 38 was read again and
//! compared with the code; of chapter 34, the text up to the registers.
//!
//! The chapters of the timers (17 to 20) and the USARTs (30) were not at hand. In their place those
//! of a sister chip were read: RM0041, revision 6 (STM32F100), chapters 15 (TIM15 to TIM17, whose
//! registers have the same bits) and 23. Single pages of RM0090 (revisions 4 and 11: sections
//! 17.4.9, 18.3.1, 18.4.12) and the list of its changes agree with it. Not found there: that PWM
//! without preload is guaranteed in one-pulse mode only (18.4.7, OC1PE), which ST's data for other
//! chips say.
//!
//! [`register_map`] lists the bits of each register. A test compares it with ST's data
//! (`crate::st_data`), and addresses, interrupts, DMA requests, pins and clocks as well.
pub(crate) mod adc;
pub(crate) mod bitband;
pub(crate) mod dma;
pub(crate) mod dwt;
pub(crate) mod exti;
pub(crate) mod flash;
pub(crate) mod gpio;
pub(crate) mod iwdg;
pub(crate) mod nvic;
pub(crate) mod pwr;
pub(crate) mod rcc;
pub(crate) mod register_map;
pub(crate) mod scb;
pub(crate) mod systick;
pub(crate) mod timer;
pub(crate) mod timer_map;
pub(crate) mod timer_output;
pub(crate) mod usart;
pub(crate) mod usb;

/// The cycle of an event that is not going to come.
pub(crate) const NEVER: u64 = u64::MAX;
