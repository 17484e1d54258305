//! A serial port (RM0090 chapter 30), and the line to the test at its other end.
//!
//! A byte moves only while the pins at which the cable is have the port's functions.
//!
//! A byte on the line lasts a start bit, 8 or 9 bits and the stop bits, at the rate that BRR sets.
//! The test's end uses the same rate, and keeps bytes until the line is free, so that a byte can be
//! lost only if the program reads too late.
//!
//! After an overrun the receiver takes no byte until the program has read SR and then DR (section
//! 30.3.3). A byte that had begun before the receiver was switched on is lost.
//!
//! Not modelled, and warned of if a program asks for it: parity, the ninth bit, breaks, LIN,
//! smartcard, IrDA, half duplex, the synchronous mode, hardware flow control, mute mode, half stop
//! bits, rates out of range, and changes while a byte goes out. Not modelled either: framing errors
//! and noise, and the idle frame that TE sends before the first byte. A byte counts as received at
//! the end of its last stop bit; with two stop bits, the chip waits for the first one only. A byte
//! that is written while the transmitter is off is lost.
use super::NEVER;
use crate::warning::{Warning, Warnings};
use std::collections::VecDeque;

/// USART_SR: overrun, idle line, byte received, transmission complete, data register empty.
const ORE: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RXNE: u32 = 1 << 5;
const TC: u32 = 1 << 6;
const TXE: u32 = 1 << 7;
/// USART_CR1: receiver, transmitter, four interrupt enables, 9 bits, the USART itself, oversampling
/// by 8.
const RE: u32 = 1 << 2;
const TE: u32 = 1 << 3;
const IDLEIE: u32 = 1 << 4;
const RXNEIE: u32 = 1 << 5;
const TCIE: u32 = 1 << 6;
const TXEIE: u32 = 1 << 7;
const M: u32 = 1 << 12;
const UE: u32 = 1 << 13;
const OVER8: u32 = 1 << 15;
/// USART_CR3: error interrupt, DMA for received bytes, DMA for bytes to be sent.
const EIE: u32 = 1;
const DMAR: u32 = 1 << 6;
const DMAT: u32 = 1 << 7;
/// The bits of the control registers that are not modelled. In CR1: break, mute mode, parity, the
/// ninth bit. In CR2: address, LIN, half stop bits, clock output. In CR3: IrDA, half duplex,
/// smartcard, flow control.
const CR1_UNKNOWN: u32 = 0x1F03;
const CR2_UNKNOWN: u32 = 0x5F6F;
const CR3_UNKNOWN: u32 = 0x073E;
/// The smallest value of USART_BRR: USARTDIV is 1 at least (section 30.3.4).
const LEAST_DIVIDER: u32 = 16;

/// The requests of a USART to the DMA controllers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct UsartRequests {
    pub(crate) receive: bool,
    pub(crate) transmit: bool,
}

/// Says whether pins connect a USART's output and input with the other end of its line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Connected {
    pub(crate) output: bool,
    pub(crate) input: bool,
}

/// A USART's registers and its line.
#[derive(Clone, Debug)]
pub(crate) struct Usart {
    base: u32,
    status: u32,
    /// The flags of SR at its last read. The following read or write of DR clears them.
    shown: u32,
    received: u8,
    brr: u32,
    cr1: u32,
    cr2: u32,
    cr3: u32,
    gtpr: u32,
    /// The HCLK cycles in a clock of its bus.
    bus_clock: u64,
    /// The byte on the line, and the one waiting in the data register.
    shifting: Option<u8>,
    waiting: Option<u8>,
    sent_at: u64,
    to_receive: VecDeque<u8>,
    receive_at: u64,
    idle_at: u64,
    /// True if the byte on the line had begun before the receiver could see it.
    misses: bool,
    /// Says whether the output and the input are connected to the pins at which the cable is.
    connected: Connected,
    /// True if the output has lost or found its pin while the byte goes out.
    spoils: bool,
    /// Bytes that the program has sent.
    pub(crate) output: Vec<u8>,
    /// The number of bytes that came before the program had read the previous byte.
    pub(crate) overruns: u64,
}

