//! A step port of pins and one alarm, which times both ticks and the ends of pulses.

use crate::fault::Fault;
use crate::port::Port;
use crate::step_pins::StepPins;
use crate::words::{Pulse, Words};
use embedded_hal::pwm::SetDutyCycle;
use leadscrew_stepper::{MotorMask, OutputChange, Power, PowerScale, StepPort, Ticks};

/// The step timer: a count that never stops, and an interrupt at an instant of it. Called from the
/// step interrupt.
///
/// The handler calls [`crate::Stepping::tick`] and nothing else: each tick ends with one of the
/// last two methods, and these clear the interrupt's flag.
pub trait Alarm {
    /// The count, in units of `Config::timer_hz`. It wraps around after 2³².
    fn count(&self) -> u32;

    /// Makes one interrupt come when the count is `at`, in place of an earlier request, and at once
    /// if it has passed (`at` less the count is not below 2³¹, wrapping), also if it passes during
    /// this call. A timer that compares for equality looks at the count once more, and pends its
    /// interrupt.
    fn ring_at(&mut self, at: u32);

    /// Makes no interrupt come until the next request.
    fn silence(&mut self);
}

/// An output whose power changes with the steps.
pub trait Light {
    /// Sets the power.
    ///
    /// # Errors
    /// It cannot be set.
    fn shine(&mut self, power: Power) -> Result<(), Fault>;
}

/// No laser: power is the main loop's.
#[derive(Clone, Copy, Debug)]
pub struct WithoutLight;

impl Light for WithoutLight {
    fn shine(&mut self, _: Power) -> Result<(), Fault> {
        Ok(())
    }
}

/// A PWM whose duty cycle is the power.
pub struct Pwm<L> {
    pwm: L,
    scale: PowerScale,
}

impl<L: SetDutyCycle> Pwm<L> {
    pub(crate) fn new(pwm: L) -> Self {
        let scale = PowerScale::new(pwm.max_duty_cycle());
        Self { pwm, scale }
    }

    pub(crate) fn set(&mut self, power: Power) -> Result<(), L::Error> {
        let level = u16::try_from(power.level(self.scale)).unwrap_or(u16::MAX);
        self.pwm.set_duty_cycle(level)
    }
}

impl<L: SetDutyCycle> Light for Pwm<L> {
    fn shine(&mut self, power: Power) -> Result<(), Fault> {
        self.set(power).map_err(|_| Fault::Laser)
    }
}

/// Pins, an alarm and perhaps a laser, as the step interrupt uses them.
pub struct Timed<'a, S, A, L, const MOTORS: usize> {
    pins: S,
    alarm: A,
    light: L,
    words: &'a Words<MOTORS>,
    timer_hz: u32,
    pulse: Pulse,
    /// The least width of a pulse, counts.
    pulse_counts: u32,
    /// The motors that turn in the negative direction.
    negative: MotorMask,
    /// The instant of the tick that comes next, or is being handled.
    due: u32,
    /// The timer runs.
    ticks: bool,
    /// A pulse is high, and ends at this count.
    pulse_end: Option<u32>,
}

impl<'a, S: StepPins, A: Alarm, L: Light, const MOTORS: usize> Timed<'a, S, A, L, MOTORS> {
    pub(crate) fn new(
        pins: S,
        alarm: A,
        light: L,
        words: &'a Words<MOTORS>,
        timer_hz: u32,
    ) -> Self {
        Self {
            pins,
            alarm,
            light,
            words,
            timer_hz,
            pulse: Pulse::default(),
            pulse_counts: 0,
            negative: MotorMask::NONE,
            due: 0,
            ticks: false,
            pulse_end: None,
        }
    }

    /// Asks for the interrupt of what comes next.
    fn ring(&mut self) {
        match (self.ticks, self.pulse_end) {
            (true, Some(end)) if is_before(end, self.due) => self.alarm.ring_at(end),
            (true, _) => self.alarm.ring_at(self.due),
            (false, Some(end)) => self.alarm.ring_at(end),
            (false, None) => self.alarm.silence(),
        }
    }

    fn put_directions(&mut self) {
        let levels = self.negative.bits() ^ self.pulse.direction_invert.bits();
        let put = self.pins.set_directions(MotorMask::from_bits(levels));
        self.check(put);
    }

    fn check<E>(&self, done: Result<(), E>) {
        if done.is_err() {
            self.words.fail(Fault::StepPin);
        }
    }
}

/// Returns true if a count comes before another one, as counts wrap around.
fn is_before(one: u32, other: u32) -> bool {
    one.wrapping_sub(other).cast_signed() < 0
}

impl<S: StepPins, A: Alarm, L: Light, const MOTORS: usize> StepPort for Timed<'_, S, A, L, MOTORS> {
    fn step(&mut self, motors: MotorMask) {
        let levels = motors.bits() ^ self.pulse.step_invert.bits();
        let put = self.pins.set_steps(motors, MotorMask::from_bits(levels));
        self.check(put);
        let end = self.alarm.count().wrapping_add(self.pulse_counts);
        self.pulse_end = Some(end);
    }

    fn set_direction(&mut self, negative: MotorMask) {
        self.negative = negative;
        if self.pulse_end.is_none() {
            self.put_directions();
        }
    }

    fn change_outputs(&mut self, _: OutputChange) {}

    fn set_power(&mut self, power: Power) {
        self.words.note_power(power);
        if let Err(fault) = self.light.shine(power) {
            self.words.fail(fault);
        }
    }

    fn arm(&mut self, wait: Ticks) {
        self.due = self.due.wrapping_add(wait.0);
    }

    fn make_up(&mut self) -> bool {
        self.ring();
        !is_before(self.alarm.count(), self.due)
    }

    fn rest(&mut self) {
        self.ticks = false;
        self.ring();
    }
}

impl<S: StepPins, A: Alarm, L: Light, const MOTORS: usize> Port for Timed<'_, S, A, L, MOTORS> {
    fn configure(&mut self, pulse: &Pulse) {
        self.pulse = *pulse;
        // One more: the pulse begins within a count.
        let counts = u64::from(pulse.pulse_us) * u64::from(self.timer_hz);
        self.pulse_counts = u32::try_from(counts.div_ceil(1_000_000)).unwrap_or(u32::MAX / 4) + 1;
        // All pins go to their levels: at once, or with the end of a pulse.
        if self.pulse_end.is_none() {
            self.end_pulse();
        }
    }

    fn begin(&mut self) {
        self.due = self.alarm.count();
        self.ticks = true;
    }

    fn is_due(&mut self) -> bool {
        let now = self.alarm.count();
        if self.pulse_end.is_some_and(|end| !is_before(now, end)) {
            self.end_pulse();
        }
        !is_before(now, self.due)
    }

    fn wait(&mut self) {
        self.ring();
    }

    fn end_pulse(&mut self) {
        self.pulse_end = None;
        let idle = self.pulse.step_invert;
        let put = self.pins.set_steps(MotorMask::ALL, idle);
        self.check(put);
        self.put_directions();
    }
}
