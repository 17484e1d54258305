//! The interrupt's end of the line: received bytes.
//!
//! DMA writes each byte to the next place of a ring, and never stops. A place is a half-word, as
//! the USART's data register is. A place that has been read is marked empty, so that the ring alone
//! says what is new: there is no count that could come round unseen.
use super::Stream;
use crate::{clock::APB1_TIMER_HZ, wake::wake};
use core::sync::atomic::{AtomicU16, Ordering::Relaxed};
use leadscrew_machine::protocol::serial::{Receiver, DEFAULT_RX};
use stm32f4::stm32f407::TIM7;

/// How often the ring is looked at, in microseconds: a realtime byte is seen no later than this.
/// Ten bytes at 2 Mbaud.
const EVERY_US: u32 = 50;

/// Places of the ring. Writing the flash may hold the CPU up for 2 ms, in which 400 bytes come at 2
/// Mbaud. Erasing a sector in mid-run holds it up for half a second, 2 s at most. For this the ring
/// has room for all bytes that a sender may have under way unanswered, and for 64 realtime bytes.
const RING: usize = DEFAULT_RX + 64;
/// In SRAM: DMA does not reach the core coupled memory.
static ARRIVED: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];
/// Marks a place to which nothing has come. A byte leaves the upper half zero.
const EMPTY: u16 = u16::MAX;

/// The stream that receives: of DMA1 for USART2, of DMA2 for USART1 (RM0090 tables 43 and 44).
const STREAM: Stream = Stream(5);

fn place(number: usize) -> &'static AtomicU16 {
    &ARRIVED[number % RING]
}

/// Listens to the line: TIM7's interrupt.
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
        empty();
        STREAM.fill(&ARRIVED);
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
        // The last place to be filled: the ring is full, and some bytes may have been written over.
        if place(begin + RING - 1).load(Relaxed) != EMPTY {
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
            self.next %= RING;
            wake();
        }
    }

    /// Forgets all bytes that have come: the CPU stood still for longer than the ring lasts. A byte
    /// that comes between the last two lines is taken for another overrun later, and forgotten as
    /// well.
    #[cold]
    fn lose(&mut self) {
        defmt::error!("bytes of the serial line lost");
        self.receiver.lose(RING as u32);
        empty();
        self.next = RING - usize::from(STREAM.registers().ndtr().read().ndt().bits());
    }
}

fn empty() {
    for place in &ARRIVED {
        place.store(EMPTY, Relaxed);
    }
}