impl Usart {
    /// The state after a reset, with its registers at `base`.
    pub(crate) fn new(base: u32) -> Self {
        Usart {
            base,
            status: TC | TXE,
            shown: 0,
            received: 0,
            brr: 0,
            cr1: 0,
            cr2: 0,
            cr3: 0,
            gtpr: 0,
            bus_clock: 1,
            shifting: None,
            waiting: None,
            sent_at: NEVER,
            to_receive: VecDeque::new(),
            receive_at: NEVER,
            idle_at: NEVER,
            misses: false,
            connected: Connected::default(),
            spoils: false,
            output: Vec::new(),
            overruns: 0,
        }
    }

    /// Resets the USART. The byte on the line and the bytes at the other end stay.
    pub(crate) fn reset(&mut self) {
        *self = Usart {
            to_receive: core::mem::take(&mut self.to_receive),
            receive_at: self.receive_at,
            output: core::mem::take(&mut self.output),
            overruns: self.overruns,
            bus_clock: self.bus_clock,
            connected: self.connected,
            ..Usart::new(self.base)
        };
    }

    /// Sets how many HCLK cycles a clock of its bus takes.
    pub(crate) fn set_bus_clock(&mut self, cycles: u32) {
        self.bus_clock = u64::from(cycles);
    }

    /// Notes which pins are connected, since they may have got other functions. A byte that is on
    /// the line meanwhile is lost.
    pub(crate) fn connect(&mut self, connected: Connected, now: u64) {
        let before = core::mem::replace(&mut self.connected, connected);
        self.spoils |= before.output != connected.output && self.shifting.is_some();
        self.misses |= before.input != connected.input && self.has_begun(now);
    }

    /// Returns whether pins connect it with the other end.
    #[cfg(test)]
    pub(crate) fn connected(&self) -> Connected {
        self.connected
    }

    /// Returns true if a byte from the other end is on the line.
    fn has_begun(&self, now: u64) -> bool {
        self.receive_at != NEVER && now + self.frame() > self.receive_at
    }

    /// The other end sends bytes, from cycle `now` on.
    pub(crate) fn send(&mut self, bytes: &[u8], now: u64) {
        self.to_receive.extend(bytes);
        if self.receive_at == NEVER && !self.to_receive.is_empty() {
            self.receive_at = now + self.frame();
        }
    }

    /// The number of bytes that the other end has not sent yet.
    pub(crate) fn unsent(&self) -> usize {
        self.to_receive.len()
    }

    /// The cycle of its next event.
    pub(crate) fn next_event(&self) -> u64 {
        self.receive_at.min(self.idle_at).min(self.sent_at)
    }

    /// Carries out the due event.
    pub(crate) fn event(&mut self, now: u64) -> UsartRequests {
        let mut requests = UsartRequests::default();
        if self.receive_at <= now {
            requests.receive = self.receive(now);
        }
        if self.idle_at <= now {
            self.idle_at = NEVER;
            if self.has(UE | RE) {
                self.status |= IDLE;
            }
        }
        if self.sent_at <= now {
            requests.transmit = self.sent(now);
        }
        requests
    }

    /// A byte has arrived. Returns whether it requests DMA.
    fn receive(&mut self, now: u64) -> bool {
        let byte = self.to_receive.pop_front();
        let frame = self.frame();
        (self.receive_at, self.idle_at) = if self.to_receive.is_empty() {
            (NEVER, now + frame)
        } else {
            (now + frame, NEVER)
        };
        let misses = core::mem::take(&mut self.misses);
        let Some(byte) = byte.filter(|_| self.has(UE | RE) && self.connected.input && !misses)
        else {
            return false;
        };
        if self.status & (RXNE | ORE) != 0 {
            self.status |= ORE;
            self.overruns += 1;
            return false;
        }
        self.received = byte;
        self.status |= RXNE;
        self.cr3 & DMAR != 0
    }

    /// A byte has left. Returns whether it requests another byte by DMA.
    fn sent(&mut self, now: u64) -> bool {
        let spoils = core::mem::take(&mut self.spoils) || !self.connected.output;
        self.output.extend(self.shifting.take().filter(|_| !spoils));
        self.shifting = self.waiting.take();
        if self.shifting.is_none() {
            self.sent_at = NEVER;
            self.status |= TC;
            return false;
        }
        self.sent_at = now + self.frame();
        self.status |= TXE;
        self.cr3 & DMAT != 0
    }

    /// The present requests to DMA. A request lasts as long as a flag is set and its DMA is enabled
    /// (RM0090 section 30.3.13).
    pub(crate) fn requests(&self) -> UsartRequests {
        let asks = |enable, flag| self.cr3 & enable != 0 && self.status & flag != 0;
        UsartRequests {
            receive: asks(DMAR, RXNE),
            transmit: asks(DMAT, TXE),
        }
    }

