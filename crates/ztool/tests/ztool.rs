//! Tests of a tool between two switches, from the sender's view and at its pins.

#[path = "../../machine/tests/bench/mod.rs"]
mod bench;

use bench::{Memory, Session};
use leadscrew_gcode::Number;
use leadscrew_heat::{Heat, HeatConfig, HeatPort, HeaterConfig, Limits, Sensor};
use leadscrew_machine::board::SpindleOutput;
use leadscrew_machine::config::MachineConfig;
use leadscrew_machine::extension::Extension;
use leadscrew_planner::Cartesian;
use leadscrew_ztool::{End, ToolPort, ZTool, ZToolConfig};
use std::cell::Cell;
use std::rc::Rc;

/// The lower switch closes 4 mm below the place at power-up, the upper one 2 mm above it, with 250
/// steps/mm.
const LOWER: i32 = -1000;
const UPPER: i32 = 500;

/// The steps in which Z slows down from 300 mm/min at 10 mm/s²: 1.25 mm.
const SLOWS_DOWN: i32 = 313;

/// The Z that the test has seen last, and whether the lower switch is broken.
#[derive(Clone, Default)]
struct Pins {
    z: Rc<Cell<i32>>,
    is_broken: Rc<Cell<bool>>,
}

impl ToolPort for Pins {
    fn is_closed(&self, end: End) -> bool {
        match end {
            End::Lower => self.z.get() <= LOWER && !self.is_broken.get(),
            End::Upper => self.z.get() >= UPPER,
        }
    }
}

fn tool(pins: &Pins) -> ZTool<Pins, 3> {
    let config = ZToolConfig {
        rate: Number::from_int(300),
        most_mm: 15.0,
    };
    ZTool::new(config, pins.clone())
}

fn boot<X: Extension<3>>(memory: &mut Memory, extension: X) -> Session<'_, Cartesian, X> {
    Session::extended(memory, MachineConfig::grbl(), Cartesian, extension)
}

/// Sends a program and moves the switches with Z; returns the machine's output until it is silent.
fn run<X: Extension<3>>(
    session: &mut Session<'_, Cartesian, X>,
    pins: &Pins,
    program: &str,
) -> Vec<String> {
    session.send(program);
    for _ in 0..40_000 {
        session.wait_ms(1);
        pins.z.set(session.pins.position[2]);
    }
    session.lines()
}

#[test]
fn m3_goes_down_until_the_lower_switch_and_m5_up_until_the_upper_one() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let mut session = boot(&mut memory, tool(&pins));
    let said = run(&mut session, &pins, "G1X1F600\nM3S1000\nG1X2\n");
    assert_eq!(said, ["ok"; 3]);
    let [x, _, z] = session.pins.position;
    assert_eq!(x, 500);
    assert!((LOWER - SLOWS_DOWN - 3..=LOWER).contains(&z), "{z}");
    assert_eq!(session.pins.spindle, SpindleOutput::Off);
    run(&mut session, &pins, "M5\nG1X3\n");
    let [x, _, z] = session.pins.position;
    assert_eq!(x, 750);
    assert!((UPPER..=UPPER + SLOWS_DOWN + 3).contains(&z), "{z}");
    let z_mm = f64::from(z) / 250.0;
    assert!(
        session.status().contains(&format!(",{z_mm:.3}|")),
        "the program knows"
    );
}

#[test]
fn a_tool_that_is_there_stays_and_one_that_was_jogged_away_goes_back() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let mut session = boot(&mut memory, tool(&pins));
    run(&mut session, &pins, "M3\n");
    let z = session.pins.position[2];
    let pulses = session.pins.pulses[2];
    assert_eq!(run(&mut session, &pins, "M3\n"), ["ok"]);
    assert_eq!(session.pins.pulses[2], pulses);
    run(&mut session, &pins, "$J=G91Z3F300\n");
    assert_eq!(session.pins.position[2], z + 750);
    run(&mut session, &pins, "M3\n");
    assert!(session.pins.position[2] <= LOWER);
}

#[test]
fn a_switch_that_never_comes_is_an_alarm_and_the_next_try_works() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let mut session = boot(&mut memory, tool(&pins));
    pins.is_broken.set(true);
    let said = run(&mut session, &pins, "M3\nG1X5F600\n");
    assert!(said.contains(&"ALARM:230".to_owned()), "{said:?}");
    assert!(said.contains(&"[MSG:The tool does not reach its switch]".to_owned()));
    assert_eq!(session.pins.position, [0, 0, -15 * 250]);
    pins.is_broken.set(false);
    run(&mut session, &pins, "$X\n$J=G91Z5F300\n");
    let said = run(&mut session, &pins, "M5\n");
    assert_eq!(said.last().unwrap(), "ok", "{said:?}");
    assert!(session.pins.position[2] >= UPPER);
}

#[test]
fn a_reset_on_the_way_forgets_where_the_tool_is() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let mut session = boot(&mut memory, tool(&pins));
    session.send("M3\n");
    session.wait_ms(500);
    session.send([0x18]);
    let said = run(&mut session, &pins, "$X\n");
    assert!(said.contains(&"ALARM:3".to_owned()), "{said:?}");
    assert!(session.pins.position[2] > LOWER);
    run(&mut session, &pins, "M3\n");
    assert!(session.pins.position[2] <= LOWER);
}

#[test]
fn the_tool_is_down_before_the_rest_of_its_line_moves() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let mut session = boot(&mut memory, tool(&pins));
    session.send("G1F600M3X1\n");
    let mut beside = 0;
    for _ in 0..10_000 {
        session.wait_ms(1);
        let [x, _, z] = session.pins.position;
        pins.z.set(z);
        beside += i32::from(x > 0 && z > LOWER);
    }
    assert_eq!(session.lines(), ["ok"]);
    assert_eq!((session.pins.position[0], beside), (250, 0));
}

/// A nozzle that stays at 25 degrees.
struct Cold;

impl HeatPort for Cold {
    fn sensor(&mut self, _: usize) -> f32 {
        0.05
    }
    fn heat(&mut self, _: usize, _: bool) {}
}

#[test]
fn heaters_and_the_tool_are_one_extension() {
    let (mut memory, pins) = (Memory::new(), Pins::default());
    let config = HeatConfig {
        reference: 5.0,
        ..HeatConfig::default()
    };
    let nozzle = HeaterConfig {
        name: "N",
        sensor: Sensor::AD595,
        hysteresis: 2.0,
        limits: Limits::NOZZLE,
    };
    let heat: Heat<_, 1> = Heat::new(config, [nozzle], Cold).unwrap();
    let mut session = boot(&mut memory, (heat, tool(&pins)));
    let said = run(&mut session, &pins, "M3\nM105\n");
    assert_eq!(said, ["ok", "[HEAT:N,25.0,0.0]", "ok"]);
    assert!(session.pins.position[2] <= LOWER);
}
