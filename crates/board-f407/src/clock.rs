//! The sources of the clocks, the time, and the main loop's sleep.
//!
//! Code that has something for the main loop calls [`wake`]. No wake-up is lost: every return from
//! an interrupt sets the core's event register, so that WFE does not sleep if an interrupt came
//! after the look at the flag (DDI 0403 section B1.5.18). The step interrupt wakes the core as
//! well, but the main loop goes on sleeping unless that interrupt has called [`wake`].
use crate::{
    profile,
    registers::{clock_timer, pulse_timer, Word},
};
use core::fmt;
use core::sync::atomic::{compiler_fence, AtomicBool, Ordering};
use leadscrew_machine::board::Instant;
use stm32f4::stm32f407::{rcc, PWR, RCC, TIM5};
use stm32f4xx_hal::{
    rcc::{Config, Rcc, RccExt},
    time::Hertz,
};

/// Clock of the CPU in Hz: the highest that the STM32F407 allows.
pub(crate) const CPU_HZ: u32 = 168_000_000;

/// Counts of the timers on APB1 in a second: twice the clock of their bus (RM0090 section 7.2).
pub(crate) const APB1_TIMER_HZ: u32 = 84_000_000;
/// Clock of the bus of USART2 in Hz.
pub(crate) const APB1_HZ: u32 = 42_000_000;
/// The number of looks at the crystal before it is given up: this takes some 100 ms with the 16 MHz
/// after reset. A crystal starts within 2 ms (data sheet, table 36).
const PATIENCE: u32 = 200_000;

/// The source of the CPU's clock.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub(crate) enum Source {
    /// The crystal.
    Crystal,
    /// The internal oscillator, within 1 % at room temperature: the crystal did not start. Too
    /// inexact for USB.
    Internal,
    /// The same: the crystal has about this many MHz, and the board's file says another number.
    /// With it every time would be wrong, and the chip might be faster than it can.
    WrongCrystal(u32),
}

/// The operator's message; empty if the crystal is the source.
impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Crystal => return Ok(()),
            Self::Internal => f.write_str("the crystal does not start")?,
            Self::WrongCrystal(mhz) => {
                let said = profile::crystal_hz() / 1_000_000;
                write!(f, "the crystal has {mhz} MHz, the board's file says {said}")?;
            }
        }
        f.write_str(": times are exact to 1 %, no USB")
    }
}

/// Sets the clocks up: CPU 168 MHz, APB1 42 MHz, APB2 84 MHz, USB 48 MHz. If the crystal does
/// not start, the internal oscillator is the source.
pub(crate) fn start(rcc: RCC, power: &PWR) -> (Rcc, Source) {
    use_internal_oscillator(&rcc);
    power.cr().modify(|_, w| w.vos().scale1());
    let source = find_source(&rcc);
    let config = match source {
        Source::Crystal => Config::hse(Hertz::from_raw(profile::crystal_hz())).require_pll48clk(),
        Source::Internal | Source::WrongCrystal(_) => Config::hsi(),
    };
    let rcc = rcc.freeze(
        config
            .sysclk(Hertz::from_raw(CPU_HZ))
            .pclk1(Hertz::from_raw(APB1_HZ))
            .pclk2(Hertz::from_raw(2 * APB1_HZ)),
    );
    while !rcc.cfgr().read().sws().is_pll() {}
    // A crystal that stops is an NMI from here on.
    rcc.cr()
        .modify(|_, w| w.csson().bit(source == Source::Crystal));
    (rcc, source)
}

/// Lets `enable` switch clocks of peripherals on, and waits until they have come: a store to a
/// peripheral right after it would be lost (ES0182, "Delay after an RCC peripheral clock
/// enabling"). The barrier is ST's first workaround. ST's second one, to read the register back, is
/// not enough for a store that follows at once.
pub(crate) fn switch_on(rcc: &rcc::RegisterBlock, enable: impl FnOnce(&rcc::RegisterBlock)) {
    enable(rcc);
    cortex_m::asm::dsb();
}

/// Runs the chip and its timers from the internal oscillator, undivided, with the PLL off. A
/// bootloader may have set the clocks up in its own way, and only a PLL that is off can be set up.
fn use_internal_oscillator(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.hsion().on());
    while rcc.cr().read().hsirdy().is_not_ready() {}
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    while !rcc.cfgr().read().sws().is_hsi() {}
    // HPRE, PPRE1, PPRE2.
    rcc.cfgr()
        .change(|bits| bits & !(0b1111 << 4 | 0b111 << 10 | 0b111 << 13));
    rcc.cr().modify(|_, w| w.pllon().off());
    while rcc.cr().read().pllrdy().is_ready() {}
}

/// Looks whether the crystal starts, if there is one. The HAL would wait for it for ever.
fn find_source(rcc: &RCC) -> Source {
    if profile::crystal_hz() == 0 {
        return Source::Internal;
    }
    rcc.cr().modify(|_, w| w.hseon().on());
    let source = if (0..PATIENCE).any(|_| rcc.cr().read().hserdy().is_ready()) {
        judge(measure(rcc), profile::crystal_hz())
    } else {
        Source::Internal
    };
    if source != Source::Crystal {
        rcc.cr().modify(|_, w| w.hseon().off());
    }
    source
}

