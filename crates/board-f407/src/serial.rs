//! The serial line: USART1 or USART2 (RM0090 chapter 30), whose bytes DMA carries (chapter 10).
//!
//! ```text
//!   pin -> DMA -> ring -> Receiver -> main loop
//!                         Every 50 µs: realtime bytes are picked out, all others are queued.
//!   pin <- DMA <- ring <- main loop: Writer
//!          The interrupt at the end of a piece starts the next piece.
//! ```
//!
//! At 2 Mbaud a byte comes every 5 µs: an interrupt for each byte would take a quarter of the CPU,
//! and no interrupt could come while the flash is written. DMA needs no program.
use crate::{
    chip::Usart,
    clock::{self, wake, APB1_HZ, APB1_TIMER_HZ},
    gpio::Pull,
    profile::{self, BAUD},
    registers::{self, Word},
};
use core::sync::atomic::{
    AtomicBool, AtomicU16, AtomicU8, AtomicUsize,
    Ordering::{Acquire, Relaxed, Release},
};
use leadscrew_machine::protocol::serial::{Receiver, DEFAULT_RX};
use stm32f4::stm32f407::{dma2, usart1, Interrupt, RCC, TIM7};

/// Function of USART1 to USART3 in the data sheet's table 9.
const FUNCTION: u8 = 7;

/// The USART of the line.
#[cfg(not(record))]
fn line() -> Usart {
    profile::usart()
}

/// True if the line is on USART1. `enable` takes it from the record.
#[cfg(record)]
static ON_USART1: AtomicBool = AtomicBool::new(false);

/// The USART of the line.
#[cfg(record)]
fn line() -> Usart {
    match ON_USART1.load(Relaxed) {
        true => Usart::Usart1,
        false => Usart::Usart2,
    }
}

/// Clock of the USART in Hz.
fn clock_hz() -> u32 {
    match line() {
        Usart::Usart1 => 2 * APB1_HZ,
        Usart::Usart2 => APB1_HZ,
    }
}

/// The channel of the line's DMA streams, the same for both USARTs: USART2 uses streams of DMA1,
/// USART1 uses streams of DMA2 (RM0090 tables 43 and 44).
const CHANNEL: u8 = 4;

/// The line's USART. It is written at start-up only; the bytes go through DMA.
fn usart() -> &'static usart1::RegisterBlock {
    registers::usart(line())
}

/// The line's DMA controller. The line uses two of its streams: `Listener` has one, `Sender` the
/// other.
fn dma() -> &'static dma2::RegisterBlock {
    registers::dma(line())
}

/// A stream of the line's controller, 4 to 7.
#[derive(Clone, Copy)]
struct Stream(usize);

impl Stream {
    fn registers(self) -> &'static dma2::ST {
        dma().st(self.0)
    }

    /// Writes each received byte to `ring`, in half-words, for ever. The stream must be off.
    fn fill(self, ring: &'static [AtomicU16]) {
        self.clear_flags();
        registers::aim(self.registers(), usart().dr(), ring);
        self.registers().cr().write(|w| {
            w.chsel().set(CHANNEL).pl().very_high().circ().enabled();
            w.psize().bits16().msize().bits16().minc().incremented();
            w.en().enabled()
        });
    }

    /// Sends `bytes`. The stream must be off.
    fn send(self, bytes: &'static [AtomicU8]) {
        self.clear_flags();
        registers::aim(self.registers(), usart().dr(), bytes);
        // The writes to the ring are in the memory before DMA reads it.
        cortex_m::asm::dmb();
        self.registers().cr().write(|w| {
            w.chsel().set(CHANNEL).minc().incremented();
            w.dir().memory_to_peripheral();
            w.tcie().enabled().en().enabled()
        });
    }

    /// A stream starts only with its flags cleared (RM0090 section 10.3.17). They are five bits of
    /// six in the high register (section 10.5.4).
    fn clear_flags(self) {
        let first = [0, 6, 16, 22][self.0 - 4];
        dma().hifcr().put(0x3D << first);
    }
}

/// Switches on the clocks of the USART, its DMA controller and the timer of [`Listener`]. Before
/// anything else here.
pub(crate) fn enable(rcc: &RCC) {
    #[cfg(record)]
    ON_USART1.store(profile::usart() == Usart::Usart1, Relaxed);
    clock::switch_on(rcc, |rcc| {
        match line() {
            Usart::Usart1 => {
                rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
                rcc.ahb1enr().modify(|_, w| w.dma2en().enabled());
            }
            Usart::Usart2 => {
                rcc.apb1enr().modify(|_, w| w.usart2en().enabled());
                rcc.ahb1enr().modify(|_, w| w.dma1en().enabled());
            }
        }
        rcc.apb1enr().modify(|_, w| w.tim7en().enabled());
    });
}

