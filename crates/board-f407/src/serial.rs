//! The serial line: USART1 or USART2, byte by byte (RM0090 chapter 30).
//!
//! ```text
//!   pin -> interrupt -> Receiver: realtime bytes picked out, all others queued -> main loop
//!   pin <- interrupt <- queue of bytes to send                                 <- main loop: Board::write
//! ```
//!
//! While the flash is written no interrupt runs, and at 2 Mbaud a byte comes every 5 µs. A DMA stream keeps them then
//! ([`Catch`]): DMA needs no program.
use crate::{
    clock::APB1_HZ,
    gpio::Pull,
    profile::{BAUD, PROFILE},
    wake::wake,
};
use core::sync::atomic::{AtomicBool, AtomicU8, Ordering::Relaxed};
use heapless::spsc::{Consumer, Queue};
use leadscrew_machine::protocol::serial::Receiver;
use stm32f4::stm32f407::{dma2, usart1, Interrupt, DMA1, DMA2, RCC, USART1, USART2};

/// Bytes to send, and the place that a ring keeps free. Few, as a report waits for those before it: 128 are 11 ms at 115 200
/// baud, and the two messages that may come before the banner fit in. What the queue does not take waits in the machine.
pub(crate) type Outgoing = Queue<u8, 129>;

/// Function of USART1 to USART3 in the data sheet's table 9.
const FUNCTION: u8 = 7;

/// Bytes that can come while a record is written: 2 ms at 2 Mbaud are 400.
const CAUGHT: usize = 512;
/// Where DMA puts them. In SRAM: DMA does not reach the core coupled memory.
static CATCH: [AtomicU8; CAUGHT] = [const { AtomicU8::new(0) }; CAUGHT];
/// DMA has the bytes that come. `Catch` begins that, the interrupt ends it.
static CATCHING: AtomicBool = AtomicBool::new(false);
/// The flash is written: the next interrupt takes the bytes back. One that comes before, for a byte to be sent or since it
/// was pending when DMA got the bytes, leaves them to it.
static WRITTEN: AtomicBool = AtomicBool::new(false);
/// Both receivers are channel 4 of stream 5: USART2's of DMA1, USART1's of DMA2 (RM0090 tables 42 and 43).
const CHANNEL: u8 = 4;
const STREAM: usize = 5;

/// Which USART the line is on.
#[derive(Clone, Copy, PartialEq, Eq)]
#[allow(dead_code)] // a board uses one of them
pub(crate) enum Usart {
    /// On APB2.
    Usart1,
    /// On APB1.
    Usart2,
}

const LINE: Usart = PROFILE.serial.usart;

/// The line's interrupt, for whoever has something for it.
pub(crate) const INTERRUPT: Interrupt = match LINE {
    Usart::Usart1 => Interrupt::USART1,
    Usart::Usart2 => Interrupt::USART2,
};

/// Clock of the USART in Hz.
const CLOCK_HZ: u32 = match LINE {
    Usart::Usart1 => 2 * APB1_HZ,
    Usart::Usart2 => APB1_HZ,
};

fn usart() -> &'static usart1::RegisterBlock {
    let address = match LINE {
        Usart::Usart1 => USART1::ptr(),
        Usart::Usart2 => USART2::ptr(),
    };
    // SAFETY: see `Port` and `Catch` for who writes what.
    #[allow(unsafe_code)]
    unsafe {
        &*address
    }
}

fn dma() -> &'static dma2::RegisterBlock {
    let address = match LINE {
        Usart::Usart1 => DMA2::ptr(),
        Usart::Usart2 => DMA1::ptr(),
    };
    // SAFETY: of each controller only one stream is in use. `Catch` starts it, `Port` ends it.
    #[allow(unsafe_code)]
    unsafe {
        &*address
    }
}

fn stream() -> &'static dma2::ST {
    dma().st(STREAM)
}

/// Switches the USART and its DMA controller on. Before anything else here.
pub(crate) fn enable(rcc: &RCC) {
    match LINE {
        Usart::Usart1 => {
            rcc.apb2enr().modify(|_, w| w.usart1en().enabled());
            rcc.ahb1enr().modify(|_, w| w.dma2en().enabled());
        }
        Usart::Usart2 => {
            rcc.apb1enr().modify(|_, w| w.usart2en().enabled());
            rcc.ahb1enr().modify(|_, w| w.dma1en().enabled());
        }
    }
}

/// The interrupt's end of the line.
#[allow(unreachable_pub)] // RTIC hands it out in a public type
pub struct Port {
    receiver: Receiver<'static>,
    outgoing: Consumer<'static, u8>,
    /// An interrupt is asked for when the next byte can be sent. Kept here, because the USART answers slowly, and every byte
    /// that comes would pay for it.
    sending: bool,
}

