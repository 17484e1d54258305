//! The step interrupts: a tick, and with a lower priority the end of a pulse. They have the highest
//! priorities, so that nothing delays a step.
//!
//! They are not tasks of RTIC. A task of RTIC saves and restores BASEPRI: 14 cycles of each
//! interrupt, for locks that an interrupt above RTIC's own priorities does not need. They share two
//! things with the main loop: [`SHARED`] and the segment queue. Their code is in SRAM, and their
//! data is in the core coupled memory ([`crate::fast_memory`]).
#![allow(unsafe_code)] // a handler and its data
use crate::{
    critical::PULSE_END_PRIORITY,
    profile::MOTORS,
    step_port::{self, Port, PULSE_END_INTERRUPT},
};
use core::{cell::UnsafeCell, mem::MaybeUninit};
use cortex_m::peripheral::NVIC;
use heapless::spsc::Consumer;
use leadscrew_stepper::{on_timer, Segment, Shared, StepInterrupt};
use stm32f4::stm32f407::{interrupt, Interrupt, TIM11, TIM2};

/// The data that the interrupts share with the main loop. It is in memory that `fast_memory` has
/// zeroed before anything reads it.
#[link_section = ".bss.ccm.shared"]
pub(crate) static SHARED: Shared<MOTORS> = Shared::new();

/// The data of ticks.
struct Owned {
    port: Port,
    state: StepInterrupt<MOTORS>,
    segments: Consumer<'static, Segment<MOTORS>>,
}

struct Place(UnsafeCell<MaybeUninit<Owned>>);

// SAFETY: `start` fills it before the interrupts can come. After that ticks use it. The end of a
// pulse uses it only at rest, when no tick comes.
unsafe impl Sync for Place {}

#[link_section = ".bss.ccm.owned"]
static OWNED: Place = Place(UnsafeCell::new(MaybeUninit::uninit()));

/// Starts the timers and lets the interrupts come, ticks at the priority that they have after a
/// reset: the highest. Once, before the first segment.
pub(crate) fn start(
    nvic: &mut NVIC,
    timers: (TIM2, TIM11),
    segments: Consumer<'static, Segment<MOTORS>>,
) {
    step_port::start(timers.0, timers.1);
    let owned = Owned {
        port: Port::new(),
        state: StepInterrupt::new(),
        segments,
    };
    // SAFETY: the interrupts are still masked, and the queue's end, which exists once, has come
    // here only now.
    unsafe {
        (*OWNED.0.get()).write(owned);
        nvic.set_priority(PULSE_END_INTERRUPT, PULSE_END_PRIORITY);
        NVIC::unmask(Interrupt::TIM2);
        NVIC::unmask(PULSE_END_INTERRUPT);
    }
}

/// A tick is due.
#[interrupt]
fn TIM2() {
    // SAFETY: `start` fills it before it unmasks this interrupt. The end of a pulse, which this may
    // interrupt, does not use it then.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    owned.port.acknowledge();
    let Owned {
        port,
        state,
        segments,
    } = owned;
    if on_timer(state, segments, &SHARED, port) {
        // This tick has taken so long that the shortest pulse is over, and the next tick may come
        // before the interrupt of its end.
        step_port::end_pulse_if_over();
    }
}

/// A pulse is over, or the main loop has something to start.
#[interrupt]
fn TIM1_TRG_COM_TIM11() {
    step_port::end_pulse_if_over();
    if step_port::is_to_start(&SHARED) {
        start_motion();
    }
}

/// Starts motion from rest: makes a tick come at once.
fn start_motion() {
    // SAFETY: at rest no tick comes before `let_ticks_come`.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    leadscrew_stepper::start(&mut owned.state, &owned.segments, &SHARED, &mut owned.port);
    owned.port.begin();
    step_port::let_ticks_come();
}
