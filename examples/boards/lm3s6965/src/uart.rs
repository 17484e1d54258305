//! UART0, a PL011 at 115 200 baud: hands received bytes to the machine one by one.

use crate::register::Register;
use leadscrew_machine::protocol::serial::Receiver;

const UART_0: u32 = 0x4000_C000;
const DATA: Register = Register::at(UART_0, 0x00);
const FLAGS: Register = Register::at(UART_0, 0x18);
const BAUD_WHOLE: Register = Register::at(UART_0, 0x24);
const BAUD_FRACTION: Register = Register::at(UART_0, 0x28);
const LINE_CONTROL: Register = Register::at(UART_0, 0x2C);
const CONTROL: Register = Register::at(UART_0, 0x30);
const INTERRUPT_MASK: Register = Register::at(UART_0, 0x38);
const INTERRUPT_CLEAR: Register = Register::at(UART_0, 0x44);

const NOTHING_RECEIVED: u32 = 1 << 4;
const NO_ROOM: u32 = 1 << 5;
const RECEIVED: u32 = 1 << 4;
const RECEIVE_TIMEOUT: u32 = 1 << 6;

/// PA0 and PA1 belong to the UART.
const PORT_A_ALTERNATE: Register = Register::at(0x4000_4000, 0x420);
const PORT_A_DIGITAL: Register = Register::at(0x4000_4000, 0x51C);

/// Starts the line. Called once.
pub(crate) fn start() {
    PORT_A_ALTERNATE.set(0b11);
    PORT_A_DIGITAL.set(0b11);
    CONTROL.write(0);
    // 50 MHz / (16 * 115 200) = 27 + 8/64.
    BAUD_WHOLE.write(27);
    BAUD_FRACTION.write(8);
    const EIGHT_BITS_WITH_FIFO: u32 = 0b111 << 4;
    LINE_CONTROL.write(EIGHT_BITS_WITH_FIFO);
    INTERRUPT_MASK.write(RECEIVED | RECEIVE_TIMEOUT);
    const ENABLE_BOTH_WAYS: u32 = 0b11 << 8 | 1;
    CONTROL.write(ENABLE_BOTH_WAYS);
}

/// Hands over all bytes that have been received. Called by the UART's interrupt.
pub(crate) fn on_interrupt(receiver: &mut Receiver<'_>) {
    INTERRUPT_CLEAR.write(RECEIVED | RECEIVE_TIMEOUT);
    while FLAGS.read() & NOTHING_RECEIVED == 0 {
        receiver.receive(DATA.read() as u8);
    }
}

/// Sends as many of `bytes` as there is room for, and returns how many. Called by the main loop.
pub(crate) fn write(bytes: &[u8]) -> usize {
    let room = |_: &&u8| FLAGS.read() & NO_ROOM == 0;
    let sent = bytes.iter().take_while(room);
    sent.map(|byte| DATA.write(u32::from(*byte))).count()
}
