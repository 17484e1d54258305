//! The serial line: USART1 or USART2 (RM0090 chapter 30), whose bytes DMA carries (chapter 10).
//!
//! ```text
//!   pin -> DMA -> ring -> Receiver -> main loop
//!                         Every 50 µs: realtime bytes are picked out, all others are queued.
//!   pin <- DMA <- ring <- main loop: Writer
//!          The interrupt at the end of a piece starts the next piece.
//! ```
//!
//! At 2 Mbaud a byte comes every 5 µs: an interrupt for each would take a quarter of the CPU, and
//! none could come while the flash is written. DMA needs no program.
mod listen;
mod send;

use crate::{
    chip::Usart,
    clock::{self, APB1_HZ},
    gpio::Pull,
    profile::{self, BAUD},
    registers::{self, Word},
};
use core::sync::atomic::{AtomicU16, AtomicU8};
use stm32f4::stm32f407::{dma2, usart1, RCC};

#[cfg(record)]
use core::sync::atomic::{AtomicBool, Ordering::Relaxed};

pub(crate) use listen::Listener;
pub(crate) use send::{Sender, Writer};

/// Function of USART1 to USART3 in the data sheet's table 9.
const FUNCTION: u8 = 7;

/// The USART of the line.
#[cfg(not(record))]
fn line() -> Usart {
    profile::usart()
}

/// Whether the line is on USART1. `enable` takes it from the record.
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

/// The channel of the DMA streams for either USART: those of DMA1 for USART2, those of DMA2 for
/// USART1 (RM0090 tables 43 and 44).
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
    // The divider in sixteenths, which are periods of the clock a bit, rounded (RM0090 section
    // 30.3.4).
    let divider = (clock_hz() + BAUD / 2) / BAUD;
    // The register holds mantissa and fraction together, which are this number; 16 to 0xFFFF are
    // defined.
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
