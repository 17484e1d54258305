//! Step pins, direction pins and step timer: the board's side of the step interrupt.
//!
//! TIM2 counts freely at [`APB1_TIMER_HZ`] (RM0090 section 18.3). Its first compare register holds the instant of the next
//! tick, its second one the end of the pulse under way:
//!
//! ```text
//!  compare 1   |                 |          next tick: steps, then the tick after it is prepared
//!  compare 2        |                 |     end of the pulse: pins low, new directions out
//!              __________             _____
//!  step pin __|     ^    |___________|
//! ```
//!
//! What goes to the ports for each set of motors stands ready in a table ([`Words`]): one store for each port that has
//! step pins, one after the other. Boards with all of them on one port step all motors at the same instant.
use crate::{
    clock::APB1_TIMER_HZ,
    gpio::{Bank, Pin},
    profile::{banks, index_of, MOTORS, PROFILE},
    pwm,
    wake::wake,
};
use core::{
    array::from_fn,
    sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed},
};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, Outputs, Power, Shared, StepPort, Ticks};
use stm32f4::stm32f407::{Interrupt, TIM2};

/// Sets of motors.
const SETS: usize = 1 << MOTORS;
/// Counts in a microsecond.
const MICROSECOND: u32 = APB1_TIMER_HZ / 1_000_000;

const STEP_PINS: [Pin; MOTORS] = {
    let mut pins = [PROFILE.motors[0].step; MOTORS];
    let mut motor = 0;
    while motor < MOTORS {
        pins[motor] = PROFILE.motors[motor].step;
        motor += 1;
    }
    pins
};
const DIRECTION_PINS: [Pin; MOTORS] = {
    let mut pins = [PROFILE.motors[0].direction; MOTORS];
    let mut motor = 0;
    while motor < MOTORS {
        pins[motor] = PROFILE.motors[motor].direction;
        motor += 1;
    }
    pins
};
const STEP_BANKS: ([Bank; MOTORS], usize) = banks(STEP_PINS);
const DIRECTION_BANKS: ([Bank; MOTORS], usize) = banks(DIRECTION_PINS);

/// The words for each set of motors, one a port. Written by the main loop at rest, read by the step interrupt.
struct Words<const BANKS: usize>([[AtomicU32; BANKS]; SETS]);

impl<const BANKS: usize> Words<BANKS> {
    const fn new() -> Self {
        Self([const { [const { AtomicU32::new(0) }; BANKS] }; SETS])
    }

    /// Puts the words for `motors` on the ports.
    #[inline(always)]
    fn write(&self, banks: &[Bank; MOTORS], motors: MotorMask) {
        // Within the table: bits beyond the motors are masked off, and the compiler sees it.
        let words = &self.0[usize::from(motors.bits()) % SETS];
        for (bank, word) in banks.iter().zip(words) {
            bank.write(word.load(Relaxed));
        }
    }

    /// Makes the table: for each set, what `level` says of each pin by the motor's number and whether it is in the set;
    /// `None` leaves the pin alone.
    fn fill(
        &self,
        pins: &[Pin; MOTORS],
        banks: &[Bank; MOTORS],
        level: impl Fn(usize, bool) -> Option<bool>,
    ) {
        for (set, words) in (0u8..).zip(&self.0) {
            let set = MotorMask::from_bits(set);
            for (bank, word) in words.iter().enumerate() {
                let here = |(motor, pin): (usize, &Pin)| {
                    let high = level(motor, set.contains(motor))?;
                    (index_of(banks, MOTORS, pin.bank) == bank).then(|| pin.word(high))
                };
                let all = pins.iter().enumerate().filter_map(here);
                word.store(all.fold(0, |word, pin| word | pin), Relaxed);
            }
        }
    }
}

static STEPS: Words<{ STEP_BANKS.1 }> = Words::new();
static DIRECTIONS: Words<{ DIRECTION_BANKS.1 }> = Words::new();
/// Words that end a pulse, one a port.
static PULSE_END: [AtomicU32; STEP_BANKS.1] = [const { AtomicU32::new(0) }; STEP_BANKS.1];
/// Counts that a pulse lasts.
static PULSE: AtomicU32 = AtomicU32::new(10 * MICROSECOND);
/// The tables are new: pins have to follow.
static REWIRED: AtomicBool = AtomicBool::new(false);

