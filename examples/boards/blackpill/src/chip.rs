//! The chip's clocks, its step timer, and the order of its interrupts.

use core::ops::Range;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::peripherals::TIM2;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::{hz, mhz};
use embassy_stm32::timer::{low_level::Timer, Channel};
use embassy_stm32::{Config, Peri};
use leadscrew::Alarm;

/// The counts of the step timer in a second.
pub(crate) const HZ: u32 = 1_000_000;

/// The flash of the settings: the last two sectors, of 128 KB each (RM0383, table 4).
pub(crate) const SETTINGS: Range<u32> = 0x4_0000..0x8_0000;

/// 100 MHz from the board's crystal of 25 MHz: 25 / 25 * 200 / 2.
pub(crate) fn clocks() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse {
        freq: mhz(25),
        mode: HseMode::Oscillator,
    });
    rcc.pll_src = PllSource::HSE;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV25,
        mul: PllMul::MUL200,
        divp: Some(PllPDiv::DIV2),
        divq: None,
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV2; // 50 MHz at most; its timers have 100
    rcc.apb2_pre = APBPrescaler::DIV1;
    config
}

/// Gives the interrupts their order, and starts the step interrupt. Called once, after the serial
/// line has been set up.
#[allow(unsafe_code)]
pub(crate) fn start_interrupts() {
    interrupt::TIM2.set_priority(Priority::P0);
    interrupt::USART1.set_priority(Priority::P2);
    interrupt::TIM4.set_priority(Priority::P3);
    // SAFETY: the handler finds all that it needs in a static.
    unsafe { interrupt::TIM2.enable() };
}

/// Makes the step interrupt come at once. Called by the main loop.
pub(crate) fn pend_step() {
    interrupt::TIM2.pend();
}

/// Timer 2, whose count has 32 bits. It rings by its first channel, which drives no pin.
pub(crate) struct StepTimer(Timer<'static, TIM2>);

impl StepTimer {
    pub(crate) fn new(timer: Peri<'static, TIM2>) -> Self {
        let mut timer = Timer::new(timer);
        timer.set_tick_freq(hz(HZ));
        timer.set_max_compare_value(u32::MAX);
        timer.start();
        Self(timer)
    }
}

impl Alarm for StepTimer {
    fn count(&self) -> u32 {
        self.0.regs_gp32().cnt().read()
    }
    fn ring_at(&mut self, at: u32) {
        self.0.set_compare_value(Channel::Ch1, at);
        self.0.clear_input_interrupt(Channel::Ch1);
        self.0.enable_input_interrupt(Channel::Ch1, true);
        // The timer compares for equality: an instant that has passed would match after 71 minutes.
        if self.count().wrapping_sub(at).cast_signed() >= 0 {
            pend_step();
        }
    }
    fn silence(&mut self) {
        self.0.enable_input_interrupt(Channel::Ch1, false);
        self.0.clear_input_interrupt(Channel::Ch1);
    }
}
