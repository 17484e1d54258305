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
//! nothing but a tick does. A tick never comes between the look at TIM11 and the stores that end
//! its pulse: ticks are at least a pulse and 1 µs apart (`StepTiming`), and the pins are low 0.3 µs
//! after a pulse's end, 0.6 µs on a board with a record, 0.7 µs with a record and four motors. A
//! pulse that is over while a tick is at work ends after the tick: 1.3 µs later at most; 3.2 µs
//! if the tick begins a line (a straight move, `leadscrew_stepper::Line`), 4.1 µs with a record
//! and four motors.
//!
//! For each set of motors, a table has the words that go to the ports (`wired`, `recorded`). Each
//! port that has step pins gets one store, one port after the other. A board with all step pins on
//! one port steps all motors at the same instant. Motors without drivers have no pulses
//! (`windings`).
#[cfg(record)]
mod recorded;
#[cfg(windings)]
mod windings;
#[cfg(not(any(record, windings)))]
mod wired;

use crate::{
    clock::{wake, APB1_TIMER_HZ},
    fast_memory::placed,
    profile::{MOTORS, SYNCHRONISED},
    pwm,
    registers::{pulse_timer, tick_timer},
};
use core::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering::Relaxed};
use leadscrew_machine::board::PortConfig;
use leadscrew_stepper::{MotorMask, OutputChange, Power, Shared, StepPort, Ticks};
use stm32f4::stm32f407::{tim2::dier, Interrupt, TIM11, TIM2};

#[cfg(record)]
use recorded as ports;
#[cfg(windings)]
use windings as ports;
#[cfg(not(any(record, windings)))]
use wired as ports;

#[cfg(windings)]
pub(crate) use windings::energise;

/// The interrupt of TIM11: the main loop pends it if there is something to start, or new tables
/// to follow.
pub(crate) const PULSE_END_INTERRUPT: Interrupt = Interrupt::TIM1_TRG_COM_TIM11;

/// Counts of TIM11, which is on APB2, in a microsecond.
const PULSE_MICROSECOND: u32 = 2 * APB1_TIMER_HZ / 1_000_000;

/// True if the tables are new, so that the pins have to follow.
static REWIRED: AtomicBool = AtomicBool::new(false);
/// Counts of TIM11 that a pulse lasts.
static PULSE: AtomicU32 = AtomicU32::new(10 * PULSE_MICROSECOND);

placed! { ".bss.ccm.negative";
    /// The motors that turn the negative way: set by the tick that begins a line, written when no
    /// step pin is high, and again whenever a pulse ends.
    static NEGATIVE: AtomicU8 = AtomicU8::new(0);
}
placed! { ".bss.ccm.ticking";
    /// True if a tick is armed, or at work. If not, the end of a pulse may use the data of ticks.
    static TICKING: AtomicBool = AtomicBool::new(false);
}

/// Puts the wiring into effect. Main loop, at rest; the step interrupt puts the pins to their new
/// levels.
pub(crate) fn configure(port: &PortConfig) {
    ports::fill(port.step_invert, port.direction_invert);
    PULSE.store(u32::from(port.pulse_us) * PULSE_MICROSECOND, Relaxed);
    REWIRED.store(true, Relaxed);
    rtic::pend(PULSE_END_INTERRUPT);
}

/// A tick counts as missed from this many counts after its instant: 100 µs. Nothing delays a tick
/// by more than an instruction.
const MISSED: u32 = 8_400;

/// Returns true if an instant has come. An instant that is less than half the timer's range (25 s)
/// ahead is in the future.
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

/// Returns true if motion is to begin. At rest this also puts new levels out; while a step pin is
/// on, it leaves them to the interrupt at the pulse's end. Interrupt of TIM11, which the main loop
/// pends.
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

/// Returns true if step pins are at the level of a pulse: TIM11 counts, or it has stopped and
/// nobody has seen it yet.
#[inline(always)] // see `is_to_start`
fn is_pulsing() -> bool {
    pulse_timer().cr1().read().cen().bit_is_set() || pulse_timer().sr().read().uif().bit_is_set()
}

/// Ends the pulse if its time is over. Called in both step interrupts.
#[inline(always)]
pub(crate) fn end_pulse_if_over() {
    if pulse_timer().sr().read().uif().bit_is_set() {
        pulse_timer().sr().write(|w| w.uif().clear_bit());
        end_pulse();
    }
}

#[inline(always)]
fn end_pulse() {
    ports::end_pulse();
    // From here on a tick that begins a line puts its directions out by itself. Older directions
    // must not be put out after them.
    loop {
        let negative = NEGATIVE.load(Relaxed);
        ports::set_direction(MotorMask::from_bits(negative));
        if NEGATIVE.load(Relaxed) == negative {
            return;
        }
    }
}

