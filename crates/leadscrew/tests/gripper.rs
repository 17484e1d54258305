//! The M code of `docs/own-m-code.md`.

mod extension;

use crate::bench::{Board, Pin, Timer, World};
use crate::pins::step_dir;
use extension::Gripper;
use leadscrew::{Cartesian, Config, Outputs, Resources};
use std::rc::Rc;

type Held = Gripper<Pin, Pin>;

fn board(
    world: &Rc<World>,
) -> Board<'static, impl leadscrew::Port, impl leadscrew::Actuators, 3, Held> {
    let resources = Box::leak(Box::new(Resources::<3, 3, 16>::new()));
    let gripper = Gripper {
        valve: world.pin("valve"),
        sensor: world.pin("sensor"),
        until: None,
    };
    let config = Config::new().timer_hz(1_000_000);
    let (machine, steps, serial, _) =
        leadscrew::with_extension(resources, config, Cartesian, gripper).unwrap();
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
fn the_page_shows_the_code_that_runs_here() {
    let page = include_str!("../../../docs/own-m-code.md");
    let code = include_str!("gripper/extension.rs").replace("pub(crate) ", "");
    let begin = code.find("struct Gripper").unwrap();
    assert!(page.contains(&code[begin..]));
}

#[test]
fn m10_waits_for_the_sensor_and_m11_for_nothing() {
    let world = World::new();
    let mut board = board(&world);
    board.job("$X\n");
    board.send("G1X1F600\nM10\nG1X2\n");
    board.run_for(800);
    assert_eq!(world.level("valve"), Some(true));
    assert_eq!(world.rises("step x").len(), 250, "it waits");
    world.set("sensor", false);
    board.run_until(2_000, |board| board.heard.matches("ok").count() == 4);
    board.job("M11\n");
    assert_eq!(world.level("valve"), Some(false));
    assert_eq!(world.rises("step x").len(), 500);
}

#[test]
fn m10_gives_up_after_a_second_and_a_broken_valve_at_once() {
    let world = World::new();
    let mut late = board(&world);
    late.job("$X\n");
    late.send("M10\n");
    late.run_for(950);
    assert!(!late.heard.contains("ALARM"), "{}", late.heard);
    late.run_for(100);
    assert!(late
        .heard
        .contains("[MSG:The gripper does not close: look at its air, then $X]"));
    assert!(late.heard.contains("ALARM:3"), "{}", late.heard);
    world.set("sensor", false);
    late.job("$X\nM10\n");
    assert!(late.heard.ends_with("ok\r\n"), "{}", late.heard);

    let world = World::new();
    let mut broken = board(&world);
    broken.job("$X\n");
    world.broken.borrow_mut().insert("valve");
    broken.send("M10\n");
    broken.run_for(10);
    assert!(broken.heard.contains("ALARM:3"), "{}", broken.heard);
}

#[test]
fn a_reset_while_it_waits_leaves_the_next_m10_a_whole_second() {
    let world = World::new();
    let mut board = board(&world);
    board.job("$X\n");
    board.send("M10\n");
    board.run_for(900);
    board.send("\x18");
    board.run_for(10);
    board.job("$X\n");
    board.send("M10\n");
    board.run_for(900);
    assert!(!board.heard.contains("does not close"), "{}", board.heard);
    world.set("sensor", false);
    board.run_for(50);
    assert!(board.heard.ends_with("ok\r\n"), "{}", board.heard);
}