/// Starts the line: 8 bits, no parity, one stop bit. Once, after [`Listener::new`].
pub(crate) fn start() {
    let (transmit, receive) = profile::serial_pins();
    transmit.make_alternate(FUNCTION, Pull::None);
    receive.make_alternate(FUNCTION, Pull::Up);
    // The divider, counted in sixteenths, is the number of clock periods in a bit, rounded (RM0090
    // section 30.3.4).
    let divider = (clock_hz() + BAUD / 2) / BAUD;
    // The register holds the divider's mantissa and fraction side by side, so it takes this number.
    // 16 to 0xFFFF are allowed.
    usart().brr().put(divider as u16);
    // A bootloader may have left two stop bits, or the flag of an overrun, with which no byte is
    // received until SR and then DR have been read (section 30.3.3).
    usart().cr2().reset();
    let _ = usart().sr().read();
    let _ = usart().dr().read();
    usart().cr3().write(|w| w.dmar().enabled().dmat().enabled());
    usart()
        .cr1()
        .write(|w| w.ue().enabled().te().enabled().re().enabled());
}

/// The time between two looks at the ring, in microseconds: a realtime byte is seen no later than
/// this. Ten bytes at 2 Mbaud.
const EVERY_US: u32 = 50;

/// Places of the ring. Writing the flash may hold the CPU up for 2 ms, in which 400 bytes come at 2
/// Mbaud. Erasing a sector in mid-run holds it up for half a second, 2 s at most. For this the ring
/// has room for all bytes that a sender may have under way unanswered, and for 64 realtime bytes.
const ARRIVAL_RING: usize = DEFAULT_RX + 64;
/// In SRAM: DMA does not reach the core coupled memory.
static ARRIVED: [AtomicU16; ARRIVAL_RING] = [const { AtomicU16::new(0) }; ARRIVAL_RING];
/// Marks a place to which nothing has come. A byte leaves the upper half zero.
const EMPTY: u16 = u16::MAX;

/// The stream that receives: of DMA1 for USART2, of DMA2 for USART1 (RM0090 tables 43 and 44).
const ARRIVAL_STREAM: Stream = Stream(5);

fn place(number: usize) -> &'static AtomicU16 {
    &ARRIVED[number % ARRIVAL_RING]
}

/// Listens to the line: TIM7's interrupt.
///
/// DMA writes each byte to the next place of a ring, and never stops. A place is a half-word, as
/// the USART's data register is. A place that has been read is marked empty, so that the ring alone
/// tells which bytes are new. A count of bytes could wrap around unseen.
#[allow(unreachable_pub)] // RTIC hands it out in a public type
pub struct Listener {
    timer: TIM7,
    receiver: Receiver<'static>,
    /// The place that is filled next.
    next: usize,
}

