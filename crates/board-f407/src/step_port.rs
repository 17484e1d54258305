//! Step pins, direction pins and step timer: the board's side of the step interrupt.
//!
//! TIM2 counts freely at [`APB1_TIMER_HZ`] (RM0090 section 18.3). Its compare register holds the
//! instant of the next tick. TIM11 counts a pulse once (one-pulse mode, section 19.3.10) and says
//! when it is over:
//!
//! ```text
//!  TIM2       |                 |          next tick: steps, then the tick after it is prepared
//!  TIM11         |====>|           |====>| end of the pulse: pins low, new directions out
//!                 _____             _____
//!  step pin _____|     |___________|
//! ```
//!
//! A tick interrupts the end of a pulse, so that edges keep their distance from the schedule;
//! nothing but a tick does. That a tick never comes just between the look at TIM11 and the stores
//! that end its pulse is a matter of time: ticks are a pulse and 1 µs apart at least
//! (`StepTiming::F407`), and the pins are low 0.3 µs after a pulse's end. Where a pulse is over
//! while a tick is at work, it ends after the tick: 1.3 µs later at most, 3.2 µs where the tick
//! begins a line.
//!
//! What goes to the ports for each set of motors stands ready in a table ([`Words`]): one store for
//! each port that has step pins, one after the other. Boards with all of them on one port step all
//! motors at the same instant.
use crate::{
    chip::Bank,
    clock::APB1_TIMER_HZ,
    fast_memory::placed,
    gpio::Pin,
    profile::{banks, index_of, MOTORS, PROFILE},
    pwm,
    registers::{pulse_timer, tick_timer},
    wake::wake,
};
use core::{
    array::from_fn,
    sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed},
};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, OutputChange, Power, Shared, StepPort, Ticks};
use stm32f4::stm32f407::{tim2::dier, Interrupt, TIM11, TIM2};

/// The interrupt of TIM11: the main loop pends it where there is something to start, or new tables
/// to follow.
pub(crate) const PULSE_END_INTERRUPT: Interrupt = Interrupt::TIM1_TRG_COM_TIM11;

/// Sets of motors.
const SETS: usize = 1 << MOTORS;
/// Counts of TIM11, which is on APB2, in a microsecond.
const PULSE_MICROSECOND: u32 = 2 * APB1_TIMER_HZ / 1_000_000;

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

/// The words for each set of motors, one a port. Written by the main loop at rest, read by the step
/// interrupt.
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

    /// Makes the table. For each set of motors, `level` answers the level of each pin, from the
    /// motor's number and whether it is in the set. `None` leaves the pin alone.
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

// SAFETY of the section: memory that `fast_memory` has zeroed before anybody looks at it.
placed! { ".bss.ccm.steps";
    static STEPS: Words<{ STEP_BANKS.1 }> = Words::new();
}
placed! { ".bss.ccm.directions";
    static DIRECTIONS: Words<{ DIRECTION_BANKS.1 }> = Words::new();
}
placed! { ".bss.ccm.pulse_end";
    /// Words that end a pulse, one a port.
    static PULSE_END: [AtomicU32; STEP_BANKS.1] = [const { AtomicU32::new(0) }; STEP_BANKS.1];
}
/// The tables are new: pins have to follow.
static REWIRED: AtomicBool = AtomicBool::new(false);
/// Counts of TIM11 that a pulse lasts.
static PULSE: AtomicU32 = AtomicU32::new(10 * PULSE_MICROSECOND);

placed! { ".bss.ccm.negative";
    /// The motors that turn the negative way: set by the tick that begins a line, written where no
    /// step pin is high, and again whenever a pulse ends.
    static NEGATIVE: AtomicU8 = AtomicU8::new(0);
}
placed! { ".bss.ccm.ticking";
    /// A tick is armed, or at work. Otherwise the end of a pulse may use the data of ticks.
    static TICKING: AtomicBool = AtomicBool::new(false);
}

