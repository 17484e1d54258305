//! Laser or spindle power: the duty of a timer's channel (RM0090 section 18.3.9).
use crate::{clock::APB1_TIMER_HZ, gpio::Pull, profile::PROFILE};
use leadscrew_stepper::Power;
use stm32f4::stm32f407::TIM4;

/// Counts of the timer in a period, before they are divided down to 16 bits.
const CYCLES: u32 = APB1_TIMER_HZ / PROFILE.power.frequency;
const PRESCALER: u32 = CYCLES.div_ceil(1 << 16);
/// Counts in a period: the number of levels above off.
const PERIOD: u16 = {
    let counts = CYCLES / PRESCALER;
    if counts > 0xFFFF {
        0xFFFF
    } else {
        counts as u16
    }
};

fn timer() -> &'static stm32f4::stm32f407::tim4::RegisterBlock {
    // SAFETY: besides `start`, which runs once, only the compare register is written, in single stores.
    #[allow(unsafe_code)]
    unsafe {
        &*TIM4::ptr()
    }
}

/// Starts the timer with the output off, and hands it the pin.
pub(crate) fn start() {
    let timer = timer();
    timer.psc().write(|w| w.psc().set((PRESCALER - 1) as u16));
    timer.arr().write(|w| w.arr().set(PERIOD - 1));
    timer
        .ccmr1_output()
        .write(|w| w.oc1m().pwm_mode1().oc1pe().enabled());
    timer.ccer().write(|w| w.cc1e().set_bit());
    timer.egr().write(|w| w.ug().update());
    timer.cr1().write(|w| w.cen().enabled().arpe().enabled());
    PROFILE
        .power
        .pin
        .make_alternate(PROFILE.power.function, Pull::Down);
}

/// Sets the power from the next period on. Step interrupt; main loop at rest.
#[inline]
pub(crate) fn set(power: Power) {
    let level = power.level(PERIOD);
    timer().ccr1().write(|w| w.ccr().set(level.into()));
}