    fn has(&self, bits: u32) -> bool {
        self.cr1 & bits == bits
    }

    /// HCLK cycles that a bit takes on the line (RM0090 section 30.3.4).
    pub(crate) fn bit_cycles(&self) -> u64 {
        let divider = if self.has(OVER8) {
            (self.brr >> 4) * 8 + (self.brr & 7)
        } else {
            self.brr
        };
        u64::from(divider.max(1)) * self.bus_clock
    }

    /// HCLK cycles that a byte takes.
    fn frame(&self) -> u64 {
        let stop_bits = if self.cr2 >> 12 & 3 == 2 { 2 } else { 1 };
        let bits = 1 + if self.has(M) { 9 } else { 8 } + stop_bits;
        bits * self.bit_cycles()
    }

    /// The level of the interrupt line (RM0090 section 30.4).
    pub(crate) fn interrupt(&self) -> bool {
        let asked = |enable, flags| self.cr1 & enable != 0 && self.status & flags != 0;
        let overrun = self.cr3 & (EIE | DMAR) == EIE | DMAR && self.status & ORE != 0;
        asked(TXEIE, TXE)
            || asked(TCIE, TC)
            || asked(RXNEIE, RXNE | ORE)
            || asked(IDLEIE, IDLE)
            || overrun
    }

    /// Reads the register at `offset` from its base.
    pub(crate) fn read(&mut self, offset: u32) -> u32 {
        match offset {
            0x00 => {
                self.shown = self.status;
                self.status
            }
            0x04 => {
                self.status &= !(RXNE | self.shown & (ORE | IDLE));
                self.shown = 0;
                u32::from(self.received)
            }
            0x08 => self.brr,
            0x0C => self.cr1,
            0x10 => self.cr2,
            0x14 => self.cr3,
            0x18 => self.gtpr,
            _ => 0,
        }
    }

