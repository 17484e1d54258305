//! The peripherals. Each is a value of its own: its registers are read and written at a cycle,
//! `next_event` is the cycle at which it changes by itself, and `event` makes that change. No
//! peripheral knows another: `crate::wiring` connects them.
//!
//! Comments cite sections and tables of RM0090, revision 21. Every cited section of chapters 2, 3,
//! 5, 7 to 10, 12, 13 (as far as it is modelled), 21 and 38 was read again and compared with the
//! code; so was the text of chapter 34 up to the registers.
//!
//! The chapters of the timers (17 to 20) and the USARTs (30) were not at hand. Instead, the
//! chapters of a sister chip were read: RM0041, revision 6 (STM32F100), chapters 15 (TIM15 to
//! TIM17, whose registers have the same bits) and 23. Single pages of RM0090 (revisions 4 and 11:
//! sections 17.4.9, 18.3.1, 18.4.12) and the list of its changes agree with it. One statement was
//! not found there, but only in ST's data for other chips: that PWM without preload is guaranteed
//! in one-pulse mode only (18.4.7, OC1PE).
//!
//! [`register_map`] lists the bits of each register. A test compares it with ST's data
//! (`crate::st_data`), and also addresses, interrupts, DMA requests, pins and clocks.
pub(crate) mod adc;
pub(crate) mod bitband;
pub(crate) mod crc;
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

/// The cycle of an event that will never come.
pub(crate) const NEVER: u64 = u64::MAX;
