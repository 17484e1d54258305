//! Spindle, laser, coolant, switches.

use crate::bench::{Board, Duty, Timer, World};
use crate::pins::step_dir;
use leadscrew::{Cartesian, Config, Fault, Instant, OutputError, Outputs, Resources, SwitchPins};
use std::rc::Rc;

fn config() -> Config<3> {
    Config::new().timer_hz(1_000_000)
}

fn spindle(
    world: &Rc<World>,
) -> Board<'static, impl leadscrew::Port, impl leadscrew::Actuators, 3> {
    let resources = Box::leak(Box::new(Resources::<3, 3, 64>::new()));
    let (machine, steps, serial, _) = leadscrew::new(resources, config(), Cartesian).unwrap();
    let start = world.clone();
    let outputs = Outputs::new(move || start.pend(), world.pin("enable"))
        .with_spindle(Duty(world.clone()))
        .with_spindle_enable(world.pin("spindle"))
        .with_spindle_direction(world.pin("back"))
        .with_flood(world.pin("flood"))
        .with_mist(world.pin("mist"));
    Board {
        world: world.clone(),
        machine,
        steps: steps.on(step_dir(world), Timer(world.clone())),
        serial,
        outputs,
        heard: String::new(),
    }
}

#[test]
fn a_spindle_turns_as_the_program_says_at_rest_and_in_motion() {
    let world = World::new();
    let mut board = spindle(&world);
    board.job("$X\nM3S500\n");
    let last = || world.duties.borrow().last().map(|(_, duty)| *duty);
    assert_eq!((last(), world.level("spindle")), (Some(500), Some(true)));
    assert_eq!(world.level("back"), Some(false));
    board.job("G1X1F600S250\nX2\n");
    assert_eq!(last(), Some(250));
    board.job("M4S1000\nM8\n");
    assert_eq!((last(), world.level("back")), (Some(1000), Some(true)));
    assert_eq!(world.level("flood"), Some(true));
    board.job("M5\nM9\n");
    assert_eq!((last(), world.level("spindle")), (Some(0), Some(false)));
    assert_eq!(world.level("flood"), Some(false));
}

#[test]
fn each_output_that_fails_locks_the_machine() {
    for (pin, line) in [
        ("enable", "G1X1F600\n"),
        ("spindle", "M3S100\n"),
        ("back", "M4S100\n"),
        ("pwm", "M3S100\n"),
        ("flood", "M8\n"),
    ] {
        let world = World::new();
        let mut board = spindle(&world);
        board.job("$X\n");
        world.broken.borrow_mut().insert(pin);
        board.send(line);
        board.run_for(300);
        assert_eq!(board.machine.fault(), Some(Fault::Output), "{pin}");
        assert!(
            board
                .heard
                .contains("[MSG:A driver, spindle or coolant pin failed"),
            "{pin}"
        );
        let steps = world.rises("step x").len();
        board.job("$X\nG1X2F600\n");
        assert!(
            board.heard.ends_with("error:9\r\nerror:9\r\n"),
            "{pin}: {}",
            board.heard
        );
        assert_eq!(world.rises("step x").len(), steps, "{pin}");
    }
}

fn laser(world: &Rc<World>) -> Board<'static, impl leadscrew::Port, impl leadscrew::Actuators, 3> {
    let resources = Box::leak(Box::new(Resources::<3, 3, 64, 64>::new()));
    let (machine, steps, serial, _) = leadscrew::new(resources, config(), Cartesian).unwrap();
    let start = world.clone();
    Board {
        world: world.clone(),
        machine,
        steps: steps.on_laser(step_dir(world), Timer(world.clone()), Duty(world.clone())),
        serial,
        outputs: Outputs::new(move || start.pend(), world.pin("enable")),
        heard: String::new(),
    }
}

#[test]
fn a_laser_changes_its_power_with_the_step_and_is_dark_at_rest() {
    let world = World::new();
    let mut board = laser(&world);
    board.job("$X\n$32=1\n$120=1000\nM3S0\nG1X1F600S400\nX2S800\nX3S0\n");
    let steps = world.rises("step x");
    let duties = world.duties.borrow();
    // The power of the second line begins with the last step of the first one.
    let (at, _) = duties
        .iter()
        .find(|(_, duty)| *duty == 800)
        .copied()
        .unwrap();
    assert_eq!(at, steps[249]);
    let dark = duties
        .iter()
        .rev()
        .find(|(_, duty)| *duty != 0)
        .map(|(at, _)| *at);
    assert!(dark.is_some_and(|at| at <= steps[499]), "{dark:?}");
    assert_eq!(duties.last().map(|(_, duty)| *duty), Some(0));
}

