//! The facade's pins against the simulator's steps: the same program, the same timer, other pins.
//!
//! The reference is the simulator, which has a step port, a board and a main loop of its own.

use leadscrew::embedded_hal::digital::{ErrorType, OutputPin};
use leadscrew::{
    Alarm, Cartesian, Config, Instant, MachineConfig, NoPin, Outputs, Resources, StepDir,
};
use leadscrew_sim::clock::{CYCLES_PER_COUNT, TIMER_HZ};
use leadscrew_tests::{programs, run_program};
use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::fs;
use std::rc::Rc;

/// Timer counts in a microsecond.
const MICRO: u64 = TIMER_HZ as u64 / 1_000_000;

/// A rest, timer counts: the main loop ends it, and each has a main loop of its own.
const REST: u64 = 100_000 * MICRO;

/// A step: when, which motor, and whether it goes in the negative direction.
type Step = (u64, usize, bool);

#[derive(Default)]
struct World {
    /// Timer counts since power-up.
    now: Cell<u64>,
    ring: Cell<Option<u64>>,
    negative: [Cell<bool>; 3],
    steps: RefCell<Vec<Step>>,
}

/// The step pin of a motor, or its direction pin.
enum Pin {
    Step(Rc<World>, usize, bool),
    Direction(Rc<World>, usize),
}

impl ErrorType for Pin {
    type Error = Infallible;
}
impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.put(false)
    }
    fn set_high(&mut self) -> Result<(), Infallible> {
        self.put(true)
    }
}
impl Pin {
    fn put(&mut self, high: bool) -> Result<(), Infallible> {
        match self {
            Self::Direction(world, motor) => world.negative[*motor].set(high),
            Self::Step(world, motor, before) => {
                if high && !*before {
                    let negative = world.negative[*motor].get();
                    let step = (world.now.get(), *motor, negative);
                    world.steps.borrow_mut().push(step);
                }
                *before = high;
            }
        }
        Ok(())
    }
}

struct Timer(Rc<World>);

impl Alarm for Timer {
    fn count(&self) -> u32 {
        self.0.now.get() as u32
    }
    fn ring_at(&mut self, at: u32) {
        let left = at.wrapping_sub(self.count()).cast_signed().max(0);
        let left = u64::from(left.cast_unsigned());
        self.0.ring.set(Some(self.0.now.get() + left));
    }
    fn silence(&mut self) {
        self.0.ring.set(None);
    }
}

/// The steps of a program on the facade's pins.
fn facade(text: &str) -> Vec<Step> {
    let world = Rc::new(World::default());
    let resources = Box::leak(Box::new(Resources::<3, 3, 1024, 4608>::new()));
    let config = Config::of(MachineConfig::new());
    let (mut machine, steps, mut serial, _) = leadscrew::new(resources, config, Cartesian).unwrap();
    let motor = |motor| {
        let step = Pin::Step(world.clone(), motor, false);
        (step, Pin::Direction(world.clone(), motor))
    };
    let pins = StepDir::new([motor(0), motor(1), motor(2)]);
    let mut steps = steps.on(pins, Timer(world.clone()));
    let start = world.clone();
    let mut outputs =
        Outputs::<_, NoPin>::without_enable(move || start.ring.set(Some(start.now.get())));
    let mut bytes = text.bytes().peekable();
    let (mut lines, mut answers) = (text.lines().count(), Vec::new());
    while lines > 0 || !machine.is_quiet() {
        for byte in bytes.by_ref().take(8) {
            serial.receive(byte);
        }
        let now = world.now.get();
        machine.poll(&mut outputs, Instant::from_ticks(now / MICRO));
        answers.extend(core::iter::from_fn(|| serial.next_to_send()));
        while answers.ends_with(b"\n") {
            let line = String::from_utf8(std::mem::take(&mut answers)).unwrap();
            assert!(!line.contains("error"), "{line}");
            lines -= line.matches("ok\r\n").count();
        }
        let turn = now + 20 * MICRO;
        while let Some(at) = world.ring.get().filter(|at| *at <= turn) {
            world.now.set(at.max(world.now.get()));
            world.ring.set(None);
            steps.tick();
        }
        world.now.set(turn);
    }
    assert_eq!(machine.late_ticks(), 0);
    world.steps.take()
}

/// The steps of a program in the simulator.
fn simulator(settings: &str, program: &str) -> Vec<Step> {
    let mut steps = Vec::new();
    for event in run_program(settings, program).steps {
        let at = event.cycle.0 / CYCLES_PER_COUNT;
        for motor in (0..3).filter(|motor| event.motors.contains(*motor)) {
            steps.push((at, motor, event.negative.contains(motor)));
        }
    }
    steps
}

#[test]
fn the_facades_pins_step_as_the_simulator_does_to_the_count() {
    let programs = programs("golden");
    assert!(!programs.is_empty());
    for path in programs {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.display();
        let (settings, program): (Vec<&str>, Vec<&str>) =
            text.lines().partition(|line| line.starts_with('$'));
        let expected = simulator(&settings.join("\n"), &program.join("\n"));
        let seen = facade(&(settings.join("\n") + "\n" + &program.join("\n") + "\n"));
        assert_eq!(seen.len(), expected.len(), "{name}");
        assert!(!seen.is_empty(), "{name}");
        for (seen, expected) in seen.windows(2).zip(expected.windows(2)) {
            let [a, b] = [seen[1], expected[1]];
            assert_eq!((a.1, a.2), (b.1, b.2), "{name}");
            let [a, b] = [seen, expected].map(|pair| pair[1].0 - pair[0].0);
            let is_rest = a > REST && b > REST;
            assert!(is_rest || a.abs_diff(b) <= 1, "{name}: {a} and {b} counts");
        }
    }
}