    /// Writes the register at `offset` from its base. Returns the requests to DMA.
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        warnings: &mut Warnings,
    ) -> UsartRequests {
        let mut requests = UsartRequests::default();
        let before = (self.brr, self.cr1 & (M | TE | OVER8));
        match offset {
            0x00 => self.status &= value | !(RXNE | TC),
            0x04 => requests.transmit = self.transmit(value as u8, now, warnings),
            0x08 => self.brr = value,
            0x0C => self.write_control(value, now),
            0x10 => self.cr2 = value,
            0x14 => {
                // A flag that is already set requests at once.
                self.cr3 = value;
                requests = self.requests();
            }
            0x18 => self.gtpr = value,
            _ => {}
        }
        let base = self.base;
        if !self.is_modelled() {
            warnings.add(Warning::UsartMode { base });
        }
        if self.shifting.is_some() && before != (self.brr, self.cr1 & (M | TE | OVER8)) {
            warnings.add(Warning::UsartDisturbed { base });
        }
        requests
    }

    fn write_control(&mut self, value: u32, now: u64) {
        let was_on = self.has(UE | RE);
        self.cr1 = value;
        self.misses |= self.has_begun(now) && self.has(UE | RE) && !was_on;
    }

    /// Returns true if all that the registers ask for is modelled.
    fn is_modelled(&self) -> bool {
        let runs = self.has(UE) && self.cr1 & (TE | RE) != 0;
        let has_rate = self.brr >= LEAST_DIVIDER && (!self.has(OVER8) || self.brr & 8 == 0);
        self.cr1 & CR1_UNKNOWN == 0
            && self.cr2 & CR2_UNKNOWN == 0
            && self.cr3 & CR3_UNKNOWN == 0
            && self.gtpr == 0
            && (has_rate || !runs)
    }

    fn transmit(&mut self, byte: u8, now: u64, warnings: &mut Warnings) -> bool {
        if !self.has(UE | TE) {
            return false;
        }
        // Reading SR and then writing DR clears TC. DMA does not read SR, so that TC stays set
        // (RM0090 section 30.6.1).
        self.status &= !(self.shown & TC);
        self.shown &= !TC;
        if self.shifting.is_none() {
            self.shifting = Some(byte);
            self.sent_at = now + self.frame();
            return self.cr3 & DMAT != 0;
        }
        if self.waiting.replace(byte).is_some() {
            warnings.add(Warning::UsartOverwrite { base: self.base });
        }
        self.status &= !TXE;
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOTH: Connected = Connected {
        output: true,
        input: true,
    };

    /// A USART at 115200 baud on a bus of 42 MHz: a bit has 365 clocks of 4 cycles.
    fn started() -> (Usart, Warnings) {
        let (mut usart, mut warnings) = (Usart::new(0x4000_4400), Warnings::default());
        usart.set_bus_clock(4);
        usart.connect(BOTH, 0);
        usart.write(0x08, 365, 0, &mut warnings);
        usart.write(0x0C, UE | TE | RE | RXNEIE, 0, &mut warnings);
        (usart, warnings)
    }

    #[test]
    fn a_byte_takes_ten_bits() {
        let (mut usart, _) = started();
        usart.send(b"?", 1000);
        assert_eq!(usart.next_event(), 1000 + 10 * 365 * 4);
        usart.event(usart.next_event());
        assert!(usart.interrupt());
        assert_eq!(usart.read(0x04), u32::from(b'?'));
        assert!(!usart.interrupt());
    }

    #[test]
    fn a_second_byte_before_the_first_was_read_is_lost_and_reported() {
        let (mut usart, _) = started();
        usart.send(b"ab", 0);
        usart.event(usart.next_event());
        usart.event(usart.next_event());
        assert_eq!(usart.overruns, 1);
        assert_eq!(usart.read(0x00) & (ORE | RXNE), ORE | RXNE);
        assert_eq!(usart.read(0x04), u32::from(b'a'));
        assert_eq!(usart.read(0x00) & (ORE | RXNE), 0);
    }

    #[test]
    fn a_byte_that_is_there_when_dma_is_enabled_is_asked_for() {
        let (mut usart, mut warnings) = started();
        assert!(!usart.write(0x14, DMAR, 0, &mut warnings).receive);
        usart.write(0x14, 0, 0, &mut warnings);
        usart.send(b"a", 0);
        assert!(!usart.event(usart.next_event()).receive);
        assert!(usart.write(0x14, DMAR, 0, &mut warnings).receive);
    }

    #[test]
    fn an_overrun_that_sr_was_not_read_for_stays() {
        let (mut usart, _) = started();
        usart.send(b"ab", 0);
        usart.event(usart.next_event());
        usart.event(usart.next_event());
        usart.read(0x04);
        assert!(usart.interrupt());
    }

    #[test]
    fn after_an_overrun_no_byte_comes_until_sr_and_dr_have_been_read() {
        let (mut usart, _) = started();
        usart.send(b"abcd", 0);
        let next = |usart: &mut Usart| {
            usart.event(usart.next_event());
        };
        next(&mut usart);
        next(&mut usart);
        assert_eq!(usart.read(0x04), u32::from(b'a'), "clears RXNE, not ORE");
        next(&mut usart);
        assert_eq!(usart.read(0x00) & (ORE | RXNE), ORE);
        assert_eq!(usart.overruns, 2);
        usart.read(0x04);
        next(&mut usart);
        assert_eq!(usart.read(0x00) & (ORE | RXNE), RXNE);
        assert_eq!(usart.read(0x04), u32::from(b'd'));
    }

    #[test]
    fn a_byte_that_began_before_the_receiver_was_on_is_lost() {
        let (mut usart, mut warnings) = started();
        usart.write(0x0C, UE | TE, 0, &mut warnings);
        usart.send(b"ab", 0);
        usart.write(0x0C, UE | TE | RE, 1, &mut warnings);
        usart.event(usart.next_event());
        assert_eq!(usart.read(0x00) & RXNE, 0);
        usart.event(usart.next_event());
        assert_eq!(usart.read(0x04), u32::from(b'b'));
        assert_eq!(warnings.all(), []);
    }

    #[test]
    fn a_byte_is_lost_if_its_pin_has_not_the_function_all_the_time() {
        let none = Connected::default();
        for (at_start, amid, at_end) in [(none, none, none), (BOTH, none, BOTH), (none, BOTH, BOTH)]
        {
            let (mut usart, mut warnings) = started();
            usart.connect(at_start, 0);
            usart.send(b"ab", 0);
            usart.write(0x04, u32::from(b'c'), 0, &mut warnings);
            usart.connect(amid, 5000);
            usart.connect(at_end, 6000);
            usart.event(usart.next_event());
            assert_eq!(usart.read(0x00) & RXNE, 0);
            assert_eq!(usart.output, b"");
            usart.connect(BOTH, usart.next_event() - 14_600);
            usart.event(usart.next_event());
            assert_eq!(usart.read(0x04), u32::from(b'b'));
        }
    }

    #[test]
    fn what_is_not_modelled_is_said() {
        for (register, value) in [
            (0x08, 15),
            (0x0C, UE | TE | 1),
            (0x0C, UE | TE | 1 << 10),
            (0x0C, UE | TE | M),
            (0x10, 1 << 14),
            (0x10, 1 << 12),
            (0x14, 1 << 3),
            (0x14, 1 << 9),
            (0x18, 1),
        ] {
            let (mut usart, mut warnings) = started();
            assert_eq!(warnings.all(), []);
            usart.write(register, value, 0, &mut warnings);
            let base = 0x4000_4400;
            let expected = [Warning::UsartMode { base }];
            assert_eq!(warnings.all(), expected, "{register:#x} {value:#x}");
        }
    }

    #[test]
    fn a_change_while_a_byte_goes_out_is_said() {
        for (register, value) in [(0x08, 100), (0x0C, UE | RE)] {
            let (mut usart, mut warnings) = started();
            usart.write(0x04, u32::from(b'o'), 0, &mut warnings);
            usart.write(register, value, 100, &mut warnings);
            let base = 0x4000_4400;
            assert_eq!(warnings.all(), [Warning::UsartDisturbed { base }]);
        }
    }

    #[test]
    fn the_line_is_idle_a_byte_after_the_last() {
        let (mut usart, _) = started();
        usart.send(b"a", 0);
        usart.event(usart.next_event());
        assert_eq!(usart.read(0x00) & IDLE, 0);
        usart.event(usart.next_event());
        assert_eq!(usart.read(0x00) & IDLE, IDLE);
    }

    #[test]
    fn a_receiver_that_is_off_sees_no_idle_line() {
        let (mut usart, mut warnings) = started();
        usart.write(0x0C, UE | TE, 0, &mut warnings);
        usart.send(b"a", 0);
        usart.event(usart.next_event());
        usart.event(usart.next_event());
        assert_eq!(usart.read(0x00), TC | TXE);
    }

    #[test]
    fn a_transmission_stays_complete_until_sr_has_been_read_and_dr_written() {
        let (mut usart, mut warnings) = started();
        usart.write(0x04, u32::from(b'o'), 0, &mut warnings);
        assert_ne!(usart.read(0x00) & TC, 0);
        usart.write(0x04, u32::from(b'k'), 0, &mut warnings);
        assert_eq!(usart.read(0x00) & TC, 0);
        usart.event(14_600);
        usart.event(29_200);
        assert_ne!(usart.read(0x00) & TC, 0);
        usart.write(0x00, !TC, 29_200, &mut warnings);
        assert_eq!(usart.read(0x00) & TC, 0);
    }

    #[test]
    fn two_bytes_leave_one_after_the_other_and_a_third_overwrites() {
        let (mut usart, mut warnings) = started();
        usart.write(0x04, u32::from(b'o'), 0, &mut warnings);
        assert_ne!(usart.read(0x00) & TXE, 0);
        usart.write(0x04, u32::from(b'k'), 0, &mut warnings);
        assert_eq!(usart.read(0x00) & TXE, 0);
        usart.event(14_600);
        assert_ne!(usart.read(0x00) & TXE, 0);
        assert_eq!(usart.read(0x00) & TC, 0);
        usart.event(29_200);
        assert_eq!(usart.output, b"ok");
        assert_ne!(usart.read(0x00) & TC, 0);
        assert_eq!(warnings.all(), []);
        for byte in b"abc" {
            usart.write(0x04, u32::from(*byte), 30_000, &mut warnings);
        }
        let base = 0x4000_4400;
        assert_eq!(warnings.all(), [Warning::UsartOverwrite { base }]);
    }

    #[test]
    fn oversampling_by_eight_halves_the_divider() {
        let (mut usart, mut warnings) = started();
        usart.write(0x0C, UE | TE | RE | OVER8, 0, &mut warnings);
        usart.write(0x08, 2 << 4 | 5, 0, &mut warnings); // 2 Mbaud at 42 MHz
        assert_eq!(usart.frame(), 10 * 21 * 4);
    }
}
