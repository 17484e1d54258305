//! Step pins, direction pins and step timer: the board's side of the step interrupt.
//!
//! TIM2 counts freely at [`APB1_TIMER_HZ`] (RM0090 section 18.3). Its compare register holds the instant of the next tick.
//! TIM11 counts a pulse once (one-pulse mode, section 19.3.9) and says when it is over:
//!
//! ```text
//!  TIM2       |                 |          next tick: steps, then the tick after it is prepared
//!  TIM11         |====>|           |====>| end of the pulse: pins low, new directions out
//!                 _____             _____
//!  step pin _____|     |___________|
//! ```
//!
//! Both interrupts have the highest priority, so that neither interrupts the other: what they share needs no lock. Where a
//! tick is due so soon after a pulse's end that it would have to wait for that interrupt, the end comes early and waits
//! for both, first the end, then the tick ([`Port::meet`]): edges keep their distance from the schedule.
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
use cortex_m::peripheral::NVIC;
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, Outputs, Power, Shared, StepPort, Ticks};
use stm32f4::stm32f407::{Interrupt, TIM11, TIM2};

/// The interrupt of TIM11: the main loop pends it where there is something to start, or new tables to follow.
pub(crate) const PULSE_END_INTERRUPT: Interrupt = Interrupt::TIM1_TRG_COM_TIM11;

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
    PULSE.store(u32::from(port.pulse_us) * MICROSECOND, Relaxed);
    REWIRED.store(true, Relaxed);
    rtic::pend(PULSE_END_INTERRUPT);
}

/// Counts from the look at the time to the start of a pulse: as it is at most ticks. Only [`Port::meet`] relies on it.
const RISE: u32 = 20;
/// A tick that is due within so many counts of a pulse's end would be delayed by the interrupt that ends the pulse (0.9 µs).
const NEAR: u32 = 72;
/// Counts from the interrupt at a pulse's end to where it has ended the pulse and waits for the tick, at most.
const READY: u32 = 72;
/// How much sooner a pulse may end than worked out from [`RISE`], in counts.
const EARLY: u32 = 8;
/// Counts from the look at the time to the next tick's being armed, at most: what is further off has not passed by then.
/// 3 µs.
const ARMED: u32 = 252;
/// Counts that it takes to have a pulse's end come early, at most.
const SETTING: u32 = 32;

/// Counts of TIM11, which is on APB2, in one of TIM2.
const PULSE_COUNTS: u32 = 2;

/// Whether an instant has come: less than half the timer's range (25 s) ahead is the future.
#[inline(always)]
fn has_come(instant: u32, now: u32) -> bool {
    now.wrapping_sub(instant).cast_signed() >= 0
}

/// What the timer is about.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// A tick is armed, and no step pin is high.
    Low,
    /// A tick is armed, and a pulse is under way.
    Pulse,
    /// No tick is armed, and the pulse before is under way.
    LastPulse,
    /// No tick is armed.
    Rest,
}

impl Phase {
    fn is_pulse(self) -> bool {
        match self {
            Self::Pulse | Self::LastPulse => true,
            Self::Low | Self::Rest => false,
        }
    }

    fn with_pins_low(self) -> Self {
        match self {
            Self::Pulse | Self::Low => Self::Low,
            Self::LastPulse | Self::Rest => Self::Rest,
        }
    }

    fn in_motion(self) -> Self {
        if self.is_pulse() {
            Self::Pulse
        } else {
            Self::Low
        }
    }

    fn at_rest(self) -> Self {
        if self.is_pulse() {
            Self::LastPulse
        } else {
            Self::Rest
        }
    }
}

/// What the step interrupts drive: that of TIM2, a tick, and that of TIM11, the end of a pulse.
pub(crate) struct Port {
    timer: TIM2,
    pulse: TIM11,
    phase: Phase,
    /// When this interrupt looked at the time.
    now: u32,
    /// The instant of the tick that is armed, as compare 1 has it: to read it there takes 16 cycles.
    due: u32,
    /// The instant at which the pulse that was made last ends, within [`EARLY`].
    end: u32,
    /// The end of the pulse comes early, to wait for the tick.
    meets: bool,
    /// The motors that turn the negative way: written where no step pin is high, and again whenever a pulse ends.
    negative: MotorMask,
}

impl Port {
    /// Starts the timer; no tick comes until the main loop starts the machine.
    pub(crate) fn new(timer: TIM2, pulse: TIM11) -> Self {
        timer.arr().write(|w| w.arr().set(u32::MAX));
        timer.egr().write(|w| w.ug().update());
        timer.cr1().write(|w| w.cen().enabled());
        Self::stop_counting(&pulse);
        pulse.dier().write(|w| w.uie().enabled());
        Port {
            timer,
            pulse,
            phase: Phase::Rest,
            now: 0,
            due: 0,
            end: 0,
            meets: false,
            negative: MotorMask::NONE,
        }
    }

    /// Looks at the time, and clears the flag of the tick that is due.
    #[inline(always)]
    pub(crate) fn acknowledge(&mut self) {
        self.now = self.count();
        self.timer.sr().write(|w| w.cc1if().clear());
    }

