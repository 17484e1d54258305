//! The chip: its timer, pins and UART 0. The FU540-C000 manual names the addresses
//! and the bits.

use core::cell::{Cell, RefCell};
use core::convert::Infallible;
use core::future::{poll_fn, Future};
use core::task::{Poll, Waker};
use critical_section::{with, CriticalSection, Mutex};
use leadscrew::embedded_hal::digital::{self, OutputPin};
use leadscrew::embedded_io_async::{ErrorType, Read, Write};
use leadscrew::{Alarm, Clock, Instant};

/// The counts of the core's timer in a second.
pub(crate) const HZ: u32 = 1_000_000;

const MTIMECMP: Register = Register(0x0200_4000);
const MTIMECMP_1: Register = Register(0x0200_4008);
const MTIME: Register = Register(0x0200_BFF8);
const PLIC: Register = Register(0x0C00_0000);
const UART: Register = Register(0x1001_0000);
const GPIO: Register = Register(0x1006_0000);

/// Offsets of the UART: bytes to send, received bytes, enables, interrupts.
const SEND: usize = 0x00;
const RECEIVE: usize = 0x04;
const SEND_ON: usize = 0x08;
const RECEIVE_ON: usize = 0x0C;
const INTERRUPT: usize = 0x10;
const RECEIVED: u32 = 1 << 1;

/// Offsets of the interrupt controller for core 0, and the number of UART 0.
const PLIC_ENABLE: usize = 0x2000;
const PLIC_CLAIM: usize = 0x20_0004;
const UART_0: usize = 4;

/// The time at which the step interrupt is due.
static STEP_AT: Mutex<Cell<Option<u64>>> = Mutex::new(Cell::new(None));
/// The time at which a task is to be woken.
static WAKE_AT: Mutex<RefCell<Option<(u64, Waker)>>> = Mutex::new(RefCell::new(None));
/// The task that awaits bytes.
static READER: Mutex<RefCell<Option<Waker>>> = Mutex::new(RefCell::new(None));

/// Starts pins, UART and interrupts. Called once.
#[allow(unsafe_code)]
pub(crate) fn start() {
    GPIO.write(0x0C, 1 << 6); // the drivers are off
    GPIO.write(0x08, 0x7F);
    UART.write(RECEIVE_ON, 1);
    UART.write(SEND_ON, 1);
    PLIC.write(4 * UART_0, 1);
    PLIC.write(PLIC_ENABLE, 1 << UART_0);
    // The other core's timer is due since power-up, and would end each of its sleeps at once.
    MTIMECMP_1.write(4, u32::MAX);
    with(rearm);
    // SAFETY: the handlers find all that they need in statics.
    unsafe {
        riscv::register::mie::set_mtimer();
        riscv::register::mie::set_mext();
        riscv::interrupt::enable();
    }
}

/// Returns the microseconds since power-up.
fn time() -> u64 {
    loop {
        let high = MTIME.read(4);
        let low = MTIME.read(0);
        if high == MTIME.read(4) {
            return u64::from(high) << 32 | u64::from(low);
        }
    }
}

/// The longest time between two of the timer's interrupts. While all cores sleep, QEMU skips to the
/// next one: an instant that never comes would be the end of its time.
const LONGEST: u64 = 1_000_000;

/// Makes the timer's interrupt come at the earlier of both instants.
fn rearm(cs: CriticalSection<'_>) {
    let latest = time() + LONGEST;
    let wake = WAKE_AT
        .borrow_ref(cs)
        .as_ref()
        .map_or(latest, |(at, _)| latest.min(*at));
    let at = STEP_AT.borrow(cs).get().map_or(wake, |step| wake.min(step));
    MTIMECMP.write(4, u32::MAX); // no instant in between comes too early
    MTIMECMP.write(0, at as u32);
    MTIMECMP.write(4, (at >> 32) as u32);
}

/// Makes the step interrupt come at once. Main loop.
pub(crate) fn pend_step() {
    with(|cs| {
        STEP_AT.borrow(cs).set(Some(0));
        rearm(cs);
    });
}