#[test]
fn an_output_that_cannot_be_set_says_which() {
    let errors: [OutputError<&str, &str>; 2] = [OutputError::Pin("stuck"), OutputError::Pwm("off")];
    assert_eq!(
        errors.map(|error| error.to_string()),
        [
            "an output pin cannot be set: \"stuck\"",
            "the spindle's PWM cannot be set: \"off\"",
        ]
    );
}

#[test]
fn a_laser_that_cannot_be_set_stops_the_machine() {
    let world = World::new();
    let mut board = laser(&world);
    board.job("$X\n$32=1\n");
    world.broken.borrow_mut().insert("pwm");
    board.send("M3S400\nG1X5F600\n");
    board.run_for(500);
    assert_eq!(board.machine.fault(), Some(Fault::Laser));
    assert!(
        board.heard.contains("[MSG:The laser's PWM failed"),
        "{}",
        board.heard
    );
    assert!(world.rises("step x").len() < 1250);
}

#[test]
fn a_limit_switch_stops_the_motors_within_the_call_and_a_bounce_does_not() {
    let world = World::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 64>::new()));
    let (machine, steps, serial, switches) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let pins = SwitchPins::new([Some(world.pin("limit x")), None, None])
        .with_probe(world.pin("probe"))
        .with_reset(world.pin("reset"))
        .with_hold(world.pin("hold"))
        .with_start(world.pin("start"))
        .with_door(world.pin("door"));
    let mut watch = switches.on(pins);
    let start = world.clone();
    let mut board = Board {
        world: world.clone(),
        machine,
        steps: steps.on(step_dir(&world), Timer(world.clone())),
        serial,
        outputs: Outputs::new(move || start.pend(), world.pin("enable")),
        heard: String::new(),
    };
    board.job("$X\n$21=1\n$706=1000\n$120=500\n");
    board.send("G1X20F600\n");
    board.run_for(500);

    let now = || Instant::from_ticks(world.now.get());
    world.set("limit x", false);
    let ripe = watch.look(now()).unwrap();
    assert_eq!(ripe.ticks(), world.now.get() + 1000);
    world.set("limit x", true);
    assert_eq!(watch.look(now()), None, "a bounce");
    board.run_for(10);
    assert!(!board.heard.contains("ALARM"), "{}", board.heard);

    world.set("limit x", false);
    watch.look(now());
    board.run_for(1);
    assert_eq!(watch.look(now()), None);
    let made = world.rises("step x").len();
    board.run_for(50);
    assert!(board.heard.contains("ALARM:1"), "{}", board.heard);
    assert_eq!(world.rises("step x").len(), made, "no step after the call");

    world.broken.borrow_mut().insert("probe");
    watch.look(now());
    board.run_for(5);
    assert_eq!(board.machine.fault(), Some(Fault::Switch));
    assert!(
        board.heard.contains("[MSG:A switch cannot be read"),
        "{}",
        board.heard
    );
}

#[test]
fn the_hold_button_holds_and_the_start_button_goes_on() {
    let world = World::new();
    let resources = Box::leak(Box::new(Resources::<3, 3, 64>::new()));
    let (machine, steps, serial, switches) =
        leadscrew::new(resources, config(), Cartesian).unwrap();
    let pins = SwitchPins::new([None, None, None])
        .with_hold(world.pin("hold"))
        .with_start(world.pin("start"));
    let mut watch = switches.on(pins);
    let start = world.clone();
    let mut board = Board {
        world: world.clone(),
        machine,
        steps: steps.on(step_dir(&world), Timer(world.clone())),
        serial,
        outputs: Outputs::new(move || start.pend(), world.pin("enable")),
        heard: String::new(),
    };
    board.job("$X\n");
    board.send("G1X2F300\n");
    board.run_for(100);
    for (pin, state) in [("hold", "<Hold:0"), ("start", "<Run")] {
        for high in [false, true] {
            world.set(pin, high);
            while watch.look(Instant::from_ticks(world.now.get())).is_some() {
                board.run_for(1);
            }
            board.run_for(400);
        }
        board.send("?");
        board.run_for(2);
        assert!(board.heard.contains(state), "{}", board.heard);
    }
    board.run_until(60_000, |board| board.machine.is_quiet());
    assert_eq!(world.rises("step x").len(), 500);
}
