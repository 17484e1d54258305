//! Steps on pins.

use crate::bench::{Board, Edge, Pin, Timer, World};
use leadscrew::{
    Cartesian, Config, Outputs, Resources, SmallResources, StepDir, StepPins, Steps, SwitchPins,
    Switches,
};
use std::rc::Rc;

fn config() -> Config<3> {
    Config::new().timer_hz(1_000_000)
}

pub(crate) fn step_dir(world: &Rc<World>) -> StepDir<Pin, Pin, 3> {
    let pin = |name| world.pin(name);
    StepDir::new([
        (pin("step x"), pin("direction x")),
        (pin("step y"), pin("direction y")),
        (pin("step z"), pin("direction z")),
    ])
}

/// A board of three motors, with drivers that are enabled by a low level.
pub(crate) fn board(
    world: &Rc<World>,
) -> Board<'static, impl leadscrew::Port, impl leadscrew::Actuators, 3> {
    let resources = Box::leak(Box::new(Resources::<3, 3, 64>::new()));
    let (machine, steps, serial, _) = leadscrew::new(resources, config(), Cartesian).unwrap();
    let start = world.clone();
    Board {
        world: world.clone(),
        machine,
        steps: steps.on(step_dir(world), Timer(world.clone())),
        serial,
        outputs: Outputs::new(move || start.pend(), world.pin("enable")),
        heard: String::new(),
    }
}

#[test]
fn a_job_makes_its_steps_and_each_pulse_has_its_width() {
    let world = World::new();
    let mut board = board(&world);
    board.job("$X\nG1X1F300\nG1Y-0.5\nG0X0Y0\n");
    assert_eq!(world.rises("step x").len(), 500);
    assert_eq!(world.rises("step y").len(), 250);
    assert_eq!(world.rises("step z").len(), 0);
    assert_eq!(board.machine.position().map(|place| place.nanos()), [0; 3]);
    for name in ["step x", "step y"] {
        let edges: Vec<Edge> = of(&world, name);
        for pulse in edges.chunks(2) {
            let [up, down] = pulse else {
                panic!("a pulse that does not end")
            };
            let width = down.at - up.at;
            assert!(
                up.high && !down.high && (10..=12).contains(&width),
                "{width}"
            );
        }
    }
    assert_eq!(board.machine.late_ticks(), 0);
    assert_eq!(world.level("enable"), Some(false), "the drivers are on");
}

/// The edges of a pin, without the one that gives it its first level.
fn of(world: &World, pin: &str) -> Vec<Edge> {
    let edges = world.edges.borrow();
    let own = edges.iter().filter(|edge| edge.pin == pin);
    own.skip(1).copied().collect()
}

#[test]
fn a_direction_changes_only_while_no_pulse_is_high_and_before_the_step() {
    let world = World::new();
    let mut board = board(&world);
    board.job("$X\nG1X0.4F600\nG1X-0.4\nG1X0Y0.2\nG1X0.1Y-0.3\n");
    for (step, direction) in [("step x", "direction x"), ("step y", "direction y")] {
        let mut high = false;
        let (mut positive, mut place, mut turned) = (true, 0i32, 0);
        for edge in world.edges.borrow().iter() {
            if edge.pin == step {
                high = edge.high;
                if high {
                    assert!(edge.at > turned, "a step with its direction");
                    place += if positive { 1 } else { -1 };
                }
            } else if edge.pin == direction {
                assert!(!high, "a direction within a pulse");
                turned = edge.at;
                positive = !edge.high;
            }
        }
        let wanted = if step == "step x" { 25 } else { -75 };
        assert_eq!(place, wanted, "{step}");
    }
}

#[test]
fn settings_turn_the_levels_of_pins_around() {
    let world = World::new();
    let mut board = board(&world);
    board.job("$X\n$2=1\n$3=2\n$4=1\n");
    assert_eq!(world.level("step x"), Some(true), "a pulse is low");
    assert_eq!(world.level("direction y"), Some(true));
    board.job("G1X1F600\n");
    assert_eq!(world.level("enable"), Some(true), "a high level enables");
    let pulses: Vec<Edge> = of(&world, "step x")
        .into_iter()
        .filter(|edge| !edge.high)
        .collect();
    assert_eq!(pulses.len(), 250);
}

#[test]
fn a_step_pin_that_fails_stops_the_machine_which_says_so_and_stays_locked() {
    for pin in ["step x", "direction x"] {
        let world = World::new();
        let mut board = board(&world);
        board.job("$X\nG1X1F600\n");
        world.broken.borrow_mut().insert(pin);
        board.send("G1X-5F600\n");
        board.run_for(100);
        assert!(board.heard.contains("ALARM:3"), "{}", board.heard);
        assert!(board
            .heard
            .contains("[MSG:A step or direction pin failed: mend it, then power off and on]"));
        assert_eq!(board.machine.fault(), Some(leadscrew::Fault::StepPin));
        board.job("$X\n");
        assert!(board.heard.ends_with("error:9\r\n"), "{}", board.heard);
        assert!(world.rises("step y").is_empty());
    }
}

