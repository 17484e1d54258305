//! The machine around the board: carriages that work switches, and heaters that warm bodies with
//! sensors.
use crate::{
    pins::CPU_HZ,
    steps::{Counter, Step},
    wiring::Switch,
};
use leadscrew_f407emu::{Machine, Pin};

/// The most motors of a board.
const MOST_MOTORS: usize = 4;
/// The temperature of the air, °C.
const ROOM: f64 = 20.0;
/// The share of its excess over the air's temperature that a body loses in a second.
const LOSES: f64 = 0.01;

/// All switches and heated bodies.
#[derive(Clone, Default)]
pub(crate) struct Plant {
    pub(crate) contacts: Vec<Contact>,
    pub(crate) bodies: Vec<Body>,
}

impl Plant {
    /// Follows the pins; `steps` are all step events since power-up.
    pub(crate) fn follow(&mut self, machine: &mut Machine, steps: &[Step]) {
        for contact in &mut self.contacts {
            if let Some(level) = contact.follow(steps) {
                let soon = machine.cycle() + 100;
                machine.pin_at(soon, contact.switch.pin, level);
            }
        }
        for body in &mut self.bodies {
            body.follow(machine);
        }
    }
}

/// A switch that the carriage of a motor works.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    switch: Switch,
    motor: usize,
    /// The switch is closed when the carriage is here or further away from zero, steps.
    place: i64,
    is_closed: bool,
    motors: Counter<MOST_MOTORS>,
    /// The carriage's place after all steps so far, steps.
    at: i64,
}

impl Contact {
    /// An open switch at `place`; the carriage begins at zero.
    pub(crate) fn new(switch: Switch, motor: usize, place: i64) -> Self {
        Contact {
            switch,
            motor,
            place,
            is_closed: false,
            motors: Counter::ZERO,
            at: 0,
        }
    }

    /// Returns how far the carriage is beyond the switch's place, seen from the place at which it
    /// began, steps.
    pub(crate) fn beyond(&self) -> i64 {
        (self.at - self.place) * self.place.signum()
    }

    /// The new level of its pin, if the carriage changes it with the latest of all `steps`.
    fn follow(&mut self, steps: &[Step]) -> Option<bool> {
        self.at = self.motors.follow(steps)[self.motor];
        let is_closed = self.beyond() >= 0;
        let changes = is_closed != std::mem::replace(&mut self.is_closed, is_closed);
        changes.then_some(is_closed == self.switch.closed)
    }
}

/// A body that a heater warms while its pin is high.
#[derive(Clone)]
pub(crate) struct Body {
    heater: Pin,
    /// The pin of the body's sensor.
    sensor: Pin,
    /// True if the relay of the heater sticks.
    pub(crate) is_stuck: bool,
    /// The speed at which the heater warms the body, K/s.
    pub(crate) warms: f64,
    celsius: f64,
    /// The sensor's voltage at a temperature in °C, as a share of the reference voltage.
    pub(crate) share: fn(f64) -> f64,
    since: u64,
}

impl Body {
    /// A cold body at power-up.
    pub(crate) fn new(heater: Pin, sensor: Pin, warms: f64, share: fn(f64) -> f64) -> Self {
        Body {
            heater,
            sensor,
            is_stuck: false,
            warms,
            celsius: ROOM,
            share,
            since: 0,
        }
    }

    fn follow(&mut self, machine: &mut Machine) {
        let now = machine.cycle();
        let seconds = (now - self.since) as f64 / CPU_HZ as f64;
        self.since = now;
        let warms = if self.is_stuck || machine.level(self.heater) {
            self.warms
        } else {
            0.0
        };
        self.celsius += (warms - LOSES * (self.celsius - ROOM)) * seconds;
        machine.analog(self.sensor, (self.share)(self.celsius));
    }
}