/// Puts the wiring into effect. Main loop, at rest; the step interrupt puts the pins to their new
/// levels.
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
    PULSE.store(u32::from(port.pulse_us) * PULSE_MICROSECOND, Relaxed);
    REWIRED.store(true, Relaxed);
    rtic::pend(PULSE_END_INTERRUPT);
}

/// Counts behind its instant at which a tick is missed: 100 µs. Nothing keeps a tick away for
/// longer than an instruction.
const MISSED: u32 = 8_400;

/// Whether an instant has come: less than half the timer's range (25 s) ahead is the future.
#[inline(always)]
fn has_come(instant: u32, now: u32) -> bool {
    now.wrapping_sub(instant).cast_signed() >= 0
}

#[inline(always)]
fn count() -> u32 {
    tick_timer().cnt().read().bits()
}

/// Starts the timers; no tick comes until the main loop starts the machine.
pub(crate) fn start(_: TIM2, _: TIM11) {
    tick_timer().arr().write(|w| w.arr().set(u32::MAX));
    tick_timer().egr().write(|w| w.ug().update());
    tick_timer().cr1().write(|w| w.cen().enabled());
    pulse_timer().dier().write(|w| w.uie().enabled());
}

/// At rest: puts new levels out (where a pulse is under way, its end puts them out). Whether motion
/// is to begin. Interrupt of TIM11, which the main loop pends.
#[inline(always)] // with `is_pulsing` inlined too, a pulse ends in 69 cycles and not in 77
pub(crate) fn is_to_start(shared: &Shared<MOTORS>) -> bool {
    !TICKING.load(Relaxed) && rewire_and_look(shared)
}

#[cold]
#[inline(never)]
fn rewire_and_look(shared: &Shared<MOTORS>) -> bool {
    if !is_pulsing() && REWIRED.swap(false, Relaxed) {
        // 255 µs at most, 42 840 counts.
        let counts = PULSE.load(Relaxed) as u16;
        pulse_timer().arr().write(|w| w.arr().set(counts));
        end_pulse();
    }
    shared.is_running()
}

/// Whether step pins are high: TIM11 counts, or nobody has seen yet that it has stopped.
#[inline(always)] // see `is_to_start`
fn is_pulsing() -> bool {
    pulse_timer().cr1().read().cen().bit_is_set() || pulse_timer().sr().read().uif().bit_is_set()
}

/// Ends the pulse where it is over. Either step interrupt.
#[inline(always)]
pub(crate) fn end_pulse_if_over() {
    if pulse_timer().sr().read().uif().bit_is_set() {
        pulse_timer().sr().write(|w| w.uif().clear_bit());
        end_pulse();
    }
}

#[inline(always)]
fn end_pulse() {
    for (bank, word) in STEP_BANKS.0.iter().zip(&PULSE_END) {
        bank.write(word.load(Relaxed));
    }
    // From here on a tick that begins a line puts its directions out by itself; older ones must not
    // follow them.
    loop {
        let negative = NEGATIVE.load(Relaxed);
        DIRECTIONS.write(&DIRECTION_BANKS.0, MotorMask::from_bits(negative));
        if NEGATIVE.load(Relaxed) == negative {
            return;
        }
    }
}

/// Has a tick whose instant has passed come as soon as a pulse may begin; from which instant on the
/// schedule goes on.
#[cold]
#[inline(never)]
fn make_up(now: u32) -> u32 {
    end_pulse_if_over();
    if !is_pulsing() {
        make_tick_come();
        return now;
    }
    // The tick before came late itself, and its pulse has only begun: as far apart as ticks are at
    // least.
    let due = now.wrapping_add(PULSE.load(Relaxed) / 2 + APB1_TIMER_HZ / 1_000_000);
    tick_timer().ccr1().write(|w| w.ccr().set(due));
    due
}

/// Has the armed tick come at once, whatever its instant is.
fn make_tick_come() {
    tick_timer().egr().write(|w| w.cc1g().set_bit());
}

