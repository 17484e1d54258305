//! The step interrupts, above everything else, so that nothing delays a step: a tick, and the end of a pulse.
//!
//! They are none of RTIC's tasks: those save and restore BASEPRI, 14 cycles of each interrupt, for locks that the highest
//! priority has no need of. They share nothing with anybody but what is made for that ([`SHARED`], the segment queue).
#![allow(unsafe_code)] // a handler and what it owns
use crate::{
    firmware::SHARED,
    profile::MOTORS,
    step_port::{Port, PULSE_END_INTERRUPT},
};
use core::{cell::UnsafeCell, mem::MaybeUninit};
use cortex_m::peripheral::NVIC;
use heapless::spsc::Consumer;
use leadscrew_stepper::{on_timer, Segment, StepInterrupt};
use stm32f4::stm32f407::{interrupt, Interrupt, TIM11, TIM2};

/// What the interrupts own.
struct Owned {
    port: Port,
    state: StepInterrupt<MOTORS>,
    segments: Consumer<'static, Segment<MOTORS>>,
}

struct Place(UnsafeCell<MaybeUninit<Owned>>);

// SAFETY: `start` fills it before the interrupts can come, and nobody else looks at it afterwards; both have one priority.
unsafe impl Sync for Place {}

static OWNED: Place = Place(UnsafeCell::new(MaybeUninit::uninit()));

/// Starts the timers and lets the interrupts come, at the priority that they have after a reset: the highest. Once, before
/// the first segment.
pub(crate) fn start(timer: TIM2, pulse: TIM11, segments: Consumer<'static, Segment<MOTORS>>) {
    let owned = Owned {
        port: Port::new(timer, pulse),
        state: StepInterrupt::new(),
        segments,
    };
    // SAFETY: the interrupts are still masked, and the timers, which exist once, have come here only now.
    unsafe {
        (*OWNED.0.get()).write(owned);
        NVIC::unmask(Interrupt::TIM2);
        NVIC::unmask(PULSE_END_INTERRUPT);
    }
}

/// A tick is due.
#[interrupt]
fn TIM2() {
    // SAFETY: unmasked by `start`, after that has filled it; neither interrupt interrupts itself or the other.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    owned.port.acknowledge();
    owned.tick();
}

/// A pulse is over, or the main loop has something to start.
#[interrupt]
fn TIM1_TRG_COM_TIM11() {
    // SAFETY: as above.
    let owned = unsafe { (*OWNED.0.get()).assume_init_mut() };
    if owned.port.on_pulse_end(&SHARED) {
        owned.tick();
        owned.port.after_tick();
    }
}

impl Owned {
    #[inline(always)]
    fn tick(&mut self) {
        on_timer(&mut self.state, &mut self.segments, &SHARED, &mut self.port);
    }
}
