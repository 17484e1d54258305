//! The parts of the chip that a board chooses among.

/// A port of 16 pins.
#[derive(Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[allow(dead_code)] // no board uses all of them
pub(crate) enum Bank {
    A,
    B,
    C,
    D,
    E,
    F,
    G,
}

/// Which USART the line is on.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code, reason = "a profile names one of the two")]
pub(crate) enum Usart {
    /// On APB2.
    Usart1,
    /// On APB1.
    Usart2,
}

/// A timer that a power pin may hang on. The others have a task already, or no pin of their own.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code, reason = "no board uses all of them")]
pub(crate) enum Timer {
    Tim1,
    Tim3,
    Tim4,
    Tim8,
    /// Channels 1 and 2.
    Tim9,
}
