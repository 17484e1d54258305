//! The step interrupts, above everything else, so that nothing delays a step: a tick, and below it the end of a pulse.
//!
//! They are none of RTIC's tasks: those save and restore BASEPRI, 14 cycles of each interrupt, for locks that nothing above
//! RTIC's own priorities has need of. They share nothing with anybody but what is made for that ([`SHARED`], the segment
//! queue). A tick that has used up its segment leaves it to the lower one to load the next, which has until the next tick for
//! it. Their code is in SRAM, what they read in the core coupled memory ([`crate::fast_memory`]).
#![allow(unsafe_code)] // a handler and what it owns
use crate::{
    critical::PULSE_END_PRIORITY,
    profile::MOTORS,
    step_port::{self, Port, Untimed, PULSE_END_INTERRUPT},
};
use core::{cell::UnsafeCell, mem::MaybeUninit};
use cortex_m::peripheral::NVIC;
use heapless::spsc::Consumer;
use leadscrew_stepper::{load, on_tick, Segment, Shared, StepInterrupt};
use stm32f4::stm32f407::{interrupt, Interrupt, TIM11, TIM2};

/// What the interrupts share with the main loop. Its section: memory that `fast_memory` has zeroed before anybody looks at it.
#[link_section = ".bss.ccm.shared"]
pub(crate) static SHARED: Shared<MOTORS> = Shared::new();

/// What ticks own.
struct Owned {
    port: Port,
    state: StepInterrupt<MOTORS>,
    segments: Consumer<'static, Segment<MOTORS>>,
}

struct Place(UnsafeCell<MaybeUninit<Owned>>);

// SAFETY: `start` fills it before the interrupts can come. After that it is the ticks'; the end of a pulse has it where no
// tick is armed, and gives it back as it asks for one.
unsafe impl Sync for Place {}

#[link_section = ".bss.ccm.owned"]
static OWNED: Place = Place(UnsafeCell::new(MaybeUninit::uninit()));

/// Starts the timers and lets the interrupts come, ticks at the priority that they have after a reset: the highest. Once,
/// before the first segment.
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
    // SAFETY: the interrupts are still masked, and the queue's end, which exists once, has come here only now.
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
    // SAFETY: unmasked by `start`, after that has filled it; the end of a pulse, which it interrupts, does not have it then.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    owned.port.acknowledge();
    if on_tick(
        &mut owned.state,
        &mut owned.segments,
        &SHARED,
        &mut owned.port,
    ) {
        step_port::ask_for_segment();
    }
}

/// A pulse is over, a tick wants the next segment, or the main loop has something to start.
#[interrupt]
fn TIM1_TRG_COM_TIM11() {
    match step_port::on_pulse_end(&SHARED) {
        Untimed::Nothing => {}
        Untimed::Load => load_segment(false),
        Untimed::Start => load_segment(true),
    }
}

/// Loads the next segment, the first one where motion `starts`.
#[inline(never)]
fn load_segment(starts: bool) {
    // SAFETY: no tick is armed, and none comes before `let_ticks_come`.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    let Owned {
        port,
        state,
        segments,
    } = owned;
    if starts {
        port.begin();
        port.take_over();
        leadscrew_stepper::start(state, segments, &SHARED, port);
    } else {
        port.take_over();
        load(state, segments, &SHARED, port);
    }
    if owned.port.is_in_motion() {
        step_port::let_ticks_come();
    }
}