#[test]
fn a_missing_step_interrupt_and_late_steps_are_told_in_words() {
    let world = World::new();
    let mut late = board(&world);
    late.job("$X\n");
    world.masked.set(true);
    late.send("G1X1F600\n");
    late.run_for(300);
    assert!(late
        .heard
        .contains("[MSG:The step interrupt does not come: nothing moves]"));

    let world = World::new();
    let mut late = board(&world);
    world.latency.set(400);
    late.job("$X\n$120=1000\n$110=6000\nG1X10F6000\n");
    assert!(late.machine.late_ticks() >= 16);
    let told = "[MSG:Steps come late: give them the highest priority, or a lower rate]";
    assert_eq!(late.heard.matches(told).count(), 1, "{}", late.heard);
    assert_eq!(world.rises("step x").len(), 2500);
}

#[test]
fn motion_that_runs_dry_says_how_late_a_poll_came() {
    for (ms, text) in [
        (3, "a poll came up to 3 ms late"),
        (40, "a poll came over 10 ms late"),
    ] {
        let world = World::new();
        let mut board = board(&world);
        board.job("$X\n");
        board.send("G1X5F600\n");
        board.run_for(100);
        assert!(board.machine.lateness().ticks() < 450);
        let end = world.now.get() + ms * 1000;
        while let Some(at) = world.next_ring().filter(|at| *at <= end) {
            world.now.set(at);
            board.steps.tick();
        }
        world.now.set(end);
        board.run_for(50);
        assert!(board.heard.contains("ALARM:3"), "{}", board.heard);
        let told = format!("[MSG:Motion ran dry: {text}]");
        assert_eq!(board.heard.matches(&told).count(), 1, "{}", board.heard);
        let late = board.machine.lateness().ticks();
        assert!((ms * 1000 - 1100..=ms * 1000).contains(&late), "{late}");
    }
}

#[test]
fn small_memory_is_one_value_and_a_clock_that_goes_back_does_no_harm() {
    type Small = SmallResources<3, 3, 16>;
    assert!(size_of::<Small>() < 8 * 1024, "{}", size_of::<Small>());
    let world = World::new();
    let resources = Box::leak(Box::new(Small::new()));
    let parts = leadscrew::new(resources, config(), Cartesian).unwrap();
    let (machine, steps, serial, _): (_, Steps<'_, 3>, _, Switches<'_, 3>) = parts;
    let start = world.clone();
    let mut board = Board {
        world: world.clone(),
        machine,
        steps: steps.on(step_dir(&world), Timer(world.clone())),
        serial,
        outputs: Outputs::new(move || start.pend(), world.pin("enable")),
        heard: String::new(),
    };
    board.job("$X\nG1X1F300\n");
    let back = leadscrew::Instant::from_ticks(5);
    board.machine.poll(&mut board.outputs, back);
    board.job("G1X2\n");
    assert_eq!(world.rises("step x").len(), 500);
}

/// Pins that a port sets together.
struct Wide(Rc<World>);

impl StepPins for Wide {
    type Error = core::convert::Infallible;
    fn set_steps(
        &mut self,
        of: leadscrew::MotorMask,
        levels: leadscrew::MotorMask,
    ) -> Result<(), Self::Error> {
        if of != leadscrew::MotorMask::ALL && of.bits() == levels.bits() {
            let at = self.0.now.get();
            let pin = "port";
            self.0.edges.borrow_mut().push(Edge {
                at,
                pin,
                high: true,
            });
        }
        Ok(())
    }
    fn set_directions(&mut self, _: leadscrew::MotorMask) -> Result<(), Self::Error> {
        Ok(())
    }
}

#[test]
fn a_port_of_ones_own_raises_all_pins_at_once() {
    let world = World::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let (machine, steps, serial, switches) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let _watch = switches.on(SwitchPins::<Pin, 3>::new([None, None, None]));
    let start = world.clone();
    let mut board = Board {
        world: world.clone(),
        machine,
        steps: steps.on(Wide(world.clone()), Timer(world.clone())),
        serial,
        outputs: Outputs::<_, leadscrew::NoPin>::without_enable(move || start.pend()),
        heard: String::new(),
    };
    board.job("$X\nG1X1Y1Z1F300\n");
    assert_eq!(world.rises("port").len(), 250, "three motors step together");
}