/// The source, if the crystal has the measured frequency and should have another, Hz. The internal
/// oscillator is up to 8 % off over all temperatures (data sheet, table 41). Without a measurement
/// the board's file counts.
fn judge(measured: Option<u32>, said: u32) -> Source {
    match measured {
        Some(hz) if hz.abs_diff(said) > said / 8 => {
            Source::WrongCrystal((hz + 500_000) / 1_000_000)
        }
        _ => Source::Crystal,
    }
}

/// Measures the crystal against the internal oscillator, which runs the chip, Hz. TIM11 can capture
/// the edges of the crystal's clock for the RTC (RM0090 sections 7.2.11 and 19.5.11). `None` if
/// there are no edges.
fn measure(rcc: &RCC) -> Option<u32> {
    /// RCC_CFGR.RTCPRE: the crystal is divided by this.
    const DIVIDER: u32 = 31;
    /// Edges from one capture to the next.
    const EDGES: u32 = 8;
    /// Captures that are waited for after the first whole one.
    const CAPTURES: u32 = 4;
    const INTERNAL_HZ: u32 = 16_000_000;
    rcc.cfgr()
        .change(|bits| bits & !(0b11111 << 16) | DIVIDER << 16);
    let timer = pulse_timer();
    timer.or().put(0b10);
    timer.arr().write(|w| w.arr().set(u16::MAX));
    timer.ccmr1_input().put(0b1101);
    timer.ccer().put(1);
    timer.egr().write(|w| w.ug().update());
    timer.cr1().write(|w| w.cen().enabled());
    let capture = || {
        let mut looks = 0..10_000;
        looks
            .any(|_| timer.sr().read().cc1if().bit_is_set())
            .then(|| timer.ccr1().read().ccr().bits())
    };
    let passed = || {
        capture()?;
        let first = capture()?;
        let last = (0..CAPTURES).try_fold(first, |_, _| capture())?;
        Some(last.wrapping_sub(first))
    };
    let passed = passed();
    // As pulses expect it: stopped at 0, without a flag.
    timer.cr1().write(|w| w);
    timer.ccer().put(0);
    timer.ccmr1_input().put(0);
    timer.or().put(0);
    timer.egr().write(|w| w.ug().update());
    timer.sr().write(|w| w);
    rcc.cfgr().change(|bits| bits & !(0b11111 << 16));
    const PER_COUNT: u32 = INTERNAL_HZ / 1_000 * DIVIDER * EDGES * CAPTURES;
    (PER_COUNT / u32::from(passed?)).checked_mul(1_000)
}

/// Microseconds since power-up, and the main loop's alarm clock: TIM5 (RM0090 chapter 18).
pub(crate) struct Clock {
    timer: TIM5,
    /// Microseconds since power-up, at the last reading.
    last: u64,
}

impl Clock {
    /// Starts the timer at 0.
    pub(crate) fn new(timer: TIM5) -> Self {
        const PER_MICROSECOND: u16 = (APB1_TIMER_HZ / 1_000_000) as u16;
        timer.psc().write(|w| w.psc().set(PER_MICROSECOND - 1));
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().update());
        timer.sr().write(|w| w.uif().clear_bit());
        timer
            .dier()
            .write(|w| w.cc1ie().enabled().cc2ie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        Self { timer, last: 0 }
    }

    /// The present. Main loop, at least once an hour: the timer comes round after 71 minutes.
    pub(crate) fn now(&mut self) -> Instant {
        let count = self.timer.cnt().read().bits();
        let passed = count.wrapping_sub(self.last as u32);
        self.last += u64::from(passed);
        Instant::from_ticks(self.last)
    }

    /// Wakes the main loop at `instant`, or at once if that has passed. Main loop.
    pub(crate) fn wake_at(&mut self, instant: Instant) {
        let due = instant.ticks();
        self.timer.ccr1().write(|w| w.ccr().set(due as u32));
        if self.now().ticks() >= due {
            wake();
        }
    }
}

/// Microseconds, modulo 2³². Any context.
#[inline]
pub(crate) fn count() -> u32 {
    clock_timer().cnt().read().bits()
}

/// Asks for an interrupt at the count `due`, or at once if that has passed. Switch interrupts.
pub(crate) fn set_filter_alarm(due: u32) {
    clock_timer().ccr2().write(|w| w.ccr().set(due));
    if count().wrapping_sub(due).cast_signed() >= 0 {
        clock_timer().egr().write(|w| w.cc2g().set_bit());
    }
}

/// Clears the alarms that have gone off, and wakes the main loop if its own is one of them. Returns
/// whether the alarm of the switches' filter has gone off. Interrupt of TIM5.
pub(crate) fn take_alarms() -> bool {
    let flags = clock_timer().sr().read();
    // A zero clears a flag, a one leaves it.
    clock_timer().sr().write(|w| {
        w.cc1if().bit(!flags.cc1if().bit());
        w.cc2if().bit(!flags.cc2if().bit())
    });
    if flags.cc1if().bit() {
        wake();
    }
    flags.cc2if().bit()
}

/// True if the main loop is to run once more.
static AWAKE: AtomicBool = AtomicBool::new(true);

/// Makes the main loop run once more. Any context: all contexts run on one core, on which only the
/// compiler could change the order of stores.
#[inline]
pub(crate) fn wake() {
    compiler_fence(Ordering::Release);
    AWAKE.store(true, Ordering::Relaxed);
}

/// Sleeps until [`wake`] is called. Returns at once if [`wake`] has been called since the last
/// return. Main loop.
pub(crate) fn sleep() {
    while !AWAKE.swap(false, Ordering::Acquire) {
        cortex_m::asm::wfe();
    }
}