    /// Ends the pulse where that is due, starts out of rest. Returns whether a tick is due as well, out of rest when the
    /// main loop says so; after that comes [`Port::after_tick`]. Interrupt of TIM11, or pended by the main loop.
    #[inline(always)]
    pub(crate) fn on_pulse_end(&mut self, shared: &Shared<MOTORS>) -> bool {
        // Before the look at the counter: an end that comes in between is not lost.
        self.pulse.sr().write(|w| w.uif().clear_bit());
        // The end of the pulse before can come as well: in the tick that has made this one.
        if self.meets && has_come(self.end.wrapping_sub(2 * NEAR), self.count()) {
            self.end_and_wait();
            return true;
        }
        // A tick that has come in between has started it again.
        if self.phase.is_pulse() && self.pulse.cr1().read().cen().is_disabled() {
            self.phase = self.phase.with_pins_low();
            self.end_pulse();
        }
        match self.phase {
            Phase::Low | Phase::Pulse => false,
            Phase::Rest | Phase::LastPulse => self.start_when_asked(shared),
        }
    }

    /// Waits for the end of the pulse, and for the tick that is due just after it.
    #[inline(always)]
    fn end_and_wait(&mut self) {
        self.meets = false;
        self.wait(self.end);
        self.end_pulse();
        self.phase = Phase::Low;
        self.set_pulse(PULSE.load(Relaxed) * PULSE_COUNTS);
        self.wait(self.due);
        self.acknowledge();
    }

    /// Forgets the interrupt of a tick that was waited for: its flag has pended it. Where the tick that is armed has come
    /// by now, it is asked for anew.
    #[inline(always)]
    pub(crate) fn after_tick(&mut self) {
        NVIC::unpend(Interrupt::TIM2);
        if has_come(self.due, self.count()) && self.phase != Phase::Rest {
            self.timer.egr().write(|w| w.cc1g().set_bit());
        }
    }

    /// Has the interrupt at the pulse's end wait for the tick that is due just after it, and come early where it would not be
    /// ready in time: 0.8 µs of waiting at most.
    #[cold]
    #[inline(never)]
    fn meet(&mut self) {
        if !self.phase.is_pulse() {
            return;
        }
        self.meets = true;
        let ready = self.due.wrapping_sub(READY);
        if has_come(self.end, ready) {
            return;
        }
        let ahead = ready.wrapping_sub(self.count()).cast_signed();
        if ahead <= SETTING.cast_signed() {
            // It must not say so once more at the end.
            Self::stop_counting(&self.pulse);
            rtic::pend(PULSE_END_INTERRUPT);
        } else {
            let passed = self.pulse.cnt().read().cnt().bits();
            self.set_pulse(u32::from(passed) + ahead.cast_unsigned() * PULSE_COUNTS);
        }
    }

    /// Stopped, the counter is ready to be set to 0 without that being the end of a pulse.
    fn stop_counting(pulse: &TIM11) {
        pulse.cr1().write(|w| {
            w.cen().disabled().opm().enabled();
            w.urs().counter_only()
        });
    }

    /// Waits for an instant that is near.
    #[inline(always)]
    fn wait(&self, instant: u32) {
        while !has_come(instant, self.count()) {}
    }

    /// Sets the counts of TIM11 that a pulse lasts.
    fn set_pulse(&self, counts: u32) {
        // 255 µs at most, 42 840 counts.
        self.pulse.arr().write(|w| w.arr().set(counts as u16));
    }

    #[inline(always)]
    fn count(&self) -> u32 {
        self.timer.cnt().read().bits()
    }

    /// Puts the pins to the levels that new tables ask for (where a pulse is under way, its end does), and makes now the
    /// instant from which the first wait counts, where the main loop has started the machine.
    fn start_when_asked(&mut self, shared: &Shared<MOTORS>) -> bool {
        if self.phase == Phase::Rest && REWIRED.swap(false, Relaxed) {
            self.set_pulse(PULSE.load(Relaxed) * PULSE_COUNTS);
            self.end_pulse();
        }
        let started = shared.is_running();
        if started {
            self.phase = self.phase.in_motion();
            self.now = self.count();
            self.due = self.now;
            self.timer.dier().write(|w| w.cc1ie().enabled());
        }
        started
    }

    fn end_pulse(&mut self) {
        for (bank, word) in STEP_BANKS.0.iter().zip(&PULSE_END) {
            bank.write(word.load(Relaxed));
        }
        DIRECTIONS.write(&DIRECTION_BANKS.0, self.negative);
    }
}

impl StepPort for Port {
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        STEPS.write(&STEP_BANKS.0, motors);
        self.pulse.egr().write(|w| w.ug().update());
        self.pulse.cr1().write(|w| {
            w.cen().enabled().opm().enabled();
            w.urs().counter_only()
        });
        self.phase = Phase::Pulse;
        self.end = self.now.wrapping_add(PULSE.load(Relaxed) + RISE);
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        self.negative = negative;
        if !self.phase.is_pulse() {
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
        self.due = self.due.wrapping_add(wait.0);
        self.timer.ccr1().write(|w| w.ccr().set(self.due));
        if self.due.wrapping_sub(self.end).wrapping_add(EARLY) < NEAR + EARLY {
            self.meet();
        }
        // An instant that has passed will not match. One that is far off need not be looked at.
        if !has_come(self.due.wrapping_sub(ARMED), self.now) {
            return false;
        }
        let late = has_come(self.due, self.count());
        if late {
            self.timer.egr().write(|w| w.cc1g().set_bit());
        }
        late
    }

    fn rest(&mut self) {
        self.phase = self.phase.at_rest();
        // The instant in the compare register comes round every 51 s.
        self.timer.dier().reset();
        wake();
    }
}
