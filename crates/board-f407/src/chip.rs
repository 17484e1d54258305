//! The parts of the chip that a board chooses among.
#![allow(
    dead_code,
    reason = "each board uses some of these ports, lines and timers; no board uses all of them"
)]

use stm32f4::stm32f407::DBGMCU;

/// The message on another chip than an STM32F405 or F407.
const ANOTHER: &str = "This chip is no STM32F407, locked: flash the firmware of its own";

/// Returns why this firmware must not drive the pins of this chip, if there is a reason: its number
/// says that it is another one. An F407 of revision A says 0x411 (RM0090 section 38.6.1; ES0182).
/// Start-up.
pub(crate) fn refusal(debug: &DBGMCU) -> Option<&'static str> {
    match debug.idcode().read().dev_id().bits() {
        // 0: an emulator without the debug unit, as QEMU is; every chip has a number.
        0 | 0x411 | 0x413 => None,
        _ => Some(ANOTHER),
    }
}

/// A port of 16 pins.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Bank {
    A,
    B,
    C,
    D,
    E,
    F,
    G,
}

impl Bank {
    /// The port of a number, 0 for A to 6 for G; G if it is larger.
    pub(crate) const fn numbered(number: u8) -> Self {
        match number {
            0 => Self::A,
            1 => Self::B,
            2 => Self::C,
            3 => Self::D,
            4 => Self::E,
            5 => Self::F,
            6.. => Self::G,
        }
    }

    /// The distance of the port's registers from the registers of port A, in bytes (RM0090 section
    /// 2.3).
    pub(crate) const fn offset(self) -> u32 {
        0x400 * self as u32
    }
}

/// A USART of a serial line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Usart {
    /// On APB2.
    Usart1,
    /// On APB1.
    Usart2,
}

/// A timer that can drive a power pin. The chip's other timers have a task already, or no pin of
/// their own. The number of a variant is the place of its registers, in steps of 0x400 from
/// 0x40000000 on (RM0090 section 2.3).
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Timer {
    Tim1 = 0x40,
    Tim3 = 0x01,
    Tim4 = 0x02,
    Tim8 = 0x41,
    /// Channels 1 and 2.
    Tim9 = 0x50,
}