/// Puts the wiring into effect. Main loop, at rest; the step interrupt puts the pins to their new levels.
pub(crate) fn configure(port: &PortConfig) {
    let (steps, directions) = (port.step_invert, port.direction_invert);
    STEPS.fill(&STEP_PINS, &STEP_BANKS.0, |motor, stepping| {
        stepping.then(|| !steps.contains(motor))
    });
    DIRECTIONS.fill(&DIRECTION_PINS, &DIRECTION_BANKS.0, |motor, negative| {
        Some(negative != directions.contains(motor))
    });
    let ends: [u32; STEP_BANKS.1] = from_fn(|bank| {
        let here = STEP_PINS
            .iter()
            .enumerate()
            .filter(|(_, pin)| index_of(&STEP_BANKS.0, STEP_BANKS.1, pin.bank) == bank);
        here.fold(0, |word, (motor, pin)| {
            word | pin.word(steps.contains(motor))
        })
    });
    for (word, end) in PULSE_END.iter().zip(ends) {
        word.store(end, Relaxed);
    }
    // The timer's count at the edge is rounded down: one count more, so that a pulse is never short.
    PULSE.store(u32::from(port.pulse_us) * MICROSECOND + 1, Relaxed);
    REWIRED.store(true, Relaxed);
    rtic::pend(Interrupt::TIM2);
}

/// What the step interrupt drives.
pub(crate) struct Port {
    timer: TIM2,
    /// The instant of the tick that is armed, as compare 1 has it: to read it there takes 16 cycles.
    due: u32,
    /// No tick is armed.
    resting: bool,
    /// A pulse is under way.
    pulse: bool,
    /// The motors that turn the negative way: written where no step pin is high, and again whenever a pulse ends.
    negative: MotorMask,
}

impl Port {
    /// Starts the timer; no tick comes until the first [`Port::acknowledge`] of a running machine.
    pub(crate) fn new(timer: TIM2) -> Self {
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().update());
        timer.sr().write(|w| w.uif().clear_bit());
        timer
            .dier()
            .write(|w| w.cc1ie().enabled().cc2ie().enabled());
        timer.cr1().write(|w| w.cen().enabled());
        Port {
            timer,
            due: 0,
            resting: true,
            pulse: false,
            negative: MotorMask::NONE,
        }
    }

    /// Clears the timer's flags. Returns whether a tick is due, out of rest when the main loop says so.
    #[inline]
    pub(crate) fn acknowledge(&mut self, shared: &Shared<MOTORS>) -> bool {
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
    fn acknowledge_other(&mut self, tick: bool, pulse_end: bool, shared: &Shared<MOTORS>) -> bool {
        if pulse_end {
            self.timer.sr().write(|w| w.cc2if().clear());
            self.end_pulse();
        }
        if tick {
            self.timer.sr().write(|w| w.cc1if().clear());
        }
        if self.resting {
            self.follow_wiring();
            shared.is_running() && self.start()
        } else {
            tick
        }
    }

    /// Puts the pins to the levels that new tables ask for; where a pulse is under way, its end does.
    fn follow_wiring(&mut self) {
        if REWIRED.swap(false, Relaxed) && !self.pulse {
            self.end_pulse();
        }
    }

    /// Makes now the instant from which the first wait counts. An old instant in the compare register may
    /// come round once more (every 51 s) until it is replaced: the flag is cleared after that.
    fn start(&mut self) -> bool {
        self.due = self.timer.cnt().read().bits();
        self.timer.ccr1().write(|w| w.ccr().set(self.due));
        self.timer.sr().write(|w| w.cc1if().clear());
        self.resting = false;
        true
    }

    fn end_pulse(&mut self) {
        for (bank, word) in STEP_BANKS.0.iter().zip(&PULSE_END) {
            bank.write(word.load(Relaxed));
        }
        DIRECTIONS.write(&DIRECTION_BANKS.0, self.negative);
        self.pulse = false;
    }
}

impl StepPort for Port {
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        STEPS.write(&STEP_BANKS.0, motors);
        let width = PULSE.load(Relaxed);
        let end = self.timer.cnt().read().bits().wrapping_add(width);
        self.timer.ccr2().write(|w| w.ccr().set(end));
        // The end of the pulse before may have come since this interrupt began: it must not end this one.
        self.timer.sr().write(|w| w.cc2if().clear());
        self.pulse = true;
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        self.negative = negative;
        if !self.pulse {
            DIRECTIONS.write(&DIRECTION_BANKS.0, negative);
        }
    }

    /// This board has no synchronised outputs; but a segment has left the queue, and there is room for another.
    #[inline]
    fn set_outputs(&mut self, _: Outputs) {
        wake();
    }

    #[inline]
    fn set_power(&mut self, power: Power) {
        pwm::set(power);
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) -> bool {
        let due = self.due.wrapping_add(wait.0);
        self.timer.ccr1().write(|w| w.ccr().set(due));
        self.due = due;
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
        wake();
    }
}
