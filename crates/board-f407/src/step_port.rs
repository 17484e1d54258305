//! Step pins, direction pins and step timer: the board's side of the step interrupt.
//!
//! TIM2 counts freely at [`TIMER_HZ`] (RM0090 section 18.3). Its first compare register holds the instant of the next
//! tick, its second one the end of the pulse under way:
//!
//! ```text
//!  compare 1   |                 |          next tick: steps, then the tick after it is prepared
//!  compare 2        |                 |     end of the pulse: pins low, new directions out
//!              __________             _____
//!  step pin __|     ^    |___________|
//! ```
//!
//! All pins are on one port, so that the motors step at the same instant: one store to its set/reset register.
use crate::wiring::{direction_word, step_word, STEP_END, STEP_PINS};
use leadscrew_stepper::{MotorMask, Outputs, Power, Shared, StepPort, Ticks};
use stm32f4xx_hal::{
    pac::{GPIOE, TIM2, TIM4},
    rcc::{Enable, Rcc},
    timer::PwmChannel,
};

/// Counts of the step timer in a second: twice the clock of its bus, APB1 at 42 MHz (RM0090 section 7.2).
pub(crate) const TIMER_HZ: u32 = 84_000_000;
/// Counts that a step pulse lasts: 10 µs, Grbl's default.
const PULSE: u32 = TIMER_HZ / 100_000;

/// What the step interrupt drives.
pub(crate) struct Port {
    timer: TIM2,
    power: PwmChannel<TIM4, 0>,
    /// Counts of the PWM timer in a period.
    power_period: u16,
    /// No tick is armed.
    resting: bool,
    /// The word for the direction pins: written where no step pin is high, and again whenever a pulse ends.
    directions: u32,
}

impl Port {
    /// Starts the timer; no tick comes until the first [`Port::acknowledge`] of a running machine.
    pub(crate) fn new(timer: TIM2, mut power: PwmChannel<TIM4, 0>, rcc: &mut Rcc) -> Self {
        TIM2::enable(rcc);
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().update());
        timer
            .dier()
            .write(|w| w.cc1ie().enabled().cc2ie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        power.set_duty(0);
        power.enable();
        Port {
            timer,
            power_period: power.get_max_duty(),
            power,
            resting: true,
            directions: 0,
        }
    }

    /// Clears the timer's flags. Returns whether a tick is due, out of rest when the main loop says so.
    #[inline]
    pub(crate) fn acknowledge<const MOTORS: usize>(&mut self, shared: &Shared<MOTORS>) -> bool {
        let flags = self.timer.sr().read();
        let (tick, pulse_end) = (flags.cc1if().is_match(), flags.cc2if().is_match());
        if !tick || pulse_end || self.resting {
            return self.acknowledge_other(tick, pulse_end, shared);
        }
        self.timer.sr().write(|w| w.cc1if().clear());
        true
    }

    /// All that is not just a tick: ends the pulse where that is due, starts out of rest.
    /// Declared cold though each pulse comes here once: it keeps the registers free for the tick (8 instructions).
    #[cold]
    fn acknowledge_other<const MOTORS: usize>(
        &mut self,
        tick: bool,
        pulse_end: bool,
        shared: &Shared<MOTORS>,
    ) -> bool {
        if pulse_end {
            self.timer.sr().write(|w| w.cc2if().clear());
            self.end_pulse();
        }
        if tick {
            self.timer.sr().write(|w| w.cc1if().clear());
        }
        if self.resting {
            shared.is_running() && self.start()
        } else {
            tick
        }
    }

    /// Makes now the instant from which the first wait counts. An old instant in the compare register may
    /// come round once more (every 51 s) until it is replaced: the flag is cleared after that.
    fn start(&mut self) -> bool {
        let now = self.timer.cnt().read().bits();
        self.timer.ccr1().write(|w| w.ccr().set(now));
        self.timer.sr().write(|w| w.cc1if().clear());
        self.resting = false;
        true
    }

    fn end_pulse(&mut self) {
        write_pins(STEP_END);
        write_pins(self.directions);
    }
}

impl StepPort for Port {
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        write_pins(step_word(motors));
        let end = self.timer.cnt().read().bits().wrapping_add(PULSE);
        self.timer.ccr2().write(|w| w.ccr().set(end));
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        self.directions = direction_word(negative);
        if !pulse_is_high() {
            write_pins(self.directions);
        }
    }

    /// This board has no synchronised outputs.
    #[inline]
    fn set_outputs(&mut self, _: Outputs) {}

    #[inline]
    fn set_power(&mut self, power: Power) {
        self.power.set_duty(power.level(self.power_period));
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) -> bool {
        // The compare register still holds the instant at which this tick was due.
        let due = self.timer.ccr1().read().bits().wrapping_add(wait.0);
        self.timer.ccr1().write(|w| w.ccr().set(due));
        // Less than half the timer's range (25 s) ahead is the future. An instant that has passed will not match.
        let now = self.timer.cnt().read().bits();
        let late = now.wrapping_sub(due).cast_signed() >= 0;
        if late {
            self.timer.egr().write(|w| w.cc1g().set_bit());
        }
        late
    }

    fn rest(&mut self) {
        self.resting = true;
    }
}

/// Whether a step pin is high.
fn pulse_is_high() -> bool {
    // SAFETY: a load from the port's output register (RM0090 section 8.4.6) has no effect.
    #[allow(unsafe_code)]
    let output = unsafe { (*GPIOE::ptr()).odr().read().bits() };
    output & STEP_PINS != 0
}

/// Sets and resets pins of the motors' port in one store (RM0090 section 8.4.7).
fn write_pins(word: u32) {
    // SAFETY: the set/reset register changes only the pins named in the word, those of `wiring`, and these
    // belong to the step interrupt; a store cannot interfere with another one.
    #[allow(unsafe_code)]
    unsafe {
        (*GPIOE::ptr()).bsrr().write(|w| w.bits(word));
    }
}
