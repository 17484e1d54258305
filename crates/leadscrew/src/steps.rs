//! The step interrupt as one value: [`Steps`] from [`crate::new`], with pins and a timer.
//!
//! ```text
//!  timer's interrupt --> Stepping::tick
//!                           1. orders of the main loop: wiring, power at rest
//!                           2. the end of a pulse, if it is due
//!                           3. the start of motion, or the tick that is due
//!                           4. the alarm for what comes next
//! ```

use crate::port::Port;
use crate::step_pins::StepPins;
use crate::timed::{Alarm, Light, Pwm, Timed, WithoutLight};
use crate::words::{Pulse, Words};
use embedded_hal::pwm::SetDutyCycle;
use heapless::spsc::Consumer;
use leadscrew_stepper::{on_timer, start, Power, Segment, StepInterrupt};

/// The step interrupt before it has pins: see [`Steps::on`].
pub struct Steps<'a, const MOTORS: usize> {
    segments: Consumer<'a, Segment<MOTORS>>,
    words: &'a Words<MOTORS>,
    timer_hz: u32,
}

/// The step interrupt. Give it to the handler of the step timer.
pub struct Stepping<'a, P, const MOTORS: usize> {
    interrupt: StepInterrupt<MOTORS>,
    steps: Steps<'a, MOTORS>,
    port: P,
    in_motion: bool,
}

/// The step interrupt of [`Steps::on`], for a `static`.
pub type PinStepping<S, A, const MOTORS: usize> =
    Stepping<'static, Timed<'static, S, A, WithoutLight, MOTORS>, MOTORS>;

/// The step interrupt of [`Steps::on_laser`], for a `static`.
pub type LaserStepping<S, A, L, const MOTORS: usize> =
    Stepping<'static, Timed<'static, S, A, Pwm<L>, MOTORS>, MOTORS>;

impl<'a, const MOTORS: usize> Steps<'a, MOTORS> {
    pub(crate) fn new(
        segments: Consumer<'a, Segment<MOTORS>>,
        words: &'a Words<MOTORS>,
        timer_hz: u32,
    ) -> Self {
        Self {
            segments,
            words,
            timer_hz,
        }
    }

    /// Puts steps onto `pins`, timed by `alarm`. Power goes to the main loop's outputs: right for a
    /// spindle.
    pub fn on<S: StepPins, A: Alarm>(
        self,
        pins: S,
        alarm: A,
    ) -> Stepping<'a, Timed<'a, S, A, WithoutLight, MOTORS>, MOTORS> {
        self.on_light(pins, alarm, WithoutLight)
    }

    /// As [`Steps::on`], with the PWM of a laser, which changes with the very step.
    pub fn on_laser<S: StepPins, A: Alarm, L: SetDutyCycle>(
        self,
        pins: S,
        alarm: A,
        laser: L,
    ) -> Stepping<'a, Timed<'a, S, A, Pwm<L>, MOTORS>, MOTORS> {
        self.on_light(pins, alarm, Pwm::new(laser))
    }

    fn on_light<S: StepPins, A: Alarm, L: Light>(
        self,
        pins: S,
        alarm: A,
        light: L,
    ) -> Stepping<'a, Timed<'a, S, A, L, MOTORS>, MOTORS> {
        let port = Timed::new(pins, alarm, light, self.words, self.timer_hz);
        self.on_port(port)
    }

    /// Puts steps onto a port of your own: registers that are written at once, two timers, a
    /// peripheral that makes the pulses.
    pub fn on_port<P: Port>(self, port: P) -> Stepping<'a, P, MOTORS> {
        Stepping {
            interrupt: StepInterrupt::new(),
            steps: self,
            port,
            in_motion: false,
        }
    }
}

impl<P: Port, const MOTORS: usize> Stepping<'_, P, MOTORS> {
    /// Does what is due: the whole handler of the step timer. Bounded.
    ///
    /// Returns `true` if there is room for a segment, or motion has ended. The main loop is woken
    /// then; nothing is left to do for the caller.
    pub fn tick(&mut self) -> bool {
        let words = self.steps.words;
        if let Some((pulse, power)) = words.take_order() {
            self.obey(&pulse, power);
        }
        if self.in_motion {
            if !self.port.is_due() {
                self.port.wait();
                return false;
            }
        } else if words.shared.is_running() {
            self.port.begin();
            let segments = &self.steps.segments;
            start(&mut self.interrupt, segments, &words.shared, &mut self.port);
        } else {
            self.port.is_due();
            self.port.wait();
            return false;
        }
        let segments = &mut self.steps.segments;
        let looked = on_timer(&mut self.interrupt, segments, &words.shared, &mut self.port);
        self.in_motion = words.shared.is_running();
        if looked {
            words.bells.machine.ring();
        }
        looked
    }

    /// Ends a pulse: the handler of a port's second timer, with the priority of the first. With
    /// [`Steps::on`] there is none, because [`Stepping::tick`] ends pulses.
    pub fn pulse_end(&mut self) {
        self.port.end_pulse();
    }

    /// Returns the port, for its handlers.
    pub fn port(&mut self) -> &mut P {
        &mut self.port
    }

    fn obey(&mut self, pulse: &Pulse, power: Power) {
        self.port.configure(pulse);
        self.port.set_power(power);
    }
}