/// Takes the step that is due, if there is one. Timer interrupt.
pub(crate) fn take_step(cs: CriticalSection<'_>) -> bool {
    let is_due = STEP_AT.borrow(cs).get().is_some_and(|at| at <= time());
    if is_due {
        STEP_AT.borrow(cs).set(None);
    }
    is_due
}

/// Wakes the task whose instant has come. Timer interrupt.
pub(crate) fn wake(cs: CriticalSection<'_>) {
    let now = time();
    if let Some((_, task)) = WAKE_AT.borrow_ref_mut(cs).take_if(|(at, _)| *at <= now) {
        task.wake();
    }
    rearm(cs);
}

/// The core's timer: for steps, and for the main loop.
pub(crate) struct Timer;

impl Alarm for Timer {
    fn count(&self) -> u32 {
        MTIME.read(0)
    }
    fn ring_at(&mut self, at: u32) {
        let now = time();
        let left = at.wrapping_sub(now as u32).cast_signed();
        with(|cs| {
            STEP_AT
                .borrow(cs)
                .set(Some(now.saturating_add_signed(left.into())));
            rearm(cs);
        });
    }
    fn silence(&mut self) {
        with(|cs| {
            STEP_AT.borrow(cs).set(None);
            rearm(cs);
        });
    }
}

impl Clock for Timer {
    fn now(&self) -> Instant {
        Instant::from_ticks(time())
    }
    fn until(&self, instant: Instant) -> impl Future<Output = ()> {
        poll_fn(move |context| {
            if time() >= instant.ticks() {
                return Poll::Ready(());
            }
            with(|cs| {
                WAKE_AT.replace(cs, Some((instant.ticks(), context.waker().clone())));
                rearm(cs);
            });
            Poll::Pending
        })
    }
}

/// An output, by its number.
pub(crate) struct Pin(pub(crate) u32);

impl digital::ErrorType for Pin {
    type Error = Infallible;
}
impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.set(false)
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.set(true)
    }
}
impl Pin {
    fn set(&mut self, high: bool) -> Result<(), Infallible> {
        with(|_| {
            let others = GPIO.read(0x0C) & !(1 << self.0);
            GPIO.write(0x0C, others | u32::from(high) << self.0);
        });
        Ok(())
    }
}

/// UART 0.
pub(crate) struct Line;

impl ErrorType for Line {
    type Error = Infallible;
}
impl Read for Line {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        poll_fn(|context| {
            let received = bytes.iter_mut().map_while(|byte| {
                let word = UART.read(RECEIVE);
                *byte = word as u8;
                (word >> 31 == 0).then_some(())
            });
            match received.count() {
                0 => {
                    with(|cs| READER.replace(cs, Some(context.waker().clone())));
                    UART.write(INTERRUPT, RECEIVED);
                    Poll::Pending
                }
                count => Poll::Ready(Ok(count)),
            }
        })
        .await
    }
}
impl Write for Line {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let Some(byte) = bytes.first() else {
            return Ok(0);
        };
        while UART.read(SEND) >> 31 != 0 {
            embassy_futures::yield_now().await; // it is full for 87 µs at most
        }
        UART.write(SEND, u32::from(*byte));
        Ok(1)
    }
    async fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

/// Wakes the reader. Called by the interrupt of bytes, which stays masked until it reads again.
pub(crate) fn on_bytes() {
    let claimed = PLIC.read(PLIC_CLAIM);
    UART.write(INTERRUPT, 0);
    if let Some(reader) = with(|cs| READER.take(cs)) {
        reader.wake();
    }
    PLIC.write(PLIC_CLAIM, claimed);
}

/// Registers from an address on: only constants of this file name one.
#[derive(Clone, Copy)]
struct Register(usize);

#[allow(unsafe_code)]
impl Register {
    fn read(self, offset: usize) -> u32 {
        // SAFETY: the constants of this file name registers of the chip, which are aligned words.
        unsafe { ((self.0 + offset) as *const u32).read_volatile() }
    }
    fn write(self, offset: usize, value: u32) {
        // SAFETY: as in `read`. A store to these registers changes no memory of the program.
        unsafe { ((self.0 + offset) as *mut u32).write_volatile(value) }
    }
}
