//! The peripherals, each a value of its own: registers are read and written at a cycle, `next_event` says when it
//! changes by itself, and `event` lets it. None knows the others: `crate::wiring` connects them.
//!
//! Sections and tables are those of RM0090, revision 21. Those of chapters 3, 5, 7 to 10, 12, 21 and 38 have been opened, and of
//! chapter 34 the text up to the registers; those of the memory map (2), the timers (17 to 20) and the USARTs (30) not.
//!
//! Which bits of their registers there are says [`register_map`], which is held against ST's data (`crate::st_data`), as are
//! addresses, interrupts, DMA requests, pins and clocks.
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