/// Makes a tick whose instant has passed come as soon as a pulse may begin. Returns the instant
/// from which the schedule goes on.
#[cold]
#[inline(never)]
fn make_up(now: u32) -> u32 {
    end_pulse_if_over();
    if !is_pulsing() {
        make_tick_come();
        return now;
    }
    // The tick before came late itself, and its pulse has only begun. So this tick comes a pulse
    // and 1 µs from now.
    let due = now.wrapping_add(PULSE.load(Relaxed) / 2 + APB1_TIMER_HZ / 1_000_000);
    tick_timer().ccr1().write(|w| w.ccr().set(due));
    due
}

/// Makes the armed tick come at once, whatever its instant is.
fn make_tick_come() {
    tick_timer().egr().write(|w| w.cc1g().set_bit());
}

/// Makes the armed tick come if its instant has passed without it. That happens if something held
/// the core up for so long that the compare register was written too late: the timer would come
/// round to this instant in 51 s. Main loop, at every turn.
pub(crate) fn catch_missed_tick() {
    let instant = || tick_timer().ccr1().read().bits();
    let due = instant();
    let missed = has_come(due.wrapping_add(MISSED), count());
    // A tick in between would have armed another one.
    if missed && TICKING.load(Relaxed) && instant() == due {
        make_tick_come();
    }
}

/// Changes the outputs of M62 to M65: one store for each that changes. Any context.
#[inline(always)] // the step interrupt must reach no code in the flash (`cargo xtask thumb`)
pub(crate) fn change_outputs(change: OutputChange) {
    for (index, output) in SYNCHRONISED.iter().enumerate() {
        let bit = 1 << index;
        if (change.set | change.clear) & bit != 0 {
            output.switch(change.set & bit != 0);
        }
    }
}

/// The outputs of ticks. TIM2's interrupt uses it; TIM11's interrupt uses it when no tick is
/// armed.
pub(crate) struct Port {
    /// The instant of the tick that is armed, the same as in compare register 1. Reading that
    /// register takes 16 cycles.
    due: u32,
    power: pwm::Channel,
}

impl Port {
    /// Makes a port at rest.
    pub(crate) fn new() -> Self {
        Port {
            due: 0,
            power: pwm::Channel::new(),
        }
    }

    /// Clears the flag of the tick that is due.
    #[inline(always)]
    pub(crate) fn acknowledge(&mut self) {
        tick_timer().sr().write(|w| w.cc1if().clear());
    }

    /// Makes the first wait count from now on. At rest.
    pub(crate) fn begin(&mut self) {
        self.due = count();
    }
}

/// Makes a tick come at once, and lets the ticks come that it arms. Interrupt of TIM11, at rest.
/// The flag is set before the interrupt is enabled. It may be set already, since the timer comes
/// round to the compare register at rest; in the other order two ticks would come.
pub(crate) fn let_ticks_come() {
    TICKING.store(true, Relaxed);
    make_tick_come();
    tick_timer()
        .dier()
        .write(|w| keep_captures(w).cc1ie().enabled());
}

/// Keeps the DMA requests of the other channels if they capture edges (`src/capture.rs`).
#[inline(always)]
pub(crate) fn keep_captures(w: &mut dier::W) -> &mut dier::W {
    if cfg!(captures) {
        w.cc2de().set_bit().cc3de().set_bit().cc4de().set_bit()
    } else {
        w
    }
}

impl StepPort for Port {
    /// A pulse that is still under way would not be made longer; ticks are further apart than a
    /// pulse.
    #[inline]
    fn step(&mut self, motors: MotorMask) {
        ports::step(motors);
        if cfg!(windings) {
            return; // no pulse that has to end
        }
        // In one-pulse mode the counter has stopped at 0.
        pulse_timer()
            .cr1()
            .write(|w| w.cen().enabled().opm().enabled());
    }

    #[inline]
    fn set_direction(&mut self, negative: MotorMask) {
        NEGATIVE.store(negative.bits(), Relaxed);
        if !is_pulsing() {
            ports::set_direction(negative);
        }
    }

    /// Also wakes the main loop: a segment has left the queue, so there is room for another.
    #[inline]
    fn change_outputs(&mut self, change: OutputChange) {
        change_outputs(change);
        wake();
    }

    #[inline]
    fn set_power(&mut self, power: Power) {
        self.power.set(power);
    }

    #[inline]
    fn arm(&mut self, wait: Ticks) {
        self.due = self.due.wrapping_add(wait.0);
        tick_timer().ccr1().write(|w| w.ccr().set(self.due));
    }

    /// To be called some time after [`Self::arm`]. Right after the store of `arm`, reading the
    /// count would wait 9 cycles for the store.
    fn make_up(&mut self) -> bool {
        let now = count();
        if !has_come(self.due, now) {
            return false;
        }
        // The schedule goes on from here: ticks that made up for the lost time would be closer than
        // a pulse.
        self.due = make_up(now);
        true
    }

    fn rest(&mut self) {
        TICKING.store(false, Relaxed);
        // The instant in the compare register comes round every 51 s.
        tick_timer().dier().write(|w| keep_captures(w));
        wake();
    }
}
