//! The smallest memory that a machine can be lent: the same answers and the same motion.

use crate::bench::{Memory, Session};
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::Cartesian;

type Small = Memory<129, 512, 4, 3, 1>;

const LINES: [&str; 12] = [
    "$$",
    "$#",
    "$I",
    "$G",
    "$N",
    "$32=1",
    "$703=1000",
    "M4S500",
    "G1X3Y1F2000",
    "X3.1S1000",
    "X1S0",
    "G2X3Y3R5S700",
];

/// The answers of a machine, the positions of its motors, and the number of their pulses.
fn told<
    const RX: usize,
    const TX: usize,
    const RT: usize,
    const SLOTS: usize,
    const LEAD: usize,
>() -> (Vec<String>, [i32; 3], [u32; 3]) {
    let mut memory = Memory::<RX, TX, RT, SLOTS, LEAD>::default();
    let config = MachineConfig {
        receive_size: 128,
        ..MachineConfig::new()
    };
    let mut session = Session::extended(&mut memory, config, Cartesian, ());
    let answers = LINES.iter().flat_map(|line| session.line(line)).collect();
    (answers, session.pins.position, session.pins.pulses)
}

#[test]
fn the_smallest_memory_gives_the_same_answers_and_motion() {
    let usual = told::<129, 1024, 64, 17, 16>();
    assert_eq!(told::<129, 512, 4, 3, 1>(), usual);
    assert_eq!(
        usual.0.iter().filter(|line| *line == "ok").count(),
        LINES.len()
    );
}

#[test]
fn a_hold_and_a_reset_come_through_behind_a_burst() {
    let mut memory = Small::default();
    let mut session = Session::extended(&mut memory, MachineConfig::new(), Cartesian, ());
    session.send("G1X10F500\n");
    session.wait_ms(500);
    session.send([0x91; 40]);
    session.send("!");
    session.wait_ms(1500);
    let report = session.status();
    assert!(report.starts_with("<Hold:0|"), "{report}");
    session.send([0x91; 40]);
    session.send("\x18");
    session.wait_ms(10);
    let lines = session.lines();
    assert!(
        lines.iter().any(|line| line.starts_with("Grbl 1.1h")),
        "{lines:?}"
    );
}
