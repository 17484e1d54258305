//! The peripherals. Each is a value of its own: its registers are read and written at a cycle,
//! `next_event` is the cycle at which it changes by itself, and `event` makes that change. No
//! peripheral knows another: `crate::wiring` connects them.
//!
//! Comments cite sections and tables of RM0090, revision 21. The README of this crate lists
//! the sections that were compared with the code, and the differences that were found. The cited
//! sections of chapters 2 and 39 were compared earlier.
//!
//! The chapters of the timers (17 to 20) and the USARTs (30) were not at hand. Instead, the
//! chapters of a sister chip were read: RM0041, revision 6 (STM32F100), chapters 15 (TIM15 to
//! TIM17, whose registers have the same bits) and 23. Single pages of RM0090 (revisions 4, 11 and
//! 18: sections 17.3.10, 17.4.9, 18.3.1, 18.4.12, 30.3.3 and 30.3.4) and the list of its changes
//! agree with it. That PWM without preload is guaranteed in one-pulse mode only (18.4.7, OC1PE)
//! was found in quotations of RM0368 (STM32F401), section 13.4.7.
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
pub(crate) mod pin_map;
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
