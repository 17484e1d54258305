//! Laser or spindle power: the duty of a timer's channel (RM0090 sections 17.3.10, 18.3.9 and
//! 19.3.9).
//!
//! | frequency | levels above off, timer on APB1 (84 MHz) | on APB2 (168 MHz) |
//! |---|---|---|
//! | 50 Hz | 64615 | 64615 |
//! | 1 kHz | 42000 | 56000 |
//! | 10 kHz | 8400 | 16800 |
//! | 100 kHz | 840 | 1680 |
//!
//! Off is a forced level of the channel: low, or high if the board's file says that low is on
//! (`active = "low"`). Then the channel's polarity turns all levels round. Off takes effect at once,
//! whatever the compare value is. A new level takes effect at once as well, since the compare
//! register has no preload. With preload, a pixel that is shorter than a period would get the level
//! of the pixel before. The manual guarantees PWM without preload in one-pulse mode only (section
//! 18.4.7, OC1PE). On a chip that behaves otherwise a level comes a period late at most.
//!
//! A board has one such channel (`wired`, `recorded`).
#[cfg(record)]
mod recorded;
#[cfg(not(record))]
mod wired;

use crate::{
    chip::Timer,
    clock::{self, APB1_TIMER_HZ},
    fast_memory::placed,
    gpio::Pull,
    registers::{power_timer, Word},
};
use core::sync::atomic::{AtomicU8, Ordering::Relaxed};
use leadscrew_stepper::Power;
use stm32f4::stm32f407::RCC;

#[cfg(record)]
pub(crate) use recorded::Channel;
#[cfg(not(record))]
pub(crate) use wired::Channel;

impl Timer {
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

/// Counts in a period before the timer's clock is divided.
const fn cycles(timer: Timer, hz: u32) -> u32 {
    timer.hz() / hz
}

/// Divides the timer's clock so far that a period fits 16 bits.
const fn prescaler(cycles: u32) -> u32 {
    cycles.div_ceil(0xFFFF)
}

/// Counts in a period: the number of levels above off.
const fn period(cycles: u32) -> u16 {
    (cycles / prescaler(cycles)) as u16
}

/// Starts the timer with the output off.
pub(crate) fn start(rcc: &RCC) {
    let (kind, number) = Channel::place();
    kind.enable(rcc);
    let timer = power_timer(kind);
    let cycles = Channel::cycles();
    timer
        .psc()
        .write(|w| w.psc().set((prescaler(cycles) - 1) as u16));
    timer.arr().write(|w| w.arr().set(period(cycles) - 1));
    Channel::new().begin(Mode::Off);
    let output = Channel::output();
    let inverted = output.is_some_and(|(output, _)| !output.active_high);
    // The channel's enable bit and its polarity.
    timer
        .ccer()
        .put((1 | u32::from(inverted) << 1) << (4 * number));
    timer.egr().write(|w| w.ug().update());
    if matches!(kind, Timer::Tim1 | Timer::Tim8) {
        timer.bdtr().write(|w| w.moe().enabled());
    }
    timer.cr1().write(|w| w.cen().enabled().arpe().enabled());
}

/// Hands the pin to the timer, whose output is off. After [`start`].
pub(crate) fn take_pin() {
    if let Some((output, function)) = Channel::output() {
        let pull = match output.active_high {
            true => Pull::Down,
            false => Pull::Up,
        };
        output.pin.make_alternate(function, pull);
    }
}

/// The mode of the channel (TIMx_CCMRx.OCxM, RM0090 section 18.4.7).
#[derive(Clone, Copy)]
enum Mode {
    /// The output keeps its level. PWM that begins from this mode compares with the count at once.
    /// PWM that begins from another mode waits until the count comes to the compare value or to 0.
    Frozen = 0b000,
    /// Forced to the level at which nothing is on.
    Off = 0b100,
    /// PWM mode 1: on while the count is below the compare value.
    Pwm = 0b110,
}

placed! { ".bss.ccm.lit";
    /// 1 while the channel makes PWM, else 0: a byte, which a tick compares as it is. It is cleared
    /// before the output is forced off. Code that begins PWM looks at it again afterwards: if an
    /// interrupt has switched the power off in between, the power stays off.
    static LIT: AtomicU8 = AtomicU8::new(0);
}

/// Does `work` with the power off, and then switches the power on again if it was on. The power
/// stays off if an interrupt has switched it off meanwhile, or if a switch has shut the gate.
/// `is_shut` looks at the gate, after the work. Main loop, at rest.
pub(crate) fn off_during<T>(work: impl FnOnce() -> T, is_shut: impl FnOnce() -> bool) -> T {
    let channel = Channel::new();
    channel.begin(Mode::Off);
    let done = work();
    if is_shut() {
        LIT.store(0, Relaxed);
    } else if LIT.load(Relaxed) != 0 {
        channel.light();
    }
    done
}

impl Channel {
    /// Sets the power at once. Step interrupt; main loop at rest; switch interrupts when steps are
    /// stopped.
    #[inline]
    pub(crate) fn set(&self, power: Power) {
        // At most the period.
        let level = power.level(self.scale()) as u16;
        self.compare().write(|w| w.ccr().set(level));
        let lit = u8::from(level != 0);
        if LIT.load(Relaxed) != lit {
            self.switch(lit);
        }
    }

    #[cold]
    #[inline(never)]
    fn switch(&self, lit: u8) {
        LIT.store(lit, Relaxed);
        if lit != 0 {
            self.light();
        } else {
            self.begin(Mode::Off);
        }
    }

    /// Lets PWM begin at once, from an output that is forced off.
    fn light(&self) {
        self.begin(Mode::Frozen);
        self.begin(Mode::Pwm);
        if LIT.load(Relaxed) == 0 {
            self.begin(Mode::Off);
        }
    }
}
