//! Sending: the main loop writes to a ring, DMA sends it in contiguous pieces, and an interrupt
//! comes at the end of each piece.
use super::{line, Stream};
use crate::{chip::Usart, profile::BAUD, wake::wake};
use core::sync::atomic::{
    AtomicBool, AtomicU8, AtomicUsize,
    Ordering::{Acquire, Relaxed, Release},
};
use stm32f4::stm32f407::Interrupt;

/// Bytes that the ring has room for: the two messages that may come before the banner. A power of
/// two.
const RING: usize = 128;
/// The most bytes of the machine that wait to be sent: as many as the line sends in 0.7 ms, 8 at
/// least, and the whole ring at most. They are few, because a report waits for the bytes before it.
/// Bytes that find no room wait in the machine.
const AHEAD: usize = match BAUD / 10 * 7 / 10_000 {
    0..8 => 8,
    bytes @ 8..128 => bytes as usize,
    128.. => RING,
};
/// The most bytes in a piece: while one piece is sent, the main loop brings the next.
const PIECE: usize = AHEAD / 2;

/// In SRAM: DMA does not reach the core coupled memory.
static WAITING: [AtomicU8; RING] = [const { AtomicU8::new(0) }; RING];
/// Bytes written to the ring since power-up, modulo 2³². Written by the main loop.
static WRITTEN: AtomicUsize = AtomicUsize::new(0);
/// The number of these bytes that have been sent, modulo 2³². Written by the interrupt.
static SENT: AtomicUsize = AtomicUsize::new(0);
/// Whether the main loop has more bytes than there was room for, and wants to be woken.
static MORE: AtomicBool = AtomicBool::new(false);

/// The stream that sends: of DMA1 for USART2, of DMA2 for USART1 (RM0090 tables 43 and 44).
fn stream() -> Stream {
    match line() {
        Usart::Usart1 => Stream(7),
        Usart::Usart2 => Stream(6),
    }
}

/// The interrupt at the end of a piece. [`Writer`] pends it when there is something to send.
fn interrupt() -> Interrupt {
    match line() {
        Usart::Usart1 => Interrupt::DMA2_STREAM7,
        Usart::Usart2 => Interrupt::DMA1_STREAM6,
    }
}

/// The main loop's end.
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

    /// Takes a message that comes before the machine's first.
    pub(crate) fn say(&mut self, message: &[u8]) {
        self.fill(message, RING);
    }

    /// Takes `bytes` until `most` wait; returns how many.
    fn fill(&mut self, bytes: &[u8], most: usize) -> usize {
        let waiting = self.written.wrapping_sub(SENT.load(Acquire));
        let taken = bytes.len().min(most.saturating_sub(waiting));
        for byte in bytes.iter().take(taken) {
            WAITING[self.written % RING].store(*byte, Relaxed);
            self.written = self.written.wrapping_add(1);
        }
        WRITTEN.store(self.written, Release);
        MORE.store(taken < bytes.len(), Relaxed);
        rtic::pend(interrupt());
        taken
    }
}

/// The interrupt's end.
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
        if stream().registers().cr().read().en().is_enabled() {
            return;
        }
        self.sent = self.sent.wrapping_add(self.under_way);
        SENT.store(self.sent, Release);
        if MORE.load(Relaxed) {
            wake();
        }
        let waiting = WRITTEN.load(Acquire).wrapping_sub(self.sent);
        let begin = self.sent % RING;
        self.under_way = waiting.min(RING - begin).min(PIECE);
        stream().clear_flags();
        let piece = WAITING.get(begin..begin + self.under_way);
        if let Some(piece) = piece.filter(|piece| !piece.is_empty()) {
            stream().send(piece);
        }
    }
}
