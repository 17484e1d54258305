//! The interrupts and the functions that they call. The step timer and the pulse timer have the
//! highest priority, then the clock's exception, then the serial line.
#![allow(unsafe_code)] // a handler uses data of its own through a static

use crate::vectors::Interrupt;
use crate::{clock, step_port, uart, AXES, SHARED};
use core::cell::UnsafeCell;
use cortex_m::peripheral::{scb::SystemHandler, NVIC};
use cortex_m_rt::exception;
use heapless::spsc::Consumer;
use leadscrew_machine::protocol::serial::Receiver;
use leadscrew_stepper::{on_timer, start as start_motion, Segment, StepInterrupt};

/// The data that one handler owns: filled before its interrupt can come, and used by nobody else
/// from then on.
struct Owned<T>(UnsafeCell<Option<T>>);

// SAFETY: `start` fills it while the interrupt is masked. After that only one handler uses it, and
// that never interrupts itself.
unsafe impl<T> Sync for Owned<T> {}

struct Steps {
    interrupt: StepInterrupt<AXES>,
    segments: Consumer<'static, Segment<AXES>>,
    port: step_port::Port,
    in_motion: bool,
}

static STEPS: Owned<Steps> = Owned(UnsafeCell::new(None));
static LISTENER: Owned<Receiver<'static>> = Owned(UnsafeCell::new(None));

/// Starts pins and serial line, and enables the interrupts. Called once.
pub(crate) fn start(receiver: Receiver<'static>, segments: Consumer<'static, Segment<AXES>>) {
    step_port::start();
    clock::MAIN_LOOP.start();
    uart::start();
    let steps = Steps {
        interrupt: StepInterrupt::new(),
        segments,
        port: step_port::Port::new(),
        in_motion: false,
    };
    // SAFETY: the interrupts are masked, so that no handler runs; nobody else uses these
    // peripherals; no critical section depends on these priorities.
    unsafe {
        *STEPS.0.get() = Some(steps);
        *LISTENER.0.get() = Some(receiver);
        let mut core = cortex_m::Peripherals::steal();
        // The chip uses only the upper three bits of a priority.
        core.SCB.set_priority(SystemHandler::SysTick, 1 << 5);
        core.NVIC.set_priority(Interrupt::Uart0, 2 << 5);
        core.NVIC.set_priority(Interrupt::Timer2A, 2 << 5);
        NVIC::unmask(Interrupt::Timer0A);
        NVIC::unmask(Interrupt::Timer1A);
        NVIC::unmask(Interrupt::Timer2A);
        NVIC::unmask(Interrupt::Uart0);
    }
}

/// Makes the step interrupt come at once. Called by the main loop.
pub(crate) fn pend_step() {
    NVIC::pend(Interrupt::Timer0A);
}

/// A tick is due, or the main loop has something to start.
#[no_mangle]
extern "C" fn TIMER_0A() {
    step_port::TICK.acknowledge();
    // SAFETY: only this handler uses it.
    let Some(steps) = (unsafe { (*STEPS.0.get()).as_mut() }) else {
        return;
    };
    let Steps {
        interrupt,
        segments,
        port,
        in_motion,
    } = steps;
    if !*in_motion && SHARED.is_running() {
        port.begin();
        start_motion(interrupt, segments, &SHARED, port);
        *in_motion = true;
    }
    if *in_motion {
        on_timer(interrupt, segments, &SHARED, port);
    }
    *in_motion = SHARED.is_running();
}

/// A pulse ends.
#[no_mangle]
extern "C" fn TIMER_1A() {
    step_port::PULSE.acknowledge();
    step_port::on_pulse_end();
}

/// The main loop is woken at the instant that it has set.
#[no_mangle]
extern "C" fn TIMER_2A() {
    clock::MAIN_LOOP.acknowledge();
}

/// Bytes have come.
#[no_mangle]
extern "C" fn UART0() {
    // SAFETY: only this handler uses it.
    if let Some(receiver) = unsafe { (*LISTENER.0.get()).as_mut() } {
        uart::on_interrupt(receiver);
    }
}

#[exception]
fn SysTick() {
    clock::on_round();
}
