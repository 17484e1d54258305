//! A board without hardware: pins that note their edges, a timer on a virtual clock.

use embedded_hal::digital::{Error, ErrorKind, ErrorType, InputPin, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use leadscrew::extension::Extension;
use leadscrew::{Actuators, Alarm, Instant, Machine, Port, Serial, Stepping};
use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// A change of a pin's level, at a count of microseconds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Edge {
    pub(crate) at: u64,
    pub(crate) pin: &'static str,
    pub(crate) high: bool,
}

/// The world that pins, timer and test share.
#[derive(Default)]
pub(crate) struct World {
    /// Microseconds since power-up.
    pub(crate) now: Cell<u64>,
    /// The time at which the step interrupt comes.
    ring: Cell<Option<u64>>,
    pub(crate) edges: RefCell<Vec<Edge>>,
    levels: RefCell<BTreeMap<&'static str, bool>>,
    /// Pins that fail from now on.
    pub(crate) broken: RefCell<BTreeSet<&'static str>>,
    /// Duty cycles that were set, with their times.
    pub(crate) duties: RefCell<Vec<(u64, u16)>>,
    /// Microseconds that each step interrupt comes late.
    pub(crate) latency: Cell<u64>,
    /// The step interrupt is masked.
    pub(crate) masked: Cell<bool>,
}

impl World {
    pub(crate) fn new() -> Rc<Self> {
        Rc::default()
    }
    pub(crate) fn pin(self: &Rc<Self>, name: &'static str) -> Pin {
        Pin(self.clone(), name)
    }
    pub(crate) fn level(&self, name: &str) -> Option<bool> {
        self.levels.borrow().get(name).copied()
    }
    pub(crate) fn pend(&self) {
        self.ring.set(Some(self.now.get()));
    }
    pub(crate) fn next_ring(&self) -> Option<u64> {
        self.ring.get()
    }
    /// Closes or opens a switch.
    pub(crate) fn set(&self, name: &'static str, high: bool) {
        self.levels.borrow_mut().insert(name, high);
    }
    pub(crate) fn rises(&self, pin: &str) -> Vec<u64> {
        let edges = self.edges.borrow();
        let rises = edges.iter().filter(|edge| edge.pin == pin && edge.high);
        rises.map(|edge| edge.at).collect()
    }
    fn check(&self, name: &'static str) -> Result<(), Broken> {
        match self.broken.borrow().contains(name) {
            true => Err(Broken),
            false => Ok(()),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Broken;

impl Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}
impl pwm::Error for Broken {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

/// A pin that notes its edges; as an input it is high until it is set.
pub(crate) struct Pin(Rc<World>, &'static str);

impl ErrorType for Pin {
    type Error = Broken;
}
impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.put(false)
    }
    fn set_high(&mut self) -> Result<(), Broken> {
        self.put(true)
    }
}
impl Pin {
    fn put(&mut self, high: bool) -> Result<(), Broken> {
        self.0.check(self.1)?;
        let before = self.0.levels.borrow_mut().insert(self.1, high);
        if before != Some(high) {
            let at = self.0.now.get();
            let pin = self.1;
            self.0.edges.borrow_mut().push(Edge { at, pin, high });
        }
        Ok(())
    }
}
impl InputPin for Pin {
    fn is_high(&mut self) -> Result<bool, Broken> {
        self.0.check(self.1)?;
        Ok(self.0.level(self.1).unwrap_or(true))
    }
    fn is_low(&mut self) -> Result<bool, Broken> {
        self.is_high().map(|high| !high)
    }
}

/// A PWM of 1000 counts.
pub(crate) struct Duty(pub(crate) Rc<World>);

impl pwm::ErrorType for Duty {
    type Error = Broken;
}
impl SetDutyCycle for Duty {
    fn max_duty_cycle(&self) -> u16 {
        1000
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Broken> {
        self.0.check("pwm")?;
        let at = self.0.now.get();
        self.0.duties.borrow_mut().push((at, duty));
        Ok(())
    }
}

/// The timer, whose count is about to wrap around when the world begins.
pub(crate) struct Timer(pub(crate) Rc<World>);

/// The count at power-up.
const FIRST: u32 = u32::MAX - 5_000;

impl Alarm for Timer {
    fn count(&self) -> u32 {
        FIRST.wrapping_add(self.0.now.get() as u32)
    }
    fn ring_at(&mut self, at: u32) {
        let left = i64::from(at.wrapping_sub(self.count()).cast_signed()).max(0);
        let at = self.0.now.get() + left.cast_unsigned() + self.0.latency.get();
        self.0.ring.set(Some(at));
    }
    fn silence(&mut self) {
        self.0.ring.set(None);
    }
}

/// The board: a machine, its step interrupt, its serial line.
pub(crate) struct Board<'a, P, O, const MOTORS: usize, X = ()> {
    pub(crate) world: Rc<World>,
    pub(crate) machine: Machine<'a, leadscrew::Cartesian, 3, MOTORS, X>,
    pub(crate) steps: Stepping<'a, P, MOTORS>,
    pub(crate) serial: Serial<'a>,
    pub(crate) outputs: O,
    pub(crate) heard: String,
}

impl<P: Port, O: Actuators, X: Extension<3>, const MOTORS: usize> Board<'_, P, O, MOTORS, X>
where
    leadscrew::Cartesian: leadscrew::Kinematics<3, MOTORS>,
{
    pub(crate) fn send(&mut self, text: &str) {
        for byte in text.bytes() {
            self.serial.receive(byte);
        }
    }

    /// Runs until `end` says so; at most for this many virtual milliseconds.
    pub(crate) fn run_until(&mut self, ms: u64, end: impl Fn(&Self) -> bool) {
        let last = self.world.now.get() + ms * 1000;
        while !end(self) {
            let now = self.world.now.get();
            assert!(now < last, "still running; heard: {}", self.heard);
            let next = self
                .machine
                .poll(&mut self.outputs, Instant::from_ticks(now));
            while let Some(byte) = self.serial.next_to_send() {
                self.heard.push(char::from(byte));
            }
            let wake = match next.busy || self.machine.is_woken() {
                true => now + 1,
                false => next.when.map_or(now + 1000, |when| when.ticks()),
            };
            self.pass_until(wake.clamp(now + 1, now + 1000));
        }
    }

    /// Lets the step interrupt come until this instant.
    fn pass_until(&mut self, instant: u64) {
        let is_due = |at: &u64| *at <= instant;
        while let Some(at) = self.world.ring.get().filter(is_due) {
            if self.world.masked.get() {
                break;
            }
            self.world.now.set(at.max(self.world.now.get()));
            self.world.ring.set(None);
            if self.steps.tick() {
                return; // the main loop is woken
            }
        }
        self.world.now.set(instant.max(self.world.now.get()));
    }

    /// Sends lines, and runs until each has its answer and the machine is quiet.
    pub(crate) fn job(&mut self, text: &str) {
        let answers = |heard: &str| {
            let lines = heard.lines();
            lines
                .filter(|line| *line == "ok" || line.starts_with("error:"))
                .count()
        };
        for line in text.lines() {
            let wanted = answers(&self.heard) + 1;
            self.send(line);
            self.send("\n");
            self.run_until(600_000, |board| answers(&board.heard) >= wanted);
        }
        self.run_until(600_000, |board| board.machine.is_quiet());
        self.run_for(1);
    }

    pub(crate) fn run_for(&mut self, ms: u64) {
        let end = self.world.now.get() + ms * 1000;
        self.run_until(ms + 1, |board| board.world.now.get() >= end);
    }
}
