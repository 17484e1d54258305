//! The serial line: USART2, byte by byte (RM0090 chapter 30).
//!
//! ```text
//!   pin -> interrupt -> Receiver: realtime bytes picked out, all others queued -> main loop
//!   pin <- interrupt <- queue of bytes to send                                 <- main loop: Board::write
//! ```
use crate::{clock::APB1_HZ, gpio::Pull, profile::PROFILE, wake::wake};
use heapless::spsc::{Consumer, Queue};
use leadscrew_machine::protocol::serial::Receiver;
use stm32f4::stm32f407::USART2;

/// Bytes to send, and the place that a ring keeps free.
pub(crate) type Outgoing = Queue<u8, 1025>;

/// Function of USART1 to USART3 in the data sheet's table 9.
const FUNCTION: u8 = 7;

/// The interrupt's end of the line.
pub(crate) struct Port {
    usart: USART2,
    receiver: Receiver<'static>,
    outgoing: Consumer<'static, u8>,
}

impl Port {
    /// Starts the line: 8 bits, no parity, one stop bit.
    pub(crate) fn new(
        usart: USART2,
        receiver: Receiver<'static>,
        outgoing: Consumer<'static, u8>,
    ) -> Self {
        let pins = &PROFILE.serial;
        pins.transmit.make_alternate(FUNCTION, Pull::None);
        pins.receive.make_alternate(FUNCTION, Pull::Up);
        // Sixteenths of the clock a bit, rounded (RM0090 section 30.3.4).
        let divider = (APB1_HZ + pins.baud / 2) / pins.baud;
        // SAFETY: mantissa and fraction together are the whole divider; 16 to 0xFFFF is defined.
        #[allow(unsafe_code)]
        usart.brr().write(|w| unsafe { w.bits(divider as u16) });
        usart.cr1().write(|w| {
            w.ue().enabled().te().enabled().re().enabled();
            w.rxneie().enabled()
        });
        Self {
            usart,
            receiver,
            outgoing,
        }
    }

    /// Takes the byte that has come, sends the next. Interrupt of the USART, or pended by whoever has queued bytes.
    pub(crate) fn on_interrupt(&mut self) {
        let status = self.usart.sr().read();
        // Reading the data after the status clears an overrun as well.
        if status.rxne().bit_is_set() || status.ore().bit_is_set() {
            let byte = self.usart.dr().read().bits() as u8;
            if status.rxne().bit_is_set() {
                self.receiver.receive(byte);
                wake();
            }
        }
        if status.txe().bit_is_set() {
            self.send();
        }
    }

    /// Sends the next byte; asks for no further interrupt where there is none.
    fn send(&mut self) {
        let byte = self.outgoing.dequeue();
        if let Some(byte) = byte {
            self.usart.dr().write(|w| w.dr().set(byte.into()));
        }
        self.usart
            .cr1()
            .modify(|_, w| w.txeie().bit(byte.is_some()));
    }
}
