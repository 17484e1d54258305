//! The parts of the chip that a board chooses among.
#![allow(
    dead_code,
    reason = "each board uses some of these ports, lines and timers; no board uses all of them"
)]

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

/// A USART of a serial line.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Usart {
    /// On APB2.
    Usart1,
    /// On APB1.
    Usart2,
}

/// A timer that can drive a power pin. The chip's other timers have a task already, or no pin of
/// their own.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Timer {
    Tim1,
    Tim3,
    Tim4,
    Tim8,
    /// Channels 1 and 2.
    Tim9,
}
