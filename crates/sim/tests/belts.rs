//! X and Y on crossed belts, as a profile describes them: the switches belong to the axes, not to
//! the motors.

use leadscrew_machine::state::State;
use leadscrew_planner::CoreXy;
use leadscrew_sim::profile::Profile;
use leadscrew_sim::Fixtures;
use leadscrew_sim::{
    Answers, Cycle, Memory, Rate, Setup, Simulation, Stopped, Streamer, Streaming,
};
use std::path::Path;

const STEPS_PER_MM: i32 = 100;

const PROFILE: &str = r#"
kinematics = "corexy"
[homing]
order = ["xy"]
[settings]
"$22" = 1
"$23" = 3
"$24" = 100
"$25" = 2000
"$26" = 10
"$27" = 2
"$110" = 4000
"$111" = 4000
"$120" = 300
"$121" = 300
[axes.x]
steps_per_mm = 100
travel = 80
start = 7.5
limits = { low = 0 }
[axes.y]
steps_per_mm = 100
travel = 60
start = 3
limits = { low = -1 }
"#;

/// Streams lines to the machine of [`PROFILE`]. Returns where its carriage is then, steps of X and
/// Y.
fn carriage_after(lines: &str) -> [i32; 2] {
    let profile = Profile::parse(Path::new("test.toml"), PROFILE).unwrap();
    let setup = Setup::<3>::new(profile.config(), Rate::NeverWaits);
    let mut memory = Memory::<3, 3>::new(&setup);
    let mut sim = Simulation::<_, _, 3, 3, 1024>::new(&mut memory, &setup, CoreXy, ());
    sim.cross_belts();
    sim.place(profile.start());
    for switch in profile.plant_switches() {
        sim.add_switch(switch);
    }
    let streaming = Streaming {
        window: 128,
        keep_going: false,
    };
    let mut host = Streamer::new(lines.as_bytes(), streaming, Answers::default());
    let stopped = sim.run_until(&mut host, Cycle::from_micros(600_000_000));
    assert_eq!(stopped, Stopped::Quiet);
    let answers = host.finish().unwrap();
    assert!(answers.errors.is_empty(), "{answers:?}");
    assert_eq!(answers.alarm, None);
    assert_eq!(sim.machine().state(), State::Idle);
    let [a, b, _] = sim.board().plant.position();
    let (outcome, ()) = sim.finish();
    assert!(outcome.violations.is_empty(), "{:?}", outcome.violations);
    assert_eq!((a + b) % 2, 0, "between two steps of the axes");
    [(a + b) / 2, (a - b) / 2]
}

#[test]
fn a_profile_s_crossed_belts_home_against_the_switches_of_their_axes() {
    // The carriage stands a pull-off away from the switches. Machine position 0 is the travel away
    // from them.
    assert_eq!(carriage_after("$H\n"), [2 * STEPS_PER_MM, STEPS_PER_MM]);
    let moved = carriage_after("$H\nG90G0X-20Y-30\nG1X-21F500\n");
    assert_eq!(moved, [59 * STEPS_PER_MM, 29 * STEPS_PER_MM]);
}