impl Port {
    /// Starts the line: 8 bits, no parity, one stop bit.
    pub(crate) fn new(receiver: Receiver<'static>, outgoing: Consumer<'static, u8>) -> Self {
        let pins = &PROFILE.serial;
        pins.transmit.make_alternate(FUNCTION, Pull::None);
        pins.receive.make_alternate(FUNCTION, Pull::Up);
        // Sixteenths of the clock a bit, rounded (RM0090 section 30.3.4).
        let divider = (CLOCK_HZ + BAUD / 2) / BAUD;
        // SAFETY: mantissa and fraction together are the whole divider; 16 to 0xFFFF is defined.
        #[allow(unsafe_code)]
        usart().brr().write(|w| unsafe { w.bits(divider as u16) });
        usart().cr1().write(|w| {
            w.ue().enabled().te().enabled().re().enabled();
            w.rxneie().enabled()
        });
        Self {
            receiver,
            outgoing,
            sending: false,
        }
    }

    /// Takes the byte that has come, sends the next. Interrupt of the USART, or pended by whoever has queued bytes.
    pub(crate) fn on_interrupt(&mut self) {
        if CATCHING.load(Relaxed) && WRITTEN.load(Relaxed) {
            self.release();
        }
        let receives = !CATCHING.load(Relaxed);
        let status = usart().sr().read();
        // Reading the data after the status clears an overrun as well.
        if receives && (status.rxne().bit_is_set() || status.ore().bit_is_set()) {
            let byte = usart().dr().read().bits() as u8;
            if status.rxne().bit_is_set() {
                self.receiver.receive(byte);
                wake();
            }
        }
        if status.txe().bit_is_set() {
            self.send();
        }
    }

    /// Sends the next byte; asks for no further interrupt where there is none. With the last one the main loop is asked for
    /// more: it has two bytes' time for that.
    fn send(&mut self) {
        let byte = self.outgoing.dequeue();
        if let Some(byte) = byte {
            usart().dr().write(|w| w.dr().set(byte.into()));
            if !self.outgoing.ready() {
                wake();
            }
        }
        if self.sending != byte.is_some() {
            self.sending = byte.is_some();
            usart().cr1().modify(|_, w| w.txeie().bit(self.sending));
        }
    }

    /// Takes the bytes that DMA has caught, in their order, and goes on by itself. Bytes may come all the time: DMA goes
    /// on until they have been caught up with.
    fn release(&mut self) {
        let mut taken = 0;
        loop {
            taken = self.take_caught(taken);
            if taken == caught() {
                break;
            }
        }
        usart().cr3().modify(|_, w| w.dmar().disabled());
        self.take_caught(taken);
        stream().cr().modify(|_, w| w.en().disabled());
        CATCHING.store(false, Relaxed);
        usart().cr1().modify(|_, w| w.rxneie().enabled());
        wake();
    }

    fn take_caught(&mut self, taken: usize) -> usize {
        let all = caught();
        for byte in CATCH.iter().take(all).skip(taken) {
            self.receiver.receive(byte.load(Relaxed));
        }
        all
    }
}

/// How many bytes DMA has caught.
fn caught() -> usize {
    CAUGHT.saturating_sub(stream().ndtr().read().bits() as usize)
}

/// Keeps the bytes that come while the CPU stands still. The main loop's.
pub(crate) struct Catch(());

impl Catch {
    /// Takes the stream: once.
    pub(crate) fn new() -> Self {
        let stream = stream();
        // SAFETY: the USART's data register, and a buffer that is there for ever and as long as the transfers.
        #[allow(unsafe_code)]
        unsafe {
            stream.par().write(|w| w.bits(usart().dr().as_ptr() as u32));
            stream.m0ar().write(|w| w.bits(CATCH.as_ptr() as u32));
        }
        Self(())
    }

    /// From here on DMA takes the bytes, 512 at most.
    pub(crate) fn begin(&mut self) {
        // The interrupt writes the same registers.
        critical_section::with(|_| {
            usart().cr1().modify(|_, w| w.rxneie().disabled());
            clear_flags();
            stream().ndtr().write(|w| w.ndt().set(CAUGHT as u16));
            stream().cr().write(|w| {
                w.chsel().set(CHANNEL).minc().set_bit();
                w.pl().very_high().en().enabled()
            });
            usart().cr3().modify(|_, w| w.dmar().enabled());
            WRITTEN.store(false, Relaxed);
            CATCHING.store(true, Relaxed);
        });
    }

    /// The interrupt takes what was caught, and the bytes from here on.
    pub(crate) fn end(&mut self) {
        WRITTEN.store(true, Relaxed);
        rtic::pend(INTERRUPT);
    }
}

/// A stream starts only with its flags cleared (RM0090 section 10.3.17): those of stream 5, bits 6 to 11 of the high register.
fn clear_flags() {
    // SAFETY: a store that clears the flags of our stream and no other.
    #[allow(unsafe_code)]
    unsafe {
        dma().hifcr().write(|w| w.bits(0x3D << 6));
    }
}
