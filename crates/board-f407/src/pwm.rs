//! Laser or spindle power: the duty of a timer's channel (RM0090 sections 17.3.9 and 18.3.9).
//!
//! | frequency | levels above off, timer on APB1 (84 MHz) | on APB2 (168 MHz) |
//! |---|---|---|
//! | 50 Hz | 64615 | 64615 |
//! | 1 kHz | 42000 | 56000 |
//! | 10 kHz | 8400 | 16800 |
//! | 100 kHz | 840 | 1680 |
use crate::{
    clock::{self, APB1_TIMER_HZ},
    gpio::Pull,
    profile::{PowerPin, Timer, POWER_HZ, PROFILE},
    step_interrupt::SHARED,
};
use cortex_m::interrupt;
use leadscrew_stepper::{Power, PowerScale};
use stm32f4::stm32f407::{tim1::RegisterBlock, RCC, TIM1, TIM3, TIM4, TIM8, TIM9};

impl Timer {
    /// TIM1 and TIM8 have all registers, the others those that they have at the same offsets (RM0090 sections 17.4, 18.4 and 19.4).
    fn registers(self) -> &'static RegisterBlock {
        let address = match self {
            Self::Tim1 => TIM1::ptr(),
            Self::Tim3 => TIM3::ptr().cast(),
            Self::Tim4 => TIM4::ptr().cast(),
            Self::Tim8 => TIM8::ptr(),
            Self::Tim9 => TIM9::ptr().cast(),
        };
        // SAFETY: a timer with at least the registers used below; besides `start`, which runs once, only the compare
        // register is written, in single stores.
        #[allow(unsafe_code)]
        unsafe {
            &*address
        }
    }

    /// Counts in a second: TIM1, TIM8 and TIM9 are on APB2.
    const fn hz(self) -> u32 {
        match self {
            Self::Tim1 | Self::Tim8 | Self::Tim9 => 2 * APB1_TIMER_HZ,
            Self::Tim3 | Self::Tim4 => APB1_TIMER_HZ,
        }
    }

    fn enable(self, rcc: &RCC) {
        clock::switch_on(rcc, |rcc| {
            match self {
                Self::Tim1 => rcc.apb2enr().modify(|_, w| w.tim1en().enabled()),
                Self::Tim3 => rcc.apb1enr().modify(|_, w| w.tim3en().enabled()),
                Self::Tim4 => rcc.apb1enr().modify(|_, w| w.tim4en().enabled()),
                Self::Tim8 => rcc.apb2enr().modify(|_, w| w.tim8en().enabled()),
                Self::Tim9 => rcc.apb2enr().modify(|_, w| w.tim9en().enabled()),
            };
        });
    }
}

const OUTPUT: &PowerPin = &PROFILE.power;
/// Counts in a period before the timer's clock is divided.
const CYCLES: u32 = {
    assert!(50 <= POWER_HZ && POWER_HZ <= 100_000);
    OUTPUT.timer.hz() / POWER_HZ
};
/// Divides the timer's clock so far that a period fits 16 bits.
const PRESCALER: u32 = CYCLES.div_ceil(0xFFFF);
/// Counts in a period: the number of levels above off.
const PERIOD: u16 = (CYCLES / PRESCALER) as u16;
/// The channel, from 0.
const CHANNEL: usize = {
    assert!(1 <= OUTPUT.channel && OUTPUT.channel <= 4);
    OUTPUT.channel as usize - 1
};

/// Starts the timer with the output off, and hands it the pin.
pub(crate) fn start(rcc: &RCC) {
    OUTPUT.timer.enable(rcc);
    let timer = OUTPUT.timer.registers();
    timer.psc().write(|w| w.psc().set((PRESCALER - 1) as u16));
    timer.arr().write(|w| w.arr().set(PERIOD - 1));
    // PWM mode 1: on while the count is below the compare value; two channels a register (RM0090 section 18.4.7). Without
    // preload, so that a laser goes off at once and not at the end of the period, up to 20 ms later.
    let mode = 0b0110_0000 << (8 * (CHANNEL % 2));
    // SAFETY: these bits are the mode of the channel, in either register.
    #[allow(unsafe_code)]
    if CHANNEL < 2 {
        timer.ccmr1_output().write(|w| unsafe { w.bits(mode) });
    } else {
        timer.ccmr2_output().write(|w| unsafe { w.bits(mode) });
    }
    // SAFETY: the channel's enable bit, active high.
    #[allow(unsafe_code)]
    timer
        .ccer()
        .write(|w| unsafe { w.bits(1 << (4 * CHANNEL)) });
    timer.egr().write(|w| w.ug().update());
    if matches!(OUTPUT.timer, Timer::Tim1 | Timer::Tim8) {
        timer.bdtr().write(|w| w.moe().enabled());
    }
    timer.cr1().write(|w| w.cen().enabled().arpe().enabled());
    OUTPUT.pin.make_alternate(OUTPUT.function, Pull::Down);
}

/// Does something with the power off, and puts it back, but where a switch has shut the gate meanwhile: that stays dark. Main
/// loop, at rest.
pub(crate) fn off_during<T>(work: impl FnOnce() -> T) -> T {
    let level = OUTPUT.timer.registers().ccr(CHANNEL);
    let before = level.read().ccr().bits();
    level.write(|w| w.ccr().set(0));
    let done = work();
    interrupt::free(|_| {
        if !SHARED.is_laser_off() {
            level.write(|w| w.ccr().set(before));
        }
    });
    done
}

/// Sets the power at once. Step interrupt; main loop at rest; switch interrupts where steps are stopped.
#[inline]
pub(crate) fn set(power: Power) {
    const SCALE: PowerScale = PowerScale::new(PERIOD);
    // At most the period.
    let level = power.level(SCALE) as u16;
    OUTPUT
        .timer
        .registers()
        .ccr(CHANNEL)
        .write(|w| w.ccr().set(level));
}
