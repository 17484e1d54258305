//! The pins of serial ports and USB (data sheet DocID022152, table 9). A test compares them with ST's
//! data.

/// The signal to which an alternate function connects a pin. A serial port is given by its place in
/// [`crate::devices::USARTS`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Signal {
    /// The output of a serial port.
    Transmit(usize),
    /// The input of a serial port.
    Receive(usize),
    /// D- of USB OTG FS.
    UsbMinus,
    /// D+ of USB OTG FS.
    UsbPlus,
}

/// The signal of a serial port or of USB that an alternate function puts on a pin of port A to G.
pub(crate) fn signal(port: usize, pin: u8, function: u8) -> Option<Signal> {
    let signal = match (function, port, pin) {
        (7, 0, 9) | (7, 1, 6) => Signal::Transmit(0),
        (7, 0, 10) | (7, 1, 7) => Signal::Receive(0),
        (7, 0, 2) | (7, 3, 5) => Signal::Transmit(1),
        (7, 0, 3) | (7, 3, 6) => Signal::Receive(1),
        (7, 1 | 2, 10) | (7, 3, 8) => Signal::Transmit(2),
        (7, 1 | 2, 11) | (7, 3, 9) => Signal::Receive(2),
        (8, 2, 6) | (8, 6, 14) => Signal::Transmit(3),
        (8, 2, 7) | (8, 6, 9) => Signal::Receive(3),
        (10, 0, 11) => Signal::UsbMinus,
        (10, 0, 12) => Signal::UsbPlus,
        _ => return None,
    };
    Some(signal)
}
