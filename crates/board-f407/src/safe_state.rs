//! The state in which the outputs do no harm: no step, laser, spindle and coolant off.
//!
//! Entered from reset on, before memory is even cleared, and again by whatever ends the program (`restart`). Motors keep
//! what they have: a Z axis that is let go may drop.
#![allow(unsafe_code)] // an entry in assembly

use crate::{clock, profile::PROFILE, step_port::PULSE_END_INTERRUPT};
use core::arch::global_asm;
use cortex_m::peripheral::NVIC;
use stm32f4::stm32f407::{Interrupt, RCC};

/// Makes every pin that could do harm an output that is off. Any context.
pub(crate) fn enter() {
    NVIC::mask(Interrupt::TIM2);
    NVIC::mask(PULSE_END_INTERRUPT);
    PROFILE.power.pin.make_output(false);
    for motor in PROFILE.motors {
        motor.step.make_output(false);
        motor.direction.make_output(false);
    }
    for pin in PROFILE.high {
        pin.make_output(true);
    }
    let outputs = [
        PROFILE.spindle,
        PROFILE.spindle_reverse,
        PROFILE.flood,
        PROFILE.mist,
    ];
    for output in outputs.into_iter().flatten() {
        output.make_output();
    }
}

// The first instructions after a reset: memory is as it came up, so that nothing but constants and the stack may be used.
global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "b {early}",
    early = sym early,
);

/// Switches the ports on and makes the outputs safe.
extern "C" fn early() {
    // SAFETY: nothing else runs yet.
    let rcc = unsafe { &*RCC::ptr() };
    clock::switch_on(rcc, |rcc| {
        rcc.ahb1enr().modify(|_, w| {
            w.gpioaen().enabled().gpioben().enabled();
            w.gpiocen().enabled().gpioden().enabled();
            w.gpioeen().enabled().gpiofen().enabled();
            w.gpiogen().enabled()
        });
    });
    enter();
}
