//! Homing in cases that are easy to get wrong: crossed belts, and a switch that closes while the
//! motor lock changes hands.

use crate::bench::{Contact, Memory, Session};
use leadscrew_machine::board::Switches;
use leadscrew_machine::config::MachineConfig;
use leadscrew_planner::CoreXy;
use leadscrew_stepper::MotorMask;

const SETTINGS: [&str; 11] = [
    "$22=1",
    "$24=300",
    "$25=1200",
    "$26=2",
    "$27=1",
    "$110=1200",
    "$111=1200",
    "$112=1200",
    "$120=200",
    "$121=200",
    "$122=200",
];

/// Steps in a millimetre.
const MM: i32 = 250;

fn config(homing_cycles: [u8; 4]) -> MachineConfig<3> {
    let mut config = MachineConfig::grbl();
    config.homing_cycles = homing_cycles;
    config.options.single_axis_homing = true;
    config
}

/// A machine on crossed belts whose switches are at these places of the axes, steps.
fn belts<'a>(memory: &'a mut Memory, cycles: [u8; 4], switches: [i32; 3]) -> Session<'a, CoreXy> {
    let mut session = Session::boot_with(memory, config(cycles), CoreXy);
    for line in SETTINGS {
        assert_eq!(session.line(line), ["ok"], "{line}");
    }
    session.contact = Some(Contact::Belts(switches));
    session
}

/// The place of the carriage of crossed belts, steps of the axes.
fn carriage(session: &Session<'_, CoreXy>) -> [i32; 3] {
    let [a, b, z] = session.pins.position;
    assert_eq!((a + b) % 2, 0, "between two steps of the axes");
    [(a + b) / 2, (a - b) / 2, z]
}

#[test]
fn axes_on_crossed_belts_home_one_after_the_other_whatever_their_groups() {
    for cycles in [
        [0b100, 0b011, 0, 0],
        [0b111, 0, 0, 0],
        [0b010, 0b001, 0b100, 0],
    ] {
        let mut memory = Memory::new();
        let switches = [3 * MM, 2 * MM, MM];
        let mut session = belts(&mut memory, cycles, switches);
        assert_eq!(session.line("$H"), ["ok"], "{cycles:?}");
        let pulled_off = switches.map(|place| place - MM);
        let at = carriage(&session);
        for axis in 0..3 {
            assert!(
                at[axis].abs_diff(pulled_off[axis]) <= 1,
                "{cycles:?}: {at:?}"
            );
        }
        assert!(session
            .status()
            .starts_with("<Idle|MPos:-1.000,-1.000,-1.000|"));
        // The next move goes where it says.
        assert_eq!(session.line("G0X-2Y-1.5"), ["ok"]);
        let moved = carriage(&session);
        assert_eq!([moved[0] - at[0], moved[1] - at[1]], [-MM, -MM / 2]);
    }
}

#[test]
fn a_switch_on_crossed_belts_stops_both_motors_at_its_step() {
    let mut memory = Memory::new();
    let mut session = belts(&mut memory, [0b001, 0, 0, 0], [3 * MM, 50 * MM, 50 * MM]);
    session.send("$H\n");
    let mut farthest = [i32::MIN; 2];
    while session.lines().is_empty() {
        session.turn();
        let [a, b, _] = session.pins.position;
        farthest = [
            farthest[0].max((a + b) / 2),
            farthest[1].max((a - b).abs() / 2),
        ];
    }
    assert!(farthest[0] <= 3 * MM, "X ran over its switch: {farthest:?}");
    assert_eq!(farthest[1], 0, "Y was dragged along");
}

#[test]
fn one_axis_of_crossed_belts_homes_alone_and_the_other_stays() {
    let mut memory = Memory::new();
    let mut session = belts(
        &mut memory,
        [0b100, 0b011, 0, 0],
        [3 * MM, 50 * MM, 50 * MM],
    );
    assert_eq!(session.line("$X"), ["ok"]);
    assert_eq!(session.line("G0X0.5Y0.2"), ["ok"]);
    assert_eq!(session.line("$HX"), ["ok"]);
    let status = session.status();
    assert!(
        status.starts_with("<Idle|MPos:-1.000,0.200,0.000|"),
        "{status} {:?}",
        session.pins.position
    );
    assert_eq!(carriage(&session)[1], MM / 5);
}

#[test]
fn a_switch_that_closes_at_any_look_before_the_motion_is_not_run_into() {
    let closed = Switches {
        limits: MotorMask::from_bits(0b110),
        ..Switches::OPEN
    };
    let mut looks = 0;
    loop {
        let mut memory = Memory::new();
        let mut session = Session::boot(&mut memory, config([0b001, 0, 0, 0]));
        for line in SETTINGS {
            assert_eq!(session.line(line), ["ok"], "{line}");
        }
        session.send("$H\n");
        session.pins.edge.set(Some((looks, closed)));
        while session.pins.edge.get().is_some() && session.pins.position[0] == 0 {
            session.turn();
        }
        if session.pins.position[0] != 0 {
            break; // that was the last one
        }
        // The switch is still closed when homing has pulled off from it: ALARM:8. No step is made
        // towards it.
        let mut seen = Vec::new();
        while seen.is_empty() {
            session.turn();
            seen = session.lines();
            assert!(session.pins.position[0] <= 0, "ran on after look {looks}");
        }
        assert_eq!(seen[0], "ALARM:8", "after look {looks}");
        looks += 1;
    }
    assert!(looks >= 3, "{looks}");
}