impl Listener {
    /// Listens from here on.
    pub(crate) fn new(timer: TIM7, receiver: Receiver<'static>) -> Self {
        empty_arrivals();
        ARRIVAL_STREAM.fill(&ARRIVED);
        let counts = APB1_TIMER_HZ / 1_000_000 * EVERY_US;
        timer.arr().write(|w| w.arr().set(counts as u16 - 1));
        timer.dier().write(|w| w.uie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        Self {
            timer,
            receiver,
            next: 0,
        }
    }

    /// Takes the received bytes. Interrupt of TIM7.
    pub(crate) fn listen(&mut self) {
        self.timer.sr().write(|w| w.uif().clear_bit());
        let begin = self.next;
        // If the last place has been filled, the ring is full, and some bytes may have been written
        // over.
        if place(begin + ARRIVAL_RING - 1).load(Relaxed) != EMPTY {
            return self.lose();
        }
        loop {
            let datum = place(self.next).load(Relaxed);
            if datum == EMPTY {
                break;
            }
            place(self.next).store(EMPTY, Relaxed);
            self.receiver.receive(datum as u8);
            self.next += 1;
        }
        if self.next != begin {
            self.next %= ARRIVAL_RING;
            wake();
        }
    }

    /// Forgets all bytes that have come: the CPU stood still for longer than the ring lasts. A byte
    /// that comes between the last two lines is taken for another overrun later, and forgotten as
    /// well.
    #[cold]
    fn lose(&mut self) {
        defmt::error!("bytes of the serial line lost");
        self.receiver.lose(ARRIVAL_RING as u32);
        empty_arrivals();
        self.next =
            ARRIVAL_RING - usize::from(ARRIVAL_STREAM.registers().ndtr().read().ndt().bits());
    }
}

fn empty_arrivals() {
    for place in &ARRIVED {
        place.store(EMPTY, Relaxed);
    }
}

/// Bytes that the ring has room for: the two messages that may come before the banner. A power of
/// two.
const SENDING_RING: usize = 128;
/// The most bytes of the machine that wait to be sent: as many as the line sends in 0.7 ms, 8 at
/// least, and the whole ring at most. They are few, because a report waits for the bytes before it.
/// Bytes that find no room wait in the machine.
const AHEAD: usize = match BAUD / 10 * 7 / 10_000 {
    0..8 => 8,
    bytes @ 8..128 => bytes as usize,
    128.. => SENDING_RING,
};
/// The most bytes in a piece: while one piece is sent, the main loop brings the next.
const PIECE: usize = AHEAD / 2;

/// In SRAM: DMA does not reach the core coupled memory.
static WAITING: [AtomicU8; SENDING_RING] = [const { AtomicU8::new(0) }; SENDING_RING];
/// Bytes written to the ring since power-up, modulo 2³². Written by the main loop.
static WRITTEN: AtomicUsize = AtomicUsize::new(0);
/// The number of these bytes that have been sent, modulo 2³². Written by the interrupt.
static SENT: AtomicUsize = AtomicUsize::new(0);
/// True if the main loop has more bytes than there was room for, and wants to be woken.
static MORE: AtomicBool = AtomicBool::new(false);

/// The stream that sends: of DMA1 for USART2, of DMA2 for USART1 (RM0090 tables 43 and 44).
fn sending_stream() -> Stream {
    match line() {
        Usart::Usart1 => Stream(7),
        Usart::Usart2 => Stream(6),
    }
}

/// The interrupt at the end of a piece. [`Writer`] pends it when there is something to send.
fn sending_interrupt() -> Interrupt {
    match line() {
        Usart::Usart1 => Interrupt::DMA2_STREAM7,
        Usart::Usart2 => Interrupt::DMA1_STREAM6,
    }
}

/// The main loop's end of sending: it writes bytes to a ring. DMA sends the ring in contiguous
/// pieces, and an interrupt comes at the end of each piece.
pub(crate) struct Writer {
    written: usize,
}

impl Writer {
    /// Nothing has been written yet. Once.
    pub(crate) const fn new() -> Self {
        Self { written: 0 }
    }

    /// Takes as many of the machine's `bytes` as there is room for; returns how many.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> usize {
        self.fill(bytes, AHEAD)
    }

    /// Takes a message that comes before the machine's first message.
    pub(crate) fn say(&mut self, message: &[u8]) {
        self.fill(message, SENDING_RING);
    }

    /// Takes `bytes` until `most` wait; returns how many.
    fn fill(&mut self, bytes: &[u8], most: usize) -> usize {
        let waiting = self.written.wrapping_sub(SENT.load(Acquire));
        let taken = bytes.len().min(most.saturating_sub(waiting));
        for byte in bytes.iter().take(taken) {
            WAITING[self.written % SENDING_RING].store(*byte, Relaxed);
            self.written = self.written.wrapping_add(1);
        }
        WRITTEN.store(self.written, Release);
        MORE.store(taken < bytes.len(), Relaxed);
        rtic::pend(sending_interrupt());
        taken
    }
}

/// The interrupt's end of sending.
#[allow(unreachable_pub)] // RTIC hands it out in a public type
pub struct Sender {
    sent: usize,
    /// Bytes of the piece that is going out.
    under_way: usize,
}

impl Sender {
    /// Nothing has been sent yet. Once.
    pub(crate) const fn new() -> Self {
        Self {
            sent: 0,
            under_way: 0,
        }
    }

    /// Sends the next piece, unless one is going out. Interrupt of the stream.
    pub(crate) fn send(&mut self) {
        if sending_stream().registers().cr().read().en().is_enabled() {
            return;
        }
        self.sent = self.sent.wrapping_add(self.under_way);
        SENT.store(self.sent, Release);
        if MORE.load(Relaxed) {
            wake();
        }
        let waiting = WRITTEN.load(Acquire).wrapping_sub(self.sent);
        let begin = self.sent % SENDING_RING;
        self.under_way = waiting.min(SENDING_RING - begin).min(PIECE);
        sending_stream().clear_flags();
        let piece = WAITING.get(begin..begin + self.under_way);
        if let Some(piece) = piece.filter(|piece| !piece.is_empty()) {
            sending_stream().send(piece);
        }
    }
}