/// Has the armed tick come where its instant has passed unmet: something kept the core from the
/// compare for too long, and the timer would come round to it in 51 s. Main loop, at every turn.
pub(crate) fn catch_missed_tick() {
    let instant = || tick_timer().ccr1().read().bits();
    let due = instant();
    let missed = has_come(due.wrapping_add(MISSED), count());
    // A tick in between would have armed another one.
    if missed && TICKING.load(Relaxed) && instant() == due {
        make_tick_come();
    }
}

/// The outputs of ticks. TIM2's interrupt uses it; TIM11's interrupt uses it where no tick is
/// armed.
pub(crate) struct Port {
    /// The instant of the tick that is armed, as compare 1 has it: to read it there takes 16
    /// cycles.
    due: u32,
}

impl Port {
    /// At rest.
    pub(crate) const fn new() -> Self {
        Port { due: 0 }
    }

    /// Clears the flag of the tick that is due.
    #[inline(always)]
    pub(crate) fn acknowledge(&mut self) {
        tick_timer().sr().write(|w| w.cc1if().clear());
    }

    /// Makes now the instant from which the first wait counts. At rest.
    pub(crate) fn begin(&mut self) {
        self.due = count();
    }
}

/// Has a tick come at once, and lets those come that it arms. Interrupt of TIM11, at rest. The flag
/// goes up before the interrupt is let through: it may be up already, since the timer has come round
/// to the compare register at rest, and two ticks would come.
pub(crate) fn let_ticks_come() {
    TICKING.store(true, Relaxed);
    make_tick_come();
    tick_timer()
        .dier()
        .write(|w| keep_captures(w).cc1ie().enabled());
}

/// The requests of the other channels, where they capture edges (`src/capture.rs`); none otherwise.
#[inline(always)]
pub(crate) fn keep_captures(w: &mut dier::W) -> &mut dier::W {
    if cfg!(captures) {
        w.cc2de().set_bit().cc3de().set_bit().cc4de().set_bit()
    } else {
        w
    }
}

/// Changes the outputs of M62 to M65: one store for each that changes. Any context.
#[inline(always)] // the step interrupt calls it, and reaches no code in the flash (`cargo xtask thumb`)
pub(crate) fn change_outputs(change: OutputChange) {
    for (index, output) in PROFILE.synchronised.iter().enumerate() {
        let bit = 1 << index;
        if (change.set | change.clear) & bit != 0 {
            output.switch(change.set & bit != 0);
        }
    }
}

impl StepPort for Port {
    /// A pulse that is still high would be made no longer: ticks are further apart than that.
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        STEPS.write(&STEP_BANKS.0, motors);
        // In one-pulse mode the counter has stopped at 0.
        pulse_timer()
            .cr1()
            .write(|w| w.cen().enabled().opm().enabled());
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        NEGATIVE.store(negative.bits(), Relaxed);
        if !is_pulsing() {
            DIRECTIONS.write(&DIRECTION_BANKS.0, negative);
        }
    }

    /// A segment has left the queue, and there is room for another.
    #[inline]
    fn change_outputs(&mut self, change: OutputChange) {
        change_outputs(change);
        wake();
    }

    #[inline]
    fn set_power(&mut self, power: Power) {
        pwm::set(power);
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) -> bool {
        self.due = self.due.wrapping_add(wait.0);
        tick_timer().ccr1().write(|w| w.ccr().set(self.due));
        // An instant that has passed will not match.
        let now = count();
        let late = has_come(self.due, now);
        if late {
            // The schedule goes on from here: ticks that made up for it would be closer than a
            // pulse.
            self.due = make_up(now);
        }
        late
    }

    fn rest(&mut self) {
        TICKING.store(false, Relaxed);
        // The instant in the compare register comes round every 51 s.
        tick_timer().dier().write(|w| keep_captures(w));
        wake();
    }
}
