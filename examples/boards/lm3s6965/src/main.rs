//! leadscrew on a Stellaris LM3S6965 evaluation board: a Cortex-M3 that stock QEMU emulates.
//!
//! Written from `docs/embedding.md`. Pins: steps of X, Y, Z on PE0 to PE2, directions on PD0 to
//! PD2, enable on PE3. UART0 is the serial line, timer 0 the step timer, timer 2 wakes the main
//! loop.
#![no_std]
#![no_main]
#![deny(unsafe_code)]

mod chip;
mod vectors;

use chip::{Pin, StepTimer};
use core::cell::RefCell;
use cortex_m::peripheral::NVIC;
use cortex_m_rt::{entry, exception};
use critical_section::Mutex;
use leadscrew::{
    Cartesian, Config, Duration, Listener, Machine, Outputs, PinStepping, SmallResources, StepDir,
};
use panic_halt as _;
use static_cell::ConstStaticCell;
use vectors::Interrupt;

/// All memory: three axes on three motors, 16 moves.
type Memory = SmallResources<3, 3, 16>;
static MEMORY: ConstStaticCell<Memory> = ConstStaticCell::new(Memory::new());

/// The machine and all that it borrows take 13 KB at most.
const _: () = assert!(size_of::<Memory>() + size_of::<Machine<Cartesian, 3, 3>>() <= 13 * 1024);

/// A value that the handlers own.
type Owned<T> = Mutex<RefCell<Option<T>>>;
static STEPS: Owned<PinStepping<StepDir<Pin, Pin, 3>, StepTimer, 3>> =
    Mutex::new(RefCell::new(None));
static LINE: Owned<Listener> = Mutex::new(RefCell::new(None));

/// The longest sleep of the main loop: bytes may wait until the UART has room for them.
const LONGEST_SLEEP: Duration = Duration::from_ticks(1_000);

#[entry]
fn main() -> ! {
    chip::start();
    let config = Config::new().timer_hz(chip::HZ);
    let (mut machine, steps, serial, _) =
        leadscrew::new(MEMORY.take(), config, Cartesian).expect("the build is sound");
    let (listener, mut speaker) = serial.split();
    let steps = steps.on(StepDir::new(chip::MOTORS), StepTimer);
    critical_section::with(|cs| {
        STEPS.replace(cs, Some(steps));
        LINE.replace(cs, Some(listener));
    });
    chip::enable_interrupts();

    let mut outputs = Outputs::new(|| NVIC::pend(Interrupt::Timer0A), chip::ENABLE);
    loop {
        let now = chip::now();
        let next = machine.poll(&mut outputs, now);
        while let Some(byte) = chip::has_room().then(|| speaker.next_to_send()).flatten() {
            chip::send(byte);
        }
        let latest = now + LONGEST_SLEEP;
        chip::wake_at(next.when.map_or(latest, |when| when.min(latest)));
        // Masked, so that no interrupt is handled between the question and the sleep, which it ends.
        critical_section::with(|_| {
            if !next.busy && !machine.is_woken() {
                cortex_m::asm::wfi();
            }
        });
    }
}

/// A tick is due, a pulse ends, or the main loop has something to start.
#[no_mangle]
#[allow(unsafe_code)] // its name is the vector's
extern "C" fn TIMER_0A() {
    critical_section::with(|cs| STEPS.borrow_ref_mut(cs).as_mut().map(|steps| steps.tick()));
}

/// Bytes have come.
#[no_mangle]
#[allow(unsafe_code)] // its name is the vector's
extern "C" fn UART0() {
    critical_section::with(|cs| {
        while let Some(byte) = chip::received() {
            LINE.borrow_ref_mut(cs)
                .as_mut()
                .map(|line| line.receive(byte));
        }
    });
}

/// The main loop is woken at the instant that it has set.
#[no_mangle]
#[allow(unsafe_code)] // its name is the vector's
extern "C" fn TIMER_2A() {
    chip::MAIN_LOOP.silence();
}

#[exception]
fn SysTick() {
    chip::on_round();
}
